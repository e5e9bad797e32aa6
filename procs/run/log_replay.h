#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dmslam {

/// A log that lcm-logplayer plays in the player's place.
struct LogReplay {
  std::string log, lcm_url;
  double speed = 1;
};

/// The prefix before the camera's channel in a log of lcm-logger. Throws InputError where it holds no frames.
std::string PrefixOfCamera(const std::string& log);

/// The command that plays the camera's channels.
std::vector<std::string> PlayCamera(const LogReplay& replay);
/// The command that plays the end of the sequence alone, as fast as the log can be read.
std::vector<std::string> PlayEnd(const LogReplay& replay);

/// What is done when a log has been played. The end of the sequence travels unacknowledged, so it is played
/// again until the frontend has ended; a frontend that never hears it, as the log has none, is told to
/// finish.
class ReplayEnd {
 public:
  enum class Step { kNone, kPlayAgain, kStopFrontend };

  /// The log has been played.
  void Begin(int64_t now_ns);
  /// The frontend has ended.
  void Finish() { due_ns_ = INT64_MAX; }
  bool begun() const { return due_ns_ != INT64_MAX; }
  /// When Next wants to be called.
  int64_t due_ns() const { return due_ns_; }
  Step Next(int64_t now_ns);

 private:
  int64_t due_ns_ = INT64_MAX;
  int repeats_ = 0;
};

}  // namespace dmslam
