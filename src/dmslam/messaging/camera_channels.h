#pragma once

#include <string>

#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Several cameras: each has a player and a frontend of its own. Those of the first camera have the names
/// that they have where there is only one; those of camera 1 are "player1" and "frontend1", and write and
/// read on DMSLAM_PLAYER1_... and DMSLAM_FRONTEND1_....

/// "frontend" of camera 1: "frontend1". The same with the name of a stream's owner ("FRONTEND").
std::string OfCamera(const std::string& role, CameraId camera);

/// A role in the names of its channels: "FRONTEND1" of "frontend1".
std::string OwnerName(const std::string& role);

/// DMSLAM_FRONTEND_KEYFRAME of camera 1: DMSLAM_FRONTEND1_KEYFRAME. What belongs to no camera stays.
std::string ChannelOfCamera(const std::string& channel, CameraId camera);

/// The channel as it is called where there is only one camera, and which camera's it is.
struct CameraChannel {
  std::string channel;
  CameraId camera = 0;
};
CameraChannel SplitCamera(const std::string& channel);

/// The stream of a camera's player or frontend.
StreamId StreamOfCamera(StreamId stream, CameraId camera);

}  // namespace dmslam
