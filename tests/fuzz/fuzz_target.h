#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

// What a fuzz target consists of. libFuzzer calls the first; mutation_driver.cc calls both and needs no
// clang.

/// Feeds some bytes to what is tested; must neither crash nor throw. Returns 0.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace dmslam::fuzz {

/// Sound inputs to begin with.
std::vector<std::vector<uint8_t>> Seeds();

/// Stops the program, as a sanitizer would, when a property does not hold.
void Require(bool property, const char* what);

}  // namespace dmslam::fuzz
