#pragma once

#include <optional>

#include "dmslam/map/keyframe.h"
#include "dmslam/map/landmark.h"
#include "dmslam/map/map_delta.h"

namespace dmslam {

/// All of a keyframe's own state, as records carry it.
inline KeyframeState StateOf(const Keyframe& keyframe, bool with_features) {
  KeyframeState state{keyframe.id,          keyframe.map_id, keyframe.stamp_ns,
                      keyframe.T_cam_world, keyframe.scale,  keyframe.parent,
                      keyframe.loop_edges,  nullptr,         keyframe.camera_id};
  if (with_features) state.features = {keyframe.features, &keyframe.features->set};
  return state;
}

/// What feature `feature` of a keyframe observes; none: nothing.
inline std::optional<LandmarkId> ObservedBy(const Keyframe& keyframe, size_t feature) {
  const LandmarkId id = keyframe.landmarks[feature];
  return id.valid() ? std::optional(id) : std::nullopt;
}

/// All of a landmark's own state.
inline LandmarkState StateOf(const Landmark& landmark) {
  return {landmark.id,        landmark.map_id,         landmark.p_world,  landmark.descriptor,
          landmark.reference, landmark.first_keyframe, landmark.first_ns, landmark.evidence};
}

}  // namespace dmslam
