#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dmslam/slam/frontend_output.h"

namespace dmslam {

/// What is told when the sequence has ended, in portions: lcm-logger, which nobody repairs, loses what comes
/// faster than it empties its queue of 30 messages.
class LastWords {
 public:
  LastWords() = default;
  explicit LastWords(FrontendOutput output) : events_(std::move(output.events)) {}

  /// The next of them; empty before its time.
  std::vector<FrontendEvent> NextPortion(int64_t now_ns);
  int64_t next_portion_ns() const { return next_portion_ns_; }
  /// Nothing is left to tell.
  bool AreTold() const { return told_ == events_.size(); }

 private:
  std::vector<FrontendEvent> events_;
  size_t told_ = 0;  ///< of them, already
  int64_t next_portion_ns_ = 0;
};

}  // namespace dmslam
