#pragma once

#include <cstddef>
#include <optional>

namespace dmslam {

/// A process's memory, and how large the map was then.
struct MemorySample {
  size_t keyframes = 0;
  double rss_mb = 0;
};

/// What a process's memory was when the map was no longer tiny, and is now.
struct MemoryGrowth {
  std::optional<MemorySample> first;  ///< with ten keyframes or more
  MemorySample last;

  void Add(const MemorySample& sample) {
    if (!first && sample.keyframes >= 10) first = sample;
    last = sample;
  }
};

}  // namespace dmslam
