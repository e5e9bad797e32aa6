#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <optional>

namespace dmslam {

/// From where, and from how far, a landmark was seen.
struct ViewingRange {
  Eigen::Vector3d mean_direction = Eigen::Vector3d::Zero();  ///< unit, from the cameras to the point
  double min_distance = 0;  ///< nearer, it would be coarser than the pyramid's coarsest level
  double max_distance = 0;  ///< at this distance it is seen at octave 0
};

/// A viewing range that is computed when it is asked for: a cache that those who only read a map write. Any
/// number of threads may ask at a time. To mark it stale and to copy it is for who changes the map, while
/// nobody asks.
class ViewingCache {
 public:
  ViewingCache() = default;
  ViewingCache(const ViewingCache& other)
      : range_(other.range_), state_(other.state_.load(std::memory_order_relaxed)) {}
  ViewingCache& operator=(const ViewingCache& other) {
    range_ = other.range_;
    state_.store(other.state_.load(std::memory_order_relaxed), std::memory_order_relaxed);
    return *this;
  }

  void MarkStale() { state_.store(State::kStale, std::memory_order_relaxed); }

  /// `compute` gives what it is now; none: it stays what it was. Two threads that find it stale compute it
  /// both, and one of them keeps it.
  template <typename Compute>
  ViewingRange Get(const Compute& compute) const {
    if (state_.load(std::memory_order_acquire) == State::kFresh) return range_;
    const std::optional<ViewingRange> now = compute();
    State stale = State::kStale;
    if (state_.compare_exchange_strong(stale, State::kBeingKept, std::memory_order_acquire)) {
      if (now) range_ = *now;
      state_.store(State::kFresh, std::memory_order_release);
    }
    return now ? *now : range_;
  }

 private:
  enum class State : uint8_t { kStale, kBeingKept, kFresh };

  mutable ViewingRange range_;
  mutable std::atomic<State> state_ = State::kStale;
};

}  // namespace dmslam
