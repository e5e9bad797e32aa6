#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "viewer/event_hub.h"

namespace dmslam {

/// A browser that is connected: what it said that is not answered yet, and what it is still to get.
struct HttpConnection {
  using Clock = std::chrono::steady_clock;

  int fd = -1;
  std::string in, out;
  size_t sent = 0;  ///< of out
  bool close_after = false;
  std::shared_ptr<EventHub::Listener> listener;
  Clock::time_point since;     ///< of the request that is being read; of the end of the one before
  Clock::time_point progress;  ///< when it last took something
  Clock::time_point spoke;     ///< an event or a comment was last put into `out`
  Clock::time_point joined;    ///< began to listen
  bool done = false;
  bool writing() const { return sent < out.size(); }
};

}  // namespace dmslam
