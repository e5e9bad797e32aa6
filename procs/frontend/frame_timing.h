#pragma once

#include <cstdint>

#include "dmslam/runtime/latency_window.h"
#include "dmslam/wire/frontend_messages.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// How many frames were tracked, and how long their steps took.
class FrameTiming {
 public:
  /// One was tracked. `trace`: all of it.
  void Add(const FrameTrace& trace, double extract_ms);
  int64_t frames() const { return frames_; }
  /// Its rate is that since the last status.
  void TakeStatus(FrontendStatus* status);

 private:
  int64_t frames_ = 0;
  int64_t frames_at_status_ = 0;
  LatencyWindow latency_, decode_, extract_, step_;
};

}  // namespace dmslam
