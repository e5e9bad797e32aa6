#pragma once

#include <cstddef>

namespace dmslam::testing {

/// Calls of operator new in this program so far. Linking allocation_counter.cc replaces operator new and
/// delete by counting ones.
size_t NumAllocations();

}  // namespace dmslam::testing
