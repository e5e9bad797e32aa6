#pragma once

#include <string>

namespace dmslam {

/// What lcm-logplayer is to do in the player's place.
struct LogReplay {
  std::string log, lcm_url;
  double speed = 1;
  int port = 0;
  std::string frontend_pid_file;
};

/// The prefix before the camera's channel in a log of lcm-logger. Throws InputError where it holds no frames.
std::string PrefixOfCamera(const std::string& log);

/// Plays the camera channels of a log by the real lcm-logplayer, once the others are on the bus, and then the
/// end of the sequence again until the frontend has ended: it travels unacknowledged. A log without that end:
/// the frontend is told to finish. To be called in a process of its own; returns its exit code.
int PlayLog(const LogReplay& replay);

}  // namespace dmslam
