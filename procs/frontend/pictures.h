#pragma once

#include <string>

#include "dmslam/dataset/image.h"
#include "dmslam/map/proposals.h"
#include "dmslam/map/tracked_frame.h"

namespace dmslam {

/// Writes the frame with used (green), rejected (yellow) and moving (red) features (paper figure 6) as
/// DIR/frame_000123.png. Throws InputError when the folder cannot be written.
void WritePicture(const std::string& dir, const GrayImage& image, const TrackedFrame& frame,
                  const FramePose& pose);

}  // namespace dmslam
