#pragma once

#include <algorithm>
#include <cstdint>

namespace dmslam {

// Terms of office are microseconds since 1970, or a little more: a wall clock showed them. One that lies far
// beyond all clocks would leave no room for the next ones, so it is not believed, however often it is said.

inline constexpr int64_t kDayUs = int64_t{86'400} * 1'000'000;
inline constexpr int64_t kYearUs = 365 * kDayUs;
/// The longest believable lead over a clock: ten years.
inline constexpr int64_t kBelievedLeadUs = 10 * kYearUs;
/// A clock that stands before 2020 was never set: that of a host without a battery.
inline constexpr int64_t kClockIsSetUs = 50 * kYearUs;
/// Where no clock tells: the year 2120.
inline constexpr int64_t kBelievedWithoutClockUs = 150 * kYearUs;

/// The highest epoch that is believed [us] by who has the wall clock `wall_us` [us since 1970]. Where that
/// was never set, `first_epoch`, the first term that was known here, stands for it (0: none was).
/// `newest_epoch`: known here by now; what follows it within a day is believed as well, so that a term at the
/// bound has a successor on a host whose clock is behind.
inline int64_t LatestBelievedEpoch(int64_t wall_us, int64_t first_epoch, int64_t newest_epoch) {
  const int64_t clock_us = wall_us >= kClockIsSetUs ? wall_us : first_epoch;
  const int64_t latest = clock_us >= kClockIsSetUs ? clock_us + kBelievedLeadUs : kBelievedWithoutClockUs;
  return std::max(latest, newest_epoch + kDayUs);
}

}  // namespace dmslam
