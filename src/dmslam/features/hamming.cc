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

constexpr HammingKernels kPortable = {ToIndexedPortable, ToRangePortable};

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

constexpr HammingKernels kPopcnt = {ToIndexedPopcnt, ToRangePopcnt};
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
