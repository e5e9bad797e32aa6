#pragma once

#include <cstdint>

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

/// Plain C++, the same everywhere.
const HammingKernels& PortableHammingKernels();
/// With the CPU's instruction for counting bits where it has one. Same results.
const HammingKernels& BestHammingKernels();

}  // namespace dmslam
