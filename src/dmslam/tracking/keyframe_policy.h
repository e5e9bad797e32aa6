#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/map/map.h"
#include "dmslam/tracking/tracking_options.h"

namespace dmslam {

/// What decides whether a tracked frame becomes a keyframe.
struct KeyframeInputs {
  int num_static = 0;               ///< landmarks of the map that the frame sees in their place
  int expected = 0;                 ///< landmarks of its reference keyframe that enough other keyframes see
  std::optional<int64_t> since_ns;  ///< between it and the keyframe before; none: there was none
  std::optional<int64_t> step_ns = std::nullopt;  ///< between two frames; none: not known
};

/// Whether the frame sees so much less of the map than its reference keyframe did that the map should grow
/// here, and that is due: some time has passed, or tracking becomes weak. Where no frame comes just then, the
/// one before is taken: at 15 Hz every frame may be one, since every other one would be too few.
bool WantsKeyframe(const KeyframeOptions& options, const KeyframeInputs& inputs);

/// Landmarks of `reference` that a frame beside it can be expected to see.
int ExpectedOf(const Map& map, const Keyframe& reference);

}  // namespace dmslam
