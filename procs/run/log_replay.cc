#include "run/log_replay.h"

#include <string_view>

#include "dmslam/messaging/event_log.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/channels.h"

namespace dmslam {
namespace {

constexpr int64_t kRepeatEveryNs = 1'000'000'000;
constexpr int kMostRepeats = 14;  // a frontend may be busy for so many seconds
constexpr double kAtOnce = 1000;  // times the recorded rate

/// `contents`: a regular expression of what is said behind the player's name.
std::vector<std::string> Logplayer(const LogReplay& replay, double speed, const std::string& contents) {
  return {"lcm-logplayer",
          "-s",
          std::to_string(speed),
          "-l",
          replay.lcm_url,
          "-e",
          ".*DMSLAM_PLAYER_" + contents + "$",
          replay.log};
}

}  // namespace

std::string PrefixOfCamera(const std::string& log) {
  EventLogReader reader(log);
  const std::string_view frame = channels::kFrame;
  while (const auto event = reader.Next()) {
    if (event->channel.ends_with(frame))
      return event->channel.substr(0, event->channel.size() - frame.size());
  }
  throw InputError(log + ": holds no frames of a camera; was the player recorded too?");
}

std::vector<std::string> PlayCamera(const LogReplay& replay) {
  return Logplayer(replay, replay.speed, "(CAMERA_INFO|FRAME|GROUND_TRUTH|END_OF_SEQUENCE)");
}

std::vector<std::string> PlayEnd(const LogReplay& replay) {
  return Logplayer(replay, kAtOnce, "END_OF_SEQUENCE");
}

void ReplayEnd::Begin(int64_t now_ns) {
  due_ns_ = now_ns + kRepeatEveryNs;
  repeats_ = 0;
}

ReplayEnd::Step ReplayEnd::Next(int64_t now_ns) {
  if (now_ns < due_ns_) return Step::kNone;
  if (repeats_++ < kMostRepeats) {
    due_ns_ = now_ns + kRepeatEveryNs;
    return Step::kPlayAgain;
  }
  Finish();
  return Step::kStopFrontend;
}

}  // namespace dmslam
