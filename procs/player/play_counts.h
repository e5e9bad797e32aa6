#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace dmslam {

/// Frames that were played so far, and those that were not.
struct PlayCounts {
  int64_t published = 0, repeats = 0;
  size_t jumped = 0, black = 0, unreadable = 0;
  std::string first_unreadable;  ///< the first frame that could not be read, and why; empty: all could
};

}  // namespace dmslam
