#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/features/types.h"

namespace dmslam {

/// Distances [bits] between `query` and the descriptors that `indices` name, into `distances`, same order.
using HammingToIndexed = void (*)(const Descriptor& query, const Descriptor* descriptors,
                                  const uint32_t* indices, int count, uint16_t* distances);
/// The same for `count` consecutive descriptors.
using HammingToRange = void (*)(const Descriptor& query, const Descriptor* descriptors, int count,
                                uint16_t* distances);
/// Keeps of `indices` those whose descriptors are no farther than `limit` [bits], in order at the front, with
/// their distances; returns how many they are. Faster than to_indexed where most are far.
using HammingKeepNear = int (*)(const Descriptor& query, const Descriptor* descriptors, uint32_t* indices,
                                int count, int limit, uint16_t* distances);

/// Distances from one descriptor to many.
struct HammingKernels {
  HammingToIndexed to_indexed;
  HammingToRange to_range;
  HammingKeepNear keep_near;
};

/// Those that this machine can run, from plain C++, which runs everywhere, to the one with the widest
/// instructions for counting bits. All have the same results.
std::vector<const HammingKernels*> UsableHammingKernels();
/// The last of them.
const HammingKernels& BestHammingKernels();

}  // namespace dmslam
