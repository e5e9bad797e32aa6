#include "dmslam/features/hamming.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

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

#define DMSLAM_VPOPCNT __attribute__((target("popcnt,avx512f,avx512vl,avx512vpopcntdq")))

DMSLAM_VPOPCNT inline __m256i DifferingBits(__m256i query, const Descriptor& descriptor) {
  const __m256i words = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(descriptor.words.data()));
  return _mm256_popcnt_epi64(_mm256_xor_si256(query, words));
}

/// Of four descriptors at once: each has counts of four words, which are added crosswise.
DMSLAM_VPOPCNT inline void FourDistances(__m256i query, const Descriptor& a, const Descriptor& b,
                                         const Descriptor& c, const Descriptor& d, uint16_t* distances) {
  const __m256i of_a = DifferingBits(query, a), of_b = DifferingBits(query, b),
                of_c = DifferingBits(query, c), of_d = DifferingBits(query, d);
  const __m256i ab = _mm256_add_epi64(_mm256_unpacklo_epi64(of_a, of_b), _mm256_unpackhi_epi64(of_a, of_b));
  const __m256i cd = _mm256_add_epi64(_mm256_unpacklo_epi64(of_c, of_d), _mm256_unpackhi_epi64(of_c, of_d));
  const __m256i sums =
      _mm256_add_epi64(_mm256_permute2x128_si256(ab, cd, 0x20), _mm256_permute2x128_si256(ab, cd, 0x31));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(distances), _mm256_maskz_cvtepi64_epi16(0xF, sums));
}

DMSLAM_VPOPCNT inline __m256i Words(const Descriptor& query) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(query.words.data()));
}

DMSLAM_VPOPCNT void ToIndexedVpopcnt(const Descriptor& query, const Descriptor* descriptors,
                                     const uint32_t* indices, int count, uint16_t* distances) {
  const __m256i words = Words(query);
  int i = 0;
  for (; i + 4 <= count; i += 4) {
    FourDistances(words, descriptors[indices[i]], descriptors[indices[i + 1]], descriptors[indices[i + 2]],
                  descriptors[indices[i + 3]], distances + i);
  }
  ToIndexedPopcnt(query, descriptors, indices + i, count - i, distances + i);
}

DMSLAM_VPOPCNT void ToRangeVpopcnt(const Descriptor& query, const Descriptor* descriptors, int count,
                                   uint16_t* distances) {
  const __m256i words = Words(query);
  int i = 0;
  for (; i + 4 <= count; i += 4) {
    FourDistances(words, descriptors[i], descriptors[i + 1], descriptors[i + 2], descriptors[i + 3],
                  distances + i);
  }
  ToRangePopcnt(query, descriptors + i, count - i, distances + i);
}

constexpr HammingKernels kVpopcnt = {ToIndexedVpopcnt, ToRangeVpopcnt, KeepNearPopcnt};

bool HasVpopcnt() {
  return __builtin_cpu_supports("popcnt") && __builtin_cpu_supports("avx512f") &&
         __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vpopcntdq");
}
#endif

}  // namespace

std::vector<const HammingKernels*> UsableHammingKernels() {
  std::vector<const HammingKernels*> usable = {&kPortable};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("popcnt")) usable.push_back(&kPopcnt);
  if (HasVpopcnt()) usable.push_back(&kVpopcnt);
#endif
  return usable;
}

const HammingKernels& BestHammingKernels() {
#if defined(__x86_64__)
  if (HasVpopcnt()) return kVpopcnt;
  if (__builtin_cpu_supports("popcnt")) return kPopcnt;
#endif
  return kPortable;
}

}  // namespace dmslam
