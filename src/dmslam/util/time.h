#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace dmslam {

/// Negative where `to_ns` is the earlier.
inline double SecondsFromTo(int64_t from_ns, int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

/// Between two moments, whichever comes first.
inline double SecondsApart(int64_t a_ns, int64_t b_ns) { return std::abs(SecondsFromTo(a_ns, b_ns)); }

/// In whole nanoseconds, towards zero.
constexpr int64_t ToNs(double seconds) { return static_cast<int64_t>(seconds * 1e9); }

/// Parses decimal seconds ("1305031102.175304") into nanoseconds exactly, never through floating point. Up to
/// nine decimals; more are refused unless they are zeros. No sign but a leading '-', no exponent, no white
/// space.
std::optional<int64_t> ParseStampNs(std::string_view text);

/// Writes nanoseconds as decimal seconds: six decimals where that is exact, nine otherwise.
std::string FormatStampNs(int64_t stamp_ns);

}  // namespace dmslam
