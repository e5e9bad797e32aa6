#pragma once

#include <cstdint>

namespace dmslam {

/// When a player says again which camera it plays: often while it begins, since nobody believes what was said
/// once, and twice a second for who comes late.
inline constexpr int64_t InfoAgainNs(int64_t times_said) {
  return times_said < 5 ? 100'000'000 : 500'000'000;
}

}  // namespace dmslam
