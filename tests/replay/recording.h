#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/slam/slam.h"

namespace dmslam::replay {

/// What the frontend computes from one image, and all that it takes of it.
struct FrameInput {
  uint32_t index = 0;
  int64_t stamp_ns = 0;
  FeatureSet features;
};

/// The frontend's input over an excerpt of a sequence.
using Recording = std::vector<FrameInput>;

/// As bytes: each frame as a keyframe's message, behind its length.
std::vector<uint8_t> ToBytes(const Recording& recording);
/// None where the bytes are no recording.
std::optional<Recording> FromBytes(const std::vector<uint8_t>& bytes);

}  // namespace dmslam::replay
