#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/frame_features.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/initialization/pair_agreement.h"
#include "dmslam/initialization/two_view_reconstruction.h"
#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {

/// A frame as the initialiser needs it.
struct InitializerFrame {
  uint32_t index = 0;  ///< increases from frame to frame
  int64_t stamp_ns = 0;
  std::shared_ptr<const FrameFeatures> features;
};

/// Why there is no first map yet.
enum class WaitReason : uint8_t {
  kNone = 0,              ///< there is one
  kTooFewFeatures,        ///< the frame has too few features
  kTooFewFrames,          ///< the window has just begun
  kTooFewMatches,         ///< the frame does not show enough of what the reference frame showed
  kTooLittleMotion,       ///< the picture has hardly moved since the reference frame
  kSelectionRefused,      ///< the selector refused a pair (its reason is in the text)
  kDistributionTooSmall,  ///< the static set is too compact: the motion is too complex
  kDisagreement,          ///< the pairs call different matches static, or their rotations do not compose
  kTooFewStatic,          ///< too few matches are static in all views
  kParallaxTooSmall,      ///< the points are seen under too small an angle
  kNoReconstruction,      ///< no pose, or an ambiguous one
  kInconsistent,          ///< the views between do not see the points where they should be
};
std::string_view ToString(WaitReason reason);

/// The first map.
struct FirstMap {
  InitializerFrame frame0;  ///< the first keyframe: its camera is the world's origin
  InitializerFrame frame1;  ///< the second; the frame just added or an earlier one
  Rigid3d T_1_0;            ///< median depth of the points in camera 0 is 1
  struct Point {
    uint32_t feature0 = 0;
    uint32_t feature1 = 0;
    Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< in camera 0
  };
  std::vector<Point> points;       ///< sorted by feature0; seen consistently in all views
  std::vector<Match> matches;      ///< of the pair, as indices and pixels
  std::vector<uint8_t> is_static;  ///< parallel to matches
  double median_parallax_rad = 0;
  int num_views = 0;  ///< frames that took part
};

/// What AddFrame answers.
struct InitializerReport {
  WaitReason wait = WaitReason::kTooFewFrames;
  std::string reason;              ///< the same in a sentence, with the numbers
  std::optional<FirstMap> result;  ///< set exactly when wait is kNone
  int num_matches = 0;             ///< between the reference and this frame
  int num_static = 0;
  double distribution_px = 0;
  double agreement = 0;  ///< smallest Jaccard index between the pairs' static sets
  double parallax_rad = 0;
};

/// A point seen in a view, for AdjustFunction.
struct InitialObservation {
  int pose = 0;
  int point = 0;
  Eigen::Vector2d uv_px = Eigen::Vector2d::Zero();
  double inv_sigma_squared = 1.0;
};
/// Poses and points adjusted together; T_cam_world[0] is held. The bundle adjustment lives in a room above
/// this one, so the caller hands it in. Returns false when it has failed.
using AdjustFunction =
    std::function<bool(std::vector<Rigid3d>* T_cam_world, std::vector<Eigen::Vector3d>* points,
                       std::span<const InitialObservation> observations)>;

struct InitializerOptions {
  /// Fewer samples than the selector's own default, stricter agreement.
  InitializerOptions() {
    selector.sampling.max_iterations = 600;
    // Agreement over pairs and the comparison of motions over all views decide what one pair leaves open.
    selector.max_rival_share = 0;
    agreement.min_agreement = 0.87;
    agreement.min_distribution_px = 140;
  }

  std::string method = "dlrsac";  ///< which matches are static, per pair of frames: dlrsac, arsac or ransac
  DlrsacOptions selector;      ///< of DLRSAC; its sampling, input and inlier options hold for the others, too
  AgreementOptions agreement;  ///< what several pairs must agree on
  ReconstructionOptions reconstruction;
  MatchingOptions matching;

  int min_features = 100;  ///< a frame with fewer takes no part
  int frame_step = 2;      ///< every so manieth frame is matched; between them only what was left over
  int num_pairs = 3;       ///< pairs with the reference frame that must agree
  int min_pair_step = 5;   ///< the frames of two such pairs are apart by so much at least [frames]
  double max_age_s = 0.9;  ///< an older reference frame is given up for a newer one
  double max_promising_age_s = 2.0;  ///< the same where the pairs agree and only parallax is missing
  int max_views = 8;                 ///< frames after the reference frame that a map is made of, at most
  int max_adjusted = 300;            ///< points that rival motions are adjusted with; the winner takes all
  int min_matches = 120;             ///< of a frame with the reference frame; fewer: a newer reference frame
  double min_displacement_px = 8.0;  ///< median displacement of the matches before a pair is worth its cost

  MinimaOptions minima;             ///< how the motion of the pair is searched
  double minima_slack = 1.5;        ///< a minimum with up to so many times the lowest cost is looked at, too
  double min_runner_up_cost = 1.5;  ///< another motion must cost all views this many times as much
  double min_parallax_rad = 0.020;  ///< median over the points; below it the direction is chance
  double max_direction_sigma_rad =
      0.035;                   ///< standard deviation of the direction of translation, from the residuals
  double max_view_chi2 = 9.0;  ///< a view agrees with a point: squared reprojection error / variance
  double min_consistent_share = 0.75;  ///< of the points that a view between shows, where they should be
  int min_points = 80;                 ///< points that all views agree on

  double past_s = 0.45;  ///< frames that are older than the reference frame by up to so much testify:
                         ///< who has just stopped is in his place in all views, but not in them
  int past_views = 6;    ///< so many of them at most; 0: none
  double max_past_conflict = 0.08;  ///< of the points, that one of them sees elsewhere; more: wait
  int past_first = 0;  ///< so many frames come before the first reference frame: they testify only

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("initializer.min_matches", min_matches, 8, 10000, "",
             "matches a frame must have with the reference frame");
    v.Number("initializer.num_pairs", num_pairs, 1, 5, "", "pairs of frames that must agree");
    agreement.Describe(v);
    v.Number("initializer.min_parallax_rad", min_parallax_rad, 0, 1, "rad",
             "median parallax of the first map's points");
    selector.Describe(v);
  }
};

/// Makes the first map out of a stream of frames: keeps a reference frame, asks DLRSAC for the static matches
/// between it and frames after it, waits until several such pairs agree and the parallax suffices, and keeps
/// the points that all views see consistently. A wrong start is worse than a late one. Same frames, options
/// and seed: same answers.
class Initializer {
 public:
  Initializer(const InitializerOptions& options, const Camera& camera, uint64_t seed,
              AdjustFunction adjust = {});
  ~Initializer();

  /// Frames come in order, each once. After a result the initialiser starts over with the next frame.
  InitializerReport AddFrame(const InitializerFrame& frame);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dmslam
