#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"

namespace dmslam {

// Epipolar geometry of two views. Everywhere: view 1 to view 2, x2^T F x1 = 0 with undistorted pixels, x2^T E
// x1 = 0 with rays, x2 ~ H x1, and poses T_cam2_cam1. Solvers for a sample take `indices` into the full
// arrays, so that a RANSAC loop copies nothing; no solver for a sample allocates.

// ---- Fundamental matrix ----

/// Hartley's normalised eight-point method (PAMI 1997) on exactly eight matches: null vector by elimination
/// with full pivoting, then the rank-2 constraint. None for a degenerate sample.
std::optional<Eigen::Matrix3d> FundamentalEightPointMinimal(std::span<const Eigen::Vector2d> x1_px,
                                                            std::span<const Eigen::Vector2d> x2_px,
                                                            std::span<const int, 8> indices);

/// The same in the least-squares sense over the n >= 8 matches named by `indices` (all matches if it is
/// empty); `weights`, if not empty, is parallel to x1_px. None if there are too few or they are degenerate.
std::optional<Eigen::Matrix3d> FundamentalEightPoint(std::span<const Eigen::Vector2d> x1_px,
                                                     std::span<const Eigen::Vector2d> x2_px,
                                                     std::span<const int> indices = {},
                                                     std::span<const double> weights = {});

// ---- Essential matrix ----

/// Five rays in each view (z = 1 or any length); up to ten solutions, written to `models`; returns how many.
/// The method of Nister, "An Efficient Solution to the Five-Point Relative Pose Problem" (PAMI 2004):
/// elimination to a polynomial of degree ten, whose real roots are isolated with Sturm's theorem.
int EssentialFivePoint(std::span<const Eigen::Vector3d> rays1, std::span<const Eigen::Vector3d> rays2,
                       std::span<const int, 5> indices, std::array<Eigen::Matrix3d, 10>& models);

/// Least squares over n >= 8 rays (z = 1), then projected to the essential matrices.
std::optional<Eigen::Matrix3d> EssentialEightPoint(std::span<const Eigen::Vector3d> rays1,
                                                   std::span<const Eigen::Vector3d> rays2,
                                                   std::span<const int> indices = {});

/// E = K2^T F K1, made essential (two equal singular values, one zero), of unit Frobenius norm.
Eigen::Matrix3d EssentialFromFundamental(const Eigen::Matrix3d& F, const Pinhole& camera1,
                                         const Pinhole& camera2);
/// F = K2^-T E K1^-1, of unit Frobenius norm.
Eigen::Matrix3d FundamentalFromEssential(const Eigen::Matrix3d& E, const Pinhole& camera1,
                                         const Pinhole& camera2);
/// E = [t]x R.
Eigen::Matrix3d EssentialFromPose(const Rigid3d& T_cam2_cam1);
/// The nearest matrix with singular values (1, 1, 0) / sqrt(2).
Eigen::Matrix3d ProjectToEssential(const Eigen::Matrix3d& E);

/// The four poses of an essential matrix, |t| = 1 (Hartley and Zisserman, 2nd ed., Result 9.19).
std::array<Rigid3d, 4> DecomposeEssential(const Eigen::Matrix3d& E);

// ---- Homography ----

/// Normalised DLT on four matches; none if three of them are collinear in either view.
std::optional<Eigen::Matrix3d> HomographyFourPoint(std::span<const Eigen::Vector2d> x1_px,
                                                   std::span<const Eigen::Vector2d> x2_px,
                                                   std::span<const int, 4> indices);
/// Normalised DLT over n >= 4 matches.
std::optional<Eigen::Matrix3d> HomographyLinear(std::span<const Eigen::Vector2d> x1_px,
                                                std::span<const Eigen::Vector2d> x2_px,
                                                std::span<const int> indices = {});

/// One interpretation of a homography: R + t n^T / d, with the translation in units of the plane's distance d
/// from camera 1, and the plane's unit normal in camera 1.
struct PlaneMotion {
  Rigid3d T_cam2_cam1;
  Eigen::Vector3d normal_cam1 = Eigen::Vector3d::UnitZ();
};
/// The interpretations of H (pixels) with both cameras on the same side of the plane: at most four, two and
/// each with normal and translation reversed (Ma, Soatto, Kosecka, Sastry, "An Invitation to 3-D Vision",
/// Theorem 5.19; the other four of Faugeras and Lustman have the plane between the cameras). A pure rotation
/// gives one, with zero translation.
std::vector<PlaneMotion> DecomposeHomography(const Eigen::Matrix3d& H, const Pinhole& camera1,
                                             const Pinhole& camera2);

// ---- Which pose ----

struct PoseChoiceOptions {
  double max_reprojection_error_squared_px =
      4.0;                        ///< In both views, times the match's sigma squared where given.
  double min_parallax_rad = 0.0;  ///< Matches below it do not enter `points`, but count as in front.
};

/// The pose among candidates under which most matches are seen in front of both cameras.
struct PoseChoice {
  Rigid3d T_cam2_cam1;
  int num_good = 0;         ///< Matches in front of both cameras and within the reprojection error.
  int num_good_second = 0;  ///< The same for the runner-up.
  double parallax_rad =
      0.0;  ///< The 50th largest parallax of the good matches (the smallest if fewer), as ORB-SLAM2.
  double median_parallax_rad = 0.0;
  std::vector<char> good;                    ///< Parallel to the matches.
  std::vector<Eigen::Vector3d> points_cam1;  ///< Parallel to the matches; meaningful where good.
};

/// Counts for every candidate the matches (restricted to mask[i] != 0 if the mask is not empty) that
/// triangulate well. Nothing if there are no candidates. `sigma_squared`, if not empty, is parallel to the
/// matches.
std::optional<PoseChoice> ChoosePose(std::span<const Rigid3d> candidates_cam2_cam1, const Pinhole& camera,
                                     std::span<const Eigen::Vector2d> x1_px,
                                     std::span<const Eigen::Vector2d> x2_px, std::span<const char> mask = {},
                                     std::span<const double> sigma_squared = {},
                                     const PoseChoiceOptions& options = {});

/// ChoosePose over DecomposeEssential, counting only cheirality: the cheap choice inside a robust loop.
/// Returns the number of matches in front of both cameras under the best pose; the matches are those named by
/// `indices`.
int PoseFromEssential(const Eigen::Matrix3d& E, std::span<const Eigen::Vector3d> rays1,
                      std::span<const Eigen::Vector3d> rays2, std::span<const int> indices,
                      Rigid3d& T_cam2_cam1);

/// Gauss-Newton on Sampson's error [px] over the five degrees of freedom of the relative pose (|t| stays),
/// for the matches named by `indices`. Unlike the linear fits it needs no general scene: planes are as good.
/// `weights`, if not empty, is parallel to the matches (1 / sigma^2); with `huber_px` > 0 larger errors count
/// linearly. Returns the refined pose, or the given one where the error did not fall.
Rigid3d RefineRelativePose(const Pinhole& camera, const Rigid3d& T_cam2_cam1,
                           std::span<const Eigen::Vector2d> x1_px, std::span<const Eigen::Vector2d> x2_px,
                           std::span<const int> indices, std::span<const double> weights = {},
                           double huber_px = 0.0, int iterations = 5);

// ---- Residuals ----

/// Sampson's first-order approximation of the squared distance to the epipolar variety [px^2 if F is in
/// pixels].
inline double SampsonErrorSquared(const Eigen::Matrix3d& F, const Eigen::Vector2d& x1,
                                  const Eigen::Vector2d& x2) {
  const double a = F(0, 0) * x1.x() + F(0, 1) * x1.y() + F(0, 2);
  const double b = F(1, 0) * x1.x() + F(1, 1) * x1.y() + F(1, 2);
  const double c = F(2, 0) * x1.x() + F(2, 1) * x1.y() + F(2, 2);
  const double d = F(0, 0) * x2.x() + F(1, 0) * x2.y() + F(2, 0);
  const double e = F(0, 1) * x2.x() + F(1, 1) * x2.y() + F(2, 1);
  const double algebraic = x2.x() * a + x2.y() * b + c;
  return algebraic * algebraic / (a * a + b * b + d * d + e * e);
}

/// Squared distance [px^2] of x2 to the epipolar line of x1 in view 2. For view 1, call it with F^T and the
/// points exchanged.
inline double EpipolarDistanceSquared(const Eigen::Matrix3d& F, const Eigen::Vector2d& x1,
                                      const Eigen::Vector2d& x2) {
  const double a = F(0, 0) * x1.x() + F(0, 1) * x1.y() + F(0, 2);
  const double b = F(1, 0) * x1.x() + F(1, 1) * x1.y() + F(1, 2);
  const double c = F(2, 0) * x1.x() + F(2, 1) * x1.y() + F(2, 2);
  const double algebraic = x2.x() * a + x2.y() * b + c;
  return algebraic * algebraic / (a * a + b * b);
}

/// Squared transfer error [px^2] of x1 into view 2. With the inverse of H and the points exchanged: into
/// view 1.
inline double TransferErrorSquared(const Eigen::Matrix3d& H, const Eigen::Vector2d& x1,
                                   const Eigen::Vector2d& x2) {
  const Eigen::Vector3d y = H * x1.homogeneous();
  return (y.hnormalized() - x2).squaredNorm();
}

}  // namespace dmslam
