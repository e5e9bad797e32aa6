#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Records that other processes sent, whose effect is in the map, and is not safe: no other process holds it
/// yet. They are accepted in the order in which they were handled.
class UnsafeRecords {
 public:
  struct Handled {
    CameraId camera = 0;  ///< of a frontend's
    Version version;
    int64_t map_seq = 0;  ///< of the map record that must be safe first
  };

  void OnHandled(const Handled& handled) { handled_.push_back(handled); }
  /// The next one that is safe. `is_held`: whether another process holds the map up to that record.
  std::optional<Handled> TakeSafe(const std::function<bool(int64_t map_seq)>& is_held) {
    if (handled_.empty() || !is_held(handled_.front().map_seq)) return std::nullopt;
    const Handled safe = handled_.front();
    handled_.pop_front();
    return safe;
  }
  size_t size() const { return handled_.size(); }

 private:
  std::deque<Handled> handled_;
};

}  // namespace dmslam
