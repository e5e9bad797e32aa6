#include "dmslam/features/hamming.h"

namespace dmslam {
namespace {

void ToIndexedPortable(const Descriptor& query, const Descriptor* descriptors, const uint32_t* indices,
                       int count, uint16_t* distances) {
  for (int i = 0; i < count; ++i) {
    distances[i] = static_cast<uint16_t>(HammingDistance(query, descriptors[indices[i]]));
  }
}

void ToRangePortable(const Descriptor& query, const Descriptor* descriptors, int count, uint16_t* distances) {
  for (int i = 0; i < count; ++i)
    distances[i] = static_cast<uint16_t>(HammingDistance(query, descriptors[i]));
}

int KeepNearPortable(const Descriptor& query, const Descriptor* descriptors, uint32_t* indices, int count,
                     int limit, uint16_t* distances) {
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const int distance = HammingDistance(query, descriptors[indices[i]]);
    indices[kept] = indices[i];
    distances[kept] = static_cast<uint16_t>(distance);
    kept += static_cast<int>(distance <= limit);
  }
  return kept;
}

constexpr HammingKernels kPortable = {ToIndexedPortable, ToRangePortable, KeepNearPortable};

#if defined(__x86_64__)
__attribute__((target("popcnt"))) inline uint16_t DistancePopcnt(const uint64_t* query,
                                                                 const uint64_t* words) {
  return static_cast<uint16_t>(
      __builtin_popcountll(query[0] ^ words[0]) + __builtin_popcountll(query[1] ^ words[1]) +
      __builtin_popcountll(query[2] ^ words[2]) + __builtin_popcountll(query[3] ^ words[3]));
}

__attribute__((target("popcnt"))) void ToIndexedPopcnt(const Descriptor& query, const Descriptor* descriptors,
                                                       const uint32_t* indices, int count,
                                                       uint16_t* distances) {
  for (int i = 0; i < count; ++i) {
    distances[i] = DistancePopcnt(query.words.data(), descriptors[indices[i]].words.data());
  }
}

__attribute__((target("popcnt"))) void ToRangePopcnt(const Descriptor& query, const Descriptor* descriptors,
                                                     int count, uint16_t* distances) {
  for (int i = 0; i < count; ++i) {
    distances[i] = DistancePopcnt(query.words.data(), descriptors[i].words.data());
  }
}

/// Without a branch: which ones are near has no pattern.
__attribute__((target("popcnt"))) int KeepNearPopcnt(const Descriptor& query, const Descriptor* descriptors,
                                                     uint32_t* indices, int count, int limit,
                                                     uint16_t* distances) {
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const uint32_t index = indices[i];
    const uint16_t distance = DistancePopcnt(query.words.data(), descriptors[index].words.data());
    indices[kept] = index;
    distances[kept] = distance;
    kept += static_cast<int>(distance <= limit);
  }
  return kept;
}

constexpr HammingKernels kPopcnt = {ToIndexedPopcnt, ToRangePopcnt, KeepNearPopcnt};
#endif

}  // namespace

const HammingKernels& PortableHammingKernels() { return kPortable; }

const HammingKernels& BestHammingKernels() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("popcnt")) return kPopcnt;
#endif
  return kPortable;
}

}  // namespace dmslam
