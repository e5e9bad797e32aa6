#pragma once

#include <atomic>
#include <cstdint>

#include "dmslam/messaging/event_loop.h"

namespace dmslam {

/// What a thread that works says to the one that watches it: since when nothing was heard of the work in
/// hand. May be said by any thread, and costs no more than reading the clock.
class WorkSign {
 public:
  void Begin() { said_ns_.store(EventLoop::now_ns(), std::memory_order_relaxed); }
  /// The work in hand goes on.
  void Beat() {
    if (said_ns_.load(std::memory_order_relaxed) != 0) Begin();
  }
  /// There is nothing in hand.
  void Rest() { said_ns_.store(0, std::memory_order_relaxed); }
  /// Whether there is work in hand of which nothing was heard for longer than this.
  bool Hangs(int64_t now_ns, int64_t longest_ns) const {
    const int64_t said_ns = said_ns_.load(std::memory_order_relaxed);
    return said_ns != 0 && now_ns - said_ns > longest_ns;
  }

 private:
  std::atomic<int64_t> said_ns_{0};  ///< 0: there is nothing in hand
};

}  // namespace dmslam
