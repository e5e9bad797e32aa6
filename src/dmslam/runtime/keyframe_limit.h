#pragma once

#include <cstddef>

namespace dmslam {

/// With so many keyframes that the mapper has not accepted, a frontend proposes no more; the collector keeps
/// the records of as many.
inline constexpr size_t kMostUnacceptedKeyframes = 64;

}  // namespace dmslam
