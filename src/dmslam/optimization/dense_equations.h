#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/vector_path.h"

namespace dmslam {

/// A point seen in a view.
struct BundleSight {
  size_t observation = 0;
  size_t pose = 0;
  std::optional<size_t> free_pose;  ///< its place among those that are adjusted; none: the pose is held
  Eigen::Vector2d uv_px;
  double inv_sigma = 0;
  bool counts = false;
};

/// By point, then by pose; those of poses that are held first.
struct BundleSights {
  std::vector<BundleSight> all;
  std::vector<size_t> first;  ///< of each point, and how many there are

  size_t num_points() const { return first.size() - 1; }
};

/// What an error that is far off counts: Huber's loss, or Cauchy's.
struct BundleRobustLoss {
  bool cauchy = false;
  double huber_delta = 1, cauchy_width = 1;

  /// Of a squared error.
  double Of(double squared) const {
    if (cauchy) {
      const double width_squared = cauchy_width * cauchy_width;
      return width_squared * std::log(1.0 + squared / width_squared);
    }
    if (squared <= huber_delta * huber_delta) return squared;
    return 2.0 * huber_delta * std::sqrt(squared) - huber_delta * huber_delta;
  }
  /// Of the loss, there.
  double Slope(double squared) const {
    if (cauchy) return 1.0 / (1.0 + squared / (cauchy_width * cauchy_width));
    return squared <= huber_delta * huber_delta ? 1.0 : huber_delta / std::sqrt(squared);
  }
};

/// Where poses and points are.
struct BundlePlace {
  const std::vector<Rigid3d>& T_cam_world;
  const std::vector<Eigen::Matrix3d>& rotations;  ///< of these poses
  const std::vector<Eigen::Vector3d>& points;
  std::span<const char> point_held;  ///< one flag per point; empty: none is
};

/// Six numbers of a pose, (w, v), and two zeros: the widest vectors take them at once.
inline constexpr int kPoseSize = 6;
struct alignas(64) PoseColumn {
  std::array<double, 8> row{};

  Eigen::Map<const Eigen::Matrix<double, kPoseSize, 1>> Numbers() const {
    return Eigen::Map<const Eigen::Matrix<double, kPoseSize, 1>>(row.data());
  }
};
/// Of two poses, or of a pose and a point, column by column.
using PoseBlock = std::array<PoseColumn, kPoseSize>;
using PointBlock = std::array<PoseColumn, 3>;

/// The normal equations of a bundle: J^T W J x = -J^T W e, with x six numbers for each pose that is adjusted
/// and three for each point. Its points are taken out of them by the Schur complement.
struct DenseEquations {
  std::vector<PoseBlock> poses;                 ///< lower half, row by row: see Pose()
  std::vector<PoseColumn> gradient;             ///< of each pose
  std::vector<PoseColumn> reduced;              ///< the same without the points
  std::vector<PointBlock> couplings;            ///< of each sight: pose with point
  std::vector<Eigen::Matrix3d> points;          ///< of each point's own equations
  std::vector<Eigen::Matrix3d> point_inverses;  ///< of these, damped; zero: the point stays where it is
  std::vector<Eigen::Vector3d> point_gradients;

  DenseEquations(size_t free_poses, const BundleSights& sights);
  size_t num_poses() const { return gradient.size(); }
  PoseBlock& Pose(size_t k, size_t l) { return poses[k * (k + 1) / 2 + l]; }
};

/// Half the loss of all errors; of a point at or behind a camera that of kErrorBehind.
double CostOf(const Pinhole& camera, const BundleRobustLoss& loss, const BundleSights& sights,
              const BundlePlace& place, VectorPath widest = VectorPath::kWidest);

/// The equations at a place. As wide as the machine's vectors are, up to `widest`; the numbers are the same.
void SetEquations(const Pinhole& camera, const BundleRobustLoss& loss, const BundleSights& sights,
                  const BundlePlace& place, DenseEquations* equations,
                  VectorPath widest = VectorPath::kWidest);

/// Takes the points out of the poses' equations, damped by this share of their diagonal. A point that is
/// held, or that nobody sees, has an inverse of zero.
void EliminatePoints(const BundleSights& sights, double damping, DenseEquations* equations,
                     VectorPath widest = VectorPath::kWidest);

}  // namespace dmslam
