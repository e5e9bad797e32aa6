#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "dmslam/wire/codec.h"
#include "player/claimed_answer.h"

namespace dmslam {

/// The end of what a player plays: it is told again and again until the frontend has heard it. The player
/// then stays until the map is done, since a frontend that is started again at the end needs camera and end.
class EndOfPlay {
 public:
  bool WasSaid() const { return since_ns_ != 0; }
  /// The frontend says that all is done, to us or to a player before us: whether that is so. Who has not said
  /// the end believes it when it is said for a while: the frontend answers every frame with it then.
  bool OnSequenceDone(int64_t now_ns);
  /// The frontend has done the frame that was played last, so that not all is done.
  void OnFrameDone() { all_done_.Clear(); }
  /// A message on any channel. The statuses of this session's mapper and frontend say that these are alive: a
  /// frontend may still be tracking, adjusting or telling its last poses. All others are left alone.
  void OnStatus(const std::string& channel, std::span<const uint8_t> bytes, uint32_t session, int64_t now_ns);

  /// Whether the end is to be told now. The first call begins it.
  bool IsDue(int64_t now_ns);
  /// Set when there is nobody left to wait for: the player's exit code. `stopped`: asked to stop, it does not
  /// wait long for a frontend.
  std::optional<int> ExitCode(int64_t now_ns, bool stopped) const;
  /// What exit code 5 means.
  static std::string NobodyAnswered() {
    return "no frontend answered the end of the sequence; is it running on the same bus?";
  }
  /// When to ask again.
  int64_t due_ns() const { return due_ns_; }

 private:
  ClaimedAnswer all_done_;
  bool heard_ = false, mapper_done_ = false;
  int64_t frontend_heard_ns_ = 0, mapper_heard_ns_ = 0, since_ns_ = 0, due_ns_ = 0;
};

}  // namespace dmslam
