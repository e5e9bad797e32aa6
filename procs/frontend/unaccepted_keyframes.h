#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "dmslam/runtime/keyframe_limit.h"

namespace dmslam {

/// Records with keyframes that the mapper has not accepted yet, by their sequence numbers. Too many of them:
/// it is behind, and no more are proposed.
class UnacceptedKeyframes {
 public:
  void OnPublished(int64_t seq) { seqs_.push_back(seq); }
  /// `seq`: up to which the mapper has accepted the stream; none: it does not follow.
  void OnAccepted(std::optional<int64_t> seq) {
    while (seq && !seqs_.empty() && seqs_.front() <= *seq) seqs_.pop_front();
  }
  size_t size() const { return seqs_.size(); }
  bool AreTooMany() const { return seqs_.size() >= kMostUnacceptedKeyframes; }

 private:
  std::deque<int64_t> seqs_;
};

}  // namespace dmslam
