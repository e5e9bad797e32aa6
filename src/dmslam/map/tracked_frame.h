#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "dmslam/map/keyframe.h"

namespace dmslam {

/// What became of a feature in tracking; also the colours of the pictures.
enum class FeatureClass : uint8_t {
  kNone = 0,      ///< no landmark
  kUsed = 1,      ///< sees a landmark where the map says (green)
  kRejected = 2,  ///< looked like a landmark, but not in its place (yellow)
  kMoving = 3,    ///< sees something that moves (red)
};

/// A frame and what of the map it sees.
struct TrackedFrame {
  uint32_t index = 0;
  int64_t stamp_ns = 0;
  std::shared_ptr<const FrameFeatures> features;
  Rigid3d T_cam_world;
  std::vector<LandmarkId> landmarks;  ///< parallel to the features
  std::vector<FeatureClass> classes;  ///< parallel to the features

  TrackedFrame() = default;
  TrackedFrame(uint32_t frame_index, int64_t stamp, std::shared_ptr<const FrameFeatures> seen)
      : index(frame_index),
        stamp_ns(stamp),
        features(std::move(seen)),
        landmarks(features->size()),
        classes(features->size(), FeatureClass::kNone) {}

  /// The frame that became a keyframe, with what the map says of it.
  static TrackedFrame Of(const Keyframe& keyframe) {
    TrackedFrame frame(keyframe.id.frame_index(), keyframe.stamp_ns, keyframe.features);
    frame.landmarks = keyframe.landmarks;
    frame.T_cam_world = keyframe.T_cam_world;
    return frame;
  }

  void ClearMatches() {
    landmarks.assign(features->size(), LandmarkId{});
    classes.assign(features->size(), FeatureClass::kNone);
  }
};

}  // namespace dmslam
