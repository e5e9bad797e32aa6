#pragma once

#include <cstdint>

namespace dmslam {

/// So often a player says which camera it plays, for who comes late.
inline constexpr int64_t kInfoEveryNs = 500'000'000;

}  // namespace dmslam
