#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/motion_segmentation/match.h"
#include "dmslam/motion_segmentation/static_selector.h"
#include "dmslam/util/random.h"
#include "dmslam/util/vector_path.h"

namespace dmslam {

/// Matches as parallel arrays of normalised image coordinates (rays with z = 1), which is what the inner
/// loops read. Variances are of the coordinates, i.e. (sigma scale / f)^2.
struct MatchArrays {
  std::vector<float> x0, y0, x1, y1;
  std::vector<float> bound0, bound1;        ///< chi2 * variance of the point in frame 0, 1
  std::vector<Eigen::Vector2d> p0, p1;      ///< the same points for the solvers of samples
  std::vector<Eigen::Vector3d> ray0, ray1;  ///< the same with z = 1

  size_t size() const { return x0.size(); }
  bool empty() const { return x0.empty(); }
};

/// A contiguous part of MatchArrays.
struct Range {
  size_t begin = 0;
  size_t end = 0;
  size_t size() const { return end - begin; }
};

/// `order[k]` is the match that becomes element k.
MatchArrays MakeArrays(std::span<const Match> matches, std::span<const uint32_t> order, const Camera& camera,
                       const InlierOptions& options);

/// A two-view hypothesis in normalised coordinates: ray1^T M ray0 = 0. For essential matrices M = Hat(t) R
/// and T_1_0 = (R, t) with |t| = 1, one of the four that share M.
struct TwoViewModel {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
};

/// Squared Sampson distance divided by its bound: at most 1 for an inlier (Hartley and Zisserman, Multiple
/// View Geometry, 2nd ed., Eq. 11.9, with each image's error weighted by its variance).
double NormalizedSampson(const Eigen::Matrix3d& M, const MatchArrays& arrays, size_t i);

/// How many of `range` are inliers, where these are more than `more_than`; else some number up to it.
int CountInliers(const Eigen::Matrix3d& M, const MatchArrays& arrays, Range range, int more_than = -1,
                 VectorPath path = VectorPath::kWidest);
/// Flags of all of `range` into flags[range.begin .. range.end).
int FlagInliers(const Eigen::Matrix3d& M, const MatchArrays& arrays, Range range, std::span<uint8_t> flags,
                VectorPath path = VectorPath::kWidest);
/// The same for a rotation alone: transfer error of ray0 into image 1 against both points' variance.
int CountRotationInliers(const Eigen::Matrix3d& R, const MatchArrays& arrays, Range range);

/// Models through one minimal sample of `range`, written to `models`; returns how many. Eight matches for the
/// fundamental, five for the essential matrix (whose R and t are left open).
constexpr size_t kMaxModels = 10;
int SolveSample(ModelKind kind, const MatchArrays& arrays, Range range, Random& random,
                std::array<Eigen::Matrix3d, kMaxModels>& models);
constexpr int SampleSize(ModelKind kind) { return kind == ModelKind::kFundamental ? 8 : 5; }

/// The pose of an essential matrix under which most of `use` lie in front of both cameras.
void ChooseEssentialPose(const MatchArrays& arrays, std::span<const uint8_t> use, TwoViewModel* model);

/// Least squares on the matches flagged, all of them weighted by their variance and Sampson's denominator.
/// For the essential kind starts from model->R and t. False when it is not determined. A model refitted to
/// the matches flagged (RefineFundamental or RefineEssential).
bool Refine(ModelKind kind, const MatchArrays& arrays, std::span<const uint8_t> use, int iterations,
            TwoViewModel* model);
bool RefineFundamental(const MatchArrays& arrays, std::span<const uint8_t> use, TwoViewModel* model);
/// `bound_scale` widens the robust cost's bounds (squared).
bool RefineEssential(const MatchArrays& arrays, std::span<const uint8_t> use, int iterations,
                     TwoViewModel* model, double bound_scale = 1.0);

/// The rotation that takes rays of frame 0 best into those of frame 1, over the matches flagged; starts from
/// R.
bool RefineRotation(const MatchArrays& arrays, std::span<const uint8_t> use, int iterations,
                    Eigen::Matrix3d* R);

/// A local minimum of the robust epipolar cost: mean over the matches of s / (1 + s), s the normalised
/// Sampson distance.
struct EssentialMinimum {
  TwoViewModel model;
  double cost = 0;
};
struct MinimaOptions {
  int directions = 8;        ///< starts spread over the half sphere of directions
  int samples = 60;          ///< samples of five matches
  size_t samples_kept = 8;   ///< the best models of which are starts, too
  size_t max_matches = 300;  ///< of more matches every k-th takes part
};
/// The epipolar cost has several minima when the parallax is small or the scene nearly flat, and a sample may
/// lead to any of them. Descends from many starts and returns the distinct minima, the lowest first.
std::vector<EssentialMinimum> FindEssentialMinima(const MatchArrays& arrays, std::span<const uint8_t> use,
                                                  const MinimaOptions& options, uint64_t seed);

/// Standard deviation [rad] of the direction of translation along which it is least certain, from the
/// residuals of the matches flagged (their bounds are chi2 times their variance); pi where it is not
/// determined at all.
double DirectionSigma(const MatchArrays& arrays, std::span<const uint8_t> use, double chi2,
                      const TwoViewModel& model);

/// Writes F, E and kind of `model` into `selection`.
void StoreModel(const TwoViewModel& model, ModelKind kind, const Camera& camera, StaticSelection* selection);

/// Root of D (paper Eq. 3) of the points, [px]; 0 for none.
double Spread(std::span<const Eigen::Vector2d> points_px);

}  // namespace dmslam
