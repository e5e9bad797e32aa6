#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Records of the frontends from when they come until the core has time for them, in the order in which they
/// came; and whether they are a reason for the core to finish early: a keyframe that was due already when it
/// began is one, and so are too many records that have come since.
class ArrivedRecords {
 public:
  struct Arrived {
    CameraId camera = 0;
    Record record;
    int64_t at_ns = 0;  ///< latencies count from then, not from when there was time for it
  };
  /// Records that may come while the core works before it is asked to finish early.
  static constexpr size_t kMostMayWait = 60;

  void Add(Arrived arrived) { new_.push_back(std::move(arrived)); }
  /// The core is idle: what has come is to be handled.
  void MakeDue();
  /// Whether nothing is to be handled now.
  bool NoneIsDue() const { return due_.empty(); }
  /// The oldest one that is to be handled; there is one.
  Arrived TakeFirst();

  /// Whether the core shall finish early. `in_streams`: how many records wait where nobody has taken them.
  bool AreUrgent(size_t in_streams) const;
  size_t size() const { return due_.size() + new_.size(); }

 private:
  std::deque<Arrived> new_;  ///< came while the core worked
  std::deque<Arrived> due_;  ///< before those
};

}  // namespace dmslam
