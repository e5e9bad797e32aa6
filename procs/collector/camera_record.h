#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// As the player said it at the end, or else as far as is known.
struct PlayedFrames {
  int64_t published = 0, missing = 0, blacked = 0, jumped = 0;
  std::optional<uint32_t> first_index = std::nullopt;  ///< none: not announced
};

/// One camera's part in a run.
struct CameraRecord {
  std::string sequence, ground_truth;
  std::vector<StampedPose> heard_ground_truth;  ///< as the player told it: kept where there is no file
  PlayedFrames frames;
  FrontendStatus frontend;
};

}  // namespace dmslam
