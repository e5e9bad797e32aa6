#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "dmslam/features/frame_features.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/motion_segmentation/match.h"
#include "dmslam/util/time.h"

namespace dmslam {

/// A frame as the initialiser needs it.
struct InitializerFrame {
  uint32_t index = 0;  ///< increases from frame to frame
  int64_t stamp_ns = 0;
  std::shared_ptr<const FrameFeatures> features;
};

/// Time from frame `from` to frame `to` [s]; negative where `to` comes first.
inline double SecondsFromTo(const InitializerFrame& from, const InitializerFrame& to) {
  return SecondsFromTo(from.stamp_ns, to.stamp_ns);
}

inline double SecondsFromTo(int64_t from_ns, const InitializerFrame& to) {
  return SecondsFromTo(from_ns, to.stamp_ns);
}

/// Why there is no first map yet: the later in the list, the farther the search has come.
enum class WaitReason : uint8_t {
  kNone = 0,              ///< there is one
  kTooFewFeatures,        ///< the frame has too few features
  kTooFewFrames,          ///< the window has just begun
  kTooFewMatches,         ///< the frame does not show enough of what the reference frame showed
  kTooLittleMotion,       ///< the picture has hardly moved since the reference frame
  kSelectionRefused,      ///< the selector refused a pair (its reason is in the text)
  kDistributionTooSmall,  ///< the static set is too compact: the motion is too complex
  kDisagreement,          ///< the pairs call different matches static
  kTooFewStatic,          ///< too few matches are static in all views
  kParallaxTooSmall,      ///< the points are seen under too small an angle
  kNoReconstruction,      ///< no pose, or an ambiguous one
  kInconsistent,          ///< the views between do not see the points where they should be
  kOnTrial,               ///< a map that other motions contend with must predict some more frames
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
  std::vector<Point> points;  ///< sorted by feature0; seen consistently in all views
  /// A frame between the two that shows some of the points.
  struct View {
    InitializerFrame frame;
    Rigid3d T_k_0;
    struct Sight {
      uint32_t point = 0;  ///< index into `points`
      uint32_t feature = 0;
    };
    std::vector<Sight> sights;  ///< sorted by point
  };
  std::vector<View> between;       ///< by time
  std::vector<Match> matches;      ///< of the pair, as indices and pixels
  std::vector<uint8_t> is_static;  ///< parallel to matches
  double median_parallax_rad = 0;
  int num_views = 0;  ///< frames that took part
};

/// A point seen in a view, for AdjustFunction.
struct InitialObservation {
  int pose = 0;
  int point = 0;
  Eigen::Vector2d uv_px = Eigen::Vector2d::Zero();
  double inv_sigma_squared = 1.0;
};
/// Poses and points adjusted together; T_cam_world[0] is held (AdjustInitialMap; handed in, so that a test
/// can do without). Returns false when it has failed.
using AdjustFunction =
    std::function<bool(std::vector<Rigid3d>* T_cam_world, std::vector<Eigen::Vector3d>* points,
                       std::span<const InitialObservation> observations)>;

}  // namespace dmslam
