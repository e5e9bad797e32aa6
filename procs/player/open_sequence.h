#pragma once

#include <memory>
#include <string>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/frame_source.h"
#include "player/player_options.h"

namespace dmslam {

/// The camera file given, or where that is empty the camera that is known for the sequence. Throws InputError
/// where none is.
Camera ChooseCamera(const std::string& camera_file, const std::string& sequence);

/// Opens options->sequence and sets options->camera. `fps`: rate of what carries no stamps; 0: the camera
/// file's. Throws InputError.
std::unique_ptr<FrameSource> OpenSequence(const std::string& camera_file, double fps, PlayerOptions* options);

/// The frames as camera `as` would have taken them, which options->camera is from now on. Throws InputError
/// where the camera that took them does not see the same.
std::unique_ptr<FrameSource> TellBy(const Camera& as, std::unique_ptr<FrameSource> source,
                                    PlayerOptions* options);

}  // namespace dmslam
