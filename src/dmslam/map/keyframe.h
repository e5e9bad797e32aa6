#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/frame_features.h"
#include "dmslam/features/types.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Undistorts the keypoints of `set` and indexes them. Keypoints whose distortion cannot be inverted are
/// dropped.
std::shared_ptr<const FrameFeatures> MakeFrameFeatures(FeatureSet set, const Camera& camera,
                                                       const Pyramid& pyramid);

/// A keyframe of the map. `landmarks[i]` is the landmark that feature i observes (invalid: none).
struct Keyframe {
  KeyframeId id;
  MapId map_id = 0;
  int64_t stamp_ns = 0;
  Rigid3d T_cam_world;
  double scale = 1.0;                  ///< product of the scales of all corrections since it was made
  std::optional<KeyframeId> parent;    ///< spanning tree; none: a map's first keyframe
  std::vector<KeyframeId> loop_edges;  ///< sorted
  std::shared_ptr<const FrameFeatures> features;
  std::vector<LandmarkId> landmarks;
  CameraId camera_id = 0;

  // Derived from the above, the same in every replica but for the order of `seen`.
  std::vector<LandmarkId> seen;         ///< the valid ones of `landmarks`
  std::map<KeyframeId, int> covisible;  ///< landmarks seen in common (at least one)
};

}  // namespace dmslam
