#pragma once

#include <optional>

#include "dmslam/map/proposals.h"

namespace dmslam {

/// What a frame saw and what was told of it: all that another frontend needs to find its last pose.
struct RememberedFrame {
  KeyframeProposal seen;          ///< its features, and the landmarks that it used
  std::optional<FramePose> pose;  ///< none: it was told without a pose
};

}  // namespace dmslam
