#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dmslam/dataset/frame_source.h"
#include "dmslam/slam/slam.h"
#include "recording.h"

namespace dmslam::replay {

/// What a run leaves, as bytes that are compared.
struct Outcome {
  std::string final;   ///< trajectory in TUM format
  std::string online;  ///< the same, of the poses as they were tracked
  std::string map;     ///< the records of a snapshot
  size_t keyframes = 0, landmarks = 0;
};

/// Runs the SLAM on frames [first, first + count) of a sequence. `recording`, if not null: gets the features
/// of each.
Outcome RunOnImages(const Slam::Setup& setup, FrameSource& frames, size_t first, size_t count,
                    Recording* recording);
/// Runs it on what was recorded.
Outcome RunOnFeatures(const Slam::Setup& setup, const Recording& recording);
/// Drives the cores one by one, each with a replica of its own, as processes do in lock-step: what one tells
/// another is encoded and decoded on its way.
Outcome RunCores(const Slam::Setup& setup, const Recording& recording);

}  // namespace dmslam::replay
