#pragma once

#include "collector/durations.h"
#include "dmslam/wire/frontend_messages.h"

namespace dmslam {

/// What frames took.
struct FrameDurations {
  DurationHistogram step;   ///< of the frontend
  DurationHistogram apart;  ///< ... without decoding
  DurationHistogram decode, extract;
  DurationHistory image_to_pose;  ///< from when the player published it

  void Add(const FrameTrace& trace);
};

}  // namespace dmslam
