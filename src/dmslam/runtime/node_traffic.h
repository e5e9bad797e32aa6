#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/wire/status.h"

namespace dmslam {

/// What comes to a process: outside the streams, which channels it listens to, how much has come, what of it
/// was dropped, and what people were told of that, since of each matter only the first is told; of the
/// streams, how many records have waited at most.
class NodeTraffic {
 public:
  void Listen(std::string channel) { channels_.push_back(std::move(channel)); }
  const std::vector<std::string>& channels() const { return channels_; }
  bool IsListenedTo(const std::string& channel) const { return std::ranges::count(channels_, channel) > 0; }

  void OnReceived(size_t bytes) {
    ++received_;
    received_bytes_ += static_cast<int64_t>(bytes);
  }
  /// One of another session is dropped: whether it is the first.
  bool DropForeign() { return dropped_foreign_++ == 0; }
  /// One is dropped, or a record that cannot be read: whether it is the first of its channel.
  bool DropMalformed(const std::string& channel) {
    ++dropped_malformed_;
    return IsFirst(channel);
  }
  /// Whether nothing was told of a matter yet.
  bool IsFirst(const std::string& matter) {
    if (std::ranges::count(told_, matter) > 0) return false;
    told_.push_back(matter);
    return true;
  }

  /// So many records of all streams wait now.
  void NoteQueue(int64_t depth) { queue_peak_ = std::max(queue_peak_, depth); }

  /// Once the health holds what its readers count: `health->queue_depth` waits now.
  void AddTo(ProcessHealth* health) const {
    health->received += received_;
    health->received_bytes += received_bytes_;
    health->dropped_foreign += dropped_foreign_;
    health->dropped_malformed += dropped_malformed_;
    health->queue_peak = std::max(health->queue_depth, static_cast<int32_t>(queue_peak_));
  }

 private:
  std::vector<std::string> channels_;
  int64_t received_ = 0, received_bytes_ = 0, dropped_foreign_ = 0, dropped_malformed_ = 0;
  std::vector<std::string> told_;
  int64_t queue_peak_ = 0;
};

}  // namespace dmslam
