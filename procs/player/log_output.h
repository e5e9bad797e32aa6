#pragma once

#include <string>
#include <utility>

#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/event_log.h"
#include "dmslam/recording/log_version.h"

namespace dmslam {

/// A bus whose only listener is a log: what the player says of its camera and frames is written under a clock
/// of the recording's own, without running anything. The same frames give the same bytes.
class LogOutput : public Bus {
 public:
  /// The clock starts at `start_ns`, capture time. `prefix` comes before every channel.
  LogOutput(const std::string& path, std::string prefix, int64_t start_ns)
      : log_(path), prefix_(std::move(prefix)), now_ns_(start_ns) {
    WriteLogVersion(&log_, prefix_, now_ns_ / 1000);
  }

  void Subscribe(const std::string&) override {}
  void SetHandler(Handler) override {}
  void Publish(const Outgoing& message) override;

  int64_t now_ns() const { return now_ns_; }
  void AdvanceTo(int64_t now_ns) { now_ns_ = now_ns; }
  /// The end of the sequence was said.
  bool ended() const { return ended_; }
  void Close() { log_.Close(); }

 private:
  EventLogWriter log_;
  std::string prefix_;
  int64_t now_ns_;
  bool ended_ = false;
};

}  // namespace dmslam
