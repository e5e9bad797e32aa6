#pragma once

#include <algorithm>
#include <cstdlib>
#include <new>

// Replaces operator new, to see what is allocated: one file of a program may include it.

namespace dmslam::testing {

struct Allocations {
  int count = 0;
  std::size_t largest = 0;  ///< [bytes]
};
/// Since it was set back (to {}).
inline Allocations allocations;

}  // namespace dmslam::testing

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++dmslam::testing::allocations.count;
  dmslam::testing::allocations.largest = std::max(dmslam::testing::allocations.largest, size);
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
