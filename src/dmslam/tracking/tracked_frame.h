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

/// A frame in tracking.
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

  void ClearMatches() {
    landmarks.assign(features->size(), LandmarkId{});
    classes.assign(features->size(), FeatureClass::kNone);
  }
};

/// A frame that waits for a pose: features alone, as many wait for long.
struct WaitingFrame {
  uint32_t index = 0;
  int64_t stamp_ns = 0;
  FeatureSet features;

  explicit WaitingFrame(const TrackedFrame& frame)
      : WaitingFrame(frame.index, frame.stamp_ns, frame.features->set) {}
  WaitingFrame(uint32_t frame_index, int64_t frame_stamp_ns, FeatureSet frame_features)
      : index(frame_index), stamp_ns(frame_stamp_ns), features(std::move(frame_features)) {}
  TrackedFrame ToTracked(const Camera& camera, const Pyramid& pyramid) && {
    return {index, stamp_ns, MakeFrameFeatures(std::move(features), camera, pyramid)};
  }
};

}  // namespace dmslam
