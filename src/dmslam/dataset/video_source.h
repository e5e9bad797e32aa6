#pragma once

#include <memory>
#include <string>

#include "dmslam/dataset/frame_source.h"

namespace dmslam {

/// Frames of a video file, decoded to raw BGR, played at the rate that the file states (at `fallback_fps`
/// where it states none). Reading forward is cheap; going back starts from the file's beginning. Throws
/// InputError for a file that cannot be decoded, and for every file where the project was built without
/// OpenCV's videoio.
std::unique_ptr<FrameSource> OpenVideo(const std::string& path, double fallback_fps);

}  // namespace dmslam
