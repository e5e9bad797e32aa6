#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/event_log.h"
#include "viewer/playback_control.h"
#include "viewer/viewer_node.h"

namespace dmslam {

/// A bus on which a log's messages are heard; what is published on it goes nowhere.
class LogBus : public Bus {
 public:
  void Subscribe(const std::string& channel) override { channels_.insert(channel); }
  void SetHandler(Handler handler) override { handler_ = std::move(handler); }
  void Publish(const Outgoing&) override {}
  void Deliver(const LogEvent& event);

 private:
  std::set<std::string> channels_;
  Handler handler_;
};

/// Plays a log of lcm-logger to a viewer's node, which takes it for a running system: the clock is the log's.
/// Going back means to begin anew and to hurry to where one wants to be.
class LogPlayback {
 public:
  /// Reads the log once for its length. Throws InputError for what is no log. `exchange` must outlive this.
  LogPlayback(const std::string& path, NodeOptions options, ViewerOptions viewer, Exchange* exchange);

  void Fulfil(const PlaybackWish& wish, int64_t now_ns);
  /// Plays on to where the log must be by now.
  void Advance(int64_t now_ns);
  /// When Advance has something to do next.
  int64_t deadline_ns() const { return playing_ ? next_ns_ : INT64_MAX; }

  double position_s() const { return static_cast<double>(at_us_ - begin_us_) * 1e-6; }
  double duration_s() const { return static_cast<double>(end_us_ - begin_us_) * 1e-6; }
  bool playing() const { return playing_; }

 private:
  void AddCamera(CameraId camera);
  void BeginAnew();
  void PlayTo(int64_t utime_us, bool in_haste);
  void Say() const;

  std::string path_;
  NodeOptions options_;
  ViewerOptions viewer_;
  Exchange* exchange_;
  std::unique_ptr<LogBus> bus_;
  std::unique_ptr<ViewerNode> node_;
  std::unique_ptr<EventLogReader> reader_;
  std::optional<LogEvent> next_;  ///< read, and not yet its turn
  int64_t begin_us_ = 0, end_us_ = 0;
  int64_t at_us_ = 0;                 ///< the log's clock
  int64_t anchor_us_ = 0;             ///< where it was at `anchor_ns_`
  std::optional<int64_t> anchor_ns_;  ///< none: it has not begun
  int64_t next_ns_ = 0;
  double speed_ = 1;
  bool playing_ = true;
};

}  // namespace dmslam
