#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/motion_segmentation/match.h"
#include "dmslam/motion_segmentation/static_selector.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

/// Why two frames and their matches give no map.
enum class ReconstructionRefusal : uint8_t {
  kNone = 0,
  kNoModel,           ///< no epipolar geometry or homography
  kAmbiguous,         ///< two poses explain the matches about equally well
  kTooFewPoints,      ///< too few matches triangulate well
  kParallaxTooSmall,  ///< the points' parallax is below the bound
};
std::string_view ToString(ReconstructionRefusal refusal);

struct ReconstructionOptions {
  int min_points = 50;               ///< triangulated points, at least
  double min_parallax_rad = 0.0175;  ///< of the points, by ORB-SLAM2's measure: the 50th largest
  double max_runner_up = 0.7;        ///< the second best pose may explain this share of what the best does
  double max_reprojection_squared_px = 4.0;  ///< in both views, times the octaves' variance
  Pyramid pyramid;
};

/// Pose of camera 1 from camera 0 and the points seen by both. |translation| is 1.
struct TwoViewReconstruction {
  ReconstructionRefusal refusal = ReconstructionRefusal::kNone;
  std::string explanation;
  Rigid3d T_1_0;
  std::vector<uint8_t> has_point;            ///< parallel to the matches
  std::vector<Eigen::Vector3d> points_cam0;  ///< parallel to the matches; meaningful where has_point
  int num_points = 0;
  double parallax_rad = 0;  ///< ORB-SLAM2's measure: the 50th largest, or the smallest of fewer
  double median_parallax_rad = 0;
  bool from_homography = false;  ///< the baseline: which model was taken

  bool IsUsable() const { return refusal == ReconstructionRefusal::kNone; }
};

/// The map of the matches that `selection` calls static: E (or F with K) decomposed, the pose with most
/// points in front of both cameras, gates of `options`.
TwoViewReconstruction ReconstructFromStatic(std::span<const Match> matches, const StaticSelection& selection,
                                            const Camera& camera, const ReconstructionOptions& options);

struct HomographyOrFundamentalOptions {
  int iterations = 200;  ///< samples of eight; each gives a homography and a fundamental matrix
  double sigma_px = 1.0;
  double chi2_fundamental = kChiSquared1Dof;
  double chi2_homography = kChiSquared2Dof;
  double homography_share = 0.40;  ///< H is taken when its share of the score S_H / (S_H + S_F) exceeds this
  double max_runner_up_homography = 0.75;
  ReconstructionOptions reconstruction;
};

/// The baseline initialiser: homography or fundamental matrix by score, plain RANSAC, then decomposition and
/// checks, with ORB-SLAM2's constants (Mur-Artal, Montiel, Tardos, "ORB-SLAM", TRO 2015, Sec. IV).
TwoViewReconstruction ReconstructBaseline(std::span<const Match> matches, const Camera& camera,
                                          const HomographyOrFundamentalOptions& options, uint64_t seed);

}  // namespace dmslam
