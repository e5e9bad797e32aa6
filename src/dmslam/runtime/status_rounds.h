#pragma once

#include <cstdint>

#include "dmslam/runtime/node.h"

namespace dmslam {

/// When a process says how it fares, once a second, and when it tidies its memory: once a minute, beginning a
/// minute after its first status.
class StatusRounds {
 public:
  /// Whether a status is due: then it is to be said now.
  bool TakeStatus(int64_t now_ns) {
    if (now_ns < next_status_ns_) return false;
    next_status_ns_ = now_ns + kStatusEveryNs;
    return true;
  }
  /// Whether the memory is to be tidied now, asked after each status.
  bool TakeTidying(int64_t now_ns) {
    if (now_ns < next_tidy_ns_) return false;
    const bool is_first = next_tidy_ns_ == 0;
    next_tidy_ns_ = now_ns + kTidyEveryNs;
    return !is_first;
  }
  /// When the next status is due.
  int64_t next_status_ns() const { return next_status_ns_; }

 private:
  static constexpr int64_t kTidyEveryNs = 60'000'000'000;
  int64_t next_status_ns_ = 0, next_tidy_ns_ = 0;
};

}  // namespace dmslam
