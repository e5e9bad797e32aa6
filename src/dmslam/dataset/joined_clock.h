#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace dmslam {

/// Stamps of a camera: its driver's monotonic time, or the moment at which a frame was there, joined to wall
/// time once. A wall clock that is set meanwhile changes nothing; stamps rise strictly.
class JoinedClock {
 public:
  /// Wall and monotonic time of one moment [ns].
  JoinedClock(int64_t wall_ns, int64_t monotonic_ns) : offset_ns_(wall_ns - monotonic_ns) {}

  /// The stamp of a frame that was there at `arrival_ns`. `driver_ns`: when the driver says that it was
  /// taken, if it says so; believed where that is on the same clock: within the last second.
  int64_t Stamp(int64_t arrival_ns, std::optional<int64_t> driver_ns) {
    const bool same_clock = driver_ns && *driver_ns <= arrival_ns && *driver_ns > arrival_ns - kSecondNs;
    int64_t stamp_ns = (same_clock ? *driver_ns : arrival_ns) + offset_ns_;
    if (last_ns_) stamp_ns = std::max(stamp_ns, *last_ns_ + 1);
    last_ns_ = stamp_ns;
    return stamp_ns;
  }

 private:
  static constexpr int64_t kSecondNs = 1'000'000'000;
  int64_t offset_ns_;
  std::optional<int64_t> last_ns_;
};

}  // namespace dmslam
