#pragma once

#include <mutex>
#include <optional>
#include <utility>

namespace dmslam {

/// What somebody wants of the playing of a log; empty: no wish.
struct PlaybackWish {
  std::optional<double> position_s;  ///< from the log's beginning
  std::optional<bool> playing;
  std::optional<double> speed;
};

/// Hands wishes from the threads that serve browsers to the one that plays. The newest of each kind counts.
class PlaybackControl {
 public:
  PlaybackControl();
  ~PlaybackControl();
  PlaybackControl(const PlaybackControl&) = delete;
  PlaybackControl& operator=(const PlaybackControl&) = delete;

  void Wish(const PlaybackWish& wish);
  /// What has been wished since the last call.
  PlaybackWish Take();
  /// Readable while there is something to take.
  int fd() const { return fd_; }

 private:
  std::mutex mutex_;
  PlaybackWish wish_;
  int fd_ = -1;
};

}  // namespace dmslam
