#include "dmslam/place_recognition/nearest_child.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

int NearestPortable(const Descriptor& query, const Descriptor* candidates, int count) {
  int best = 0;
  int best_distance = HammingDistance(query, candidates[0]);
  for (int i = 1; i < count; ++i) {
    const int distance = HammingDistance(query, candidates[i]);
    if (distance < best_distance) {
      best_distance = distance;
      best = i;
    }
  }
  return best;
}

#if defined(__x86_64__)
__attribute__((target("popcnt"))) int NearestPopcnt(const Descriptor& query, const Descriptor* candidates,
                                                    int count) {
  const auto q0 = query.words[0], q1 = query.words[1], q2 = query.words[2], q3 = query.words[3];
  int64_t best_key = INT64_MAX;  // distance and index in one number: a branch-free minimum
  for (int i = 0; i < count; ++i) {
    const auto& words = candidates[i].words;
    const int64_t distance = __builtin_popcountll(q0 ^ words[0]) + __builtin_popcountll(q1 ^ words[1]) +
                             __builtin_popcountll(q2 ^ words[2]) + __builtin_popcountll(q3 ^ words[3]);
    const int64_t key = (distance << 32) | i;
    best_key = key < best_key ? key : best_key;
  }
  return static_cast<int>(best_key & 0xffffffff);
}

/// Bits are counted by nibble through a table in a register (Mula, Kurz, Lemire, "Faster population counts
/// using AVX2 instructions", 2018).
__attribute__((target("avx2"))) int NearestAvx2(const Descriptor& query, const Descriptor* candidates,
                                                int count) {
  const __m256i table = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4,  //
                                         0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i low_nibble = _mm256_set1_epi8(15);
  const __m256i wanted = _mm256_load_si256(reinterpret_cast<const __m256i*>(&query));
  int64_t best_key = INT64_MAX;
  for (int i = 0; i < count; ++i) {
    const __m256i differing =
        _mm256_xor_si256(wanted, _mm256_load_si256(reinterpret_cast<const __m256i*>(candidates + i)));
    const __m256i low = _mm256_shuffle_epi8(table, _mm256_and_si256(differing, low_nibble));
    const __m256i high =
        _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(differing, 4), low_nibble));
    const __m256i sums = _mm256_sad_epu8(_mm256_add_epi8(low, high), _mm256_setzero_si256());
    const __m128i halves = _mm_add_epi64(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
    const int64_t distance = _mm_cvtsi128_si64(halves) + _mm_extract_epi64(halves, 1);
    const int64_t key = (distance << 32) | i;
    best_key = key < best_key ? key : best_key;
  }
  return static_cast<int>(best_key & 0xffffffff);
}
#endif

}  // namespace

bool HasHammingPath(HammingPath path) {
  switch (path) {
    case HammingPath::kBest:
    case HammingPath::kPortable:
      return true;
#if defined(__x86_64__)
    case HammingPath::kPopcnt:
      return __builtin_cpu_supports("popcnt");
    case HammingPath::kAvx2:
      return __builtin_cpu_supports("avx2");
#else
    case HammingPath::kPopcnt:
    case HammingPath::kAvx2:
      return false;
#endif
  }
  return false;
}

NearestChildFunction NearestChildOn(HammingPath path) {
  DMSLAM_CHECK(HasHammingPath(path), "the CPU lacks the instructions of this path");
#if defined(__x86_64__)
  const bool best = path == HammingPath::kBest;
  if (path == HammingPath::kAvx2) return NearestAvx2;
  if (path == HammingPath::kPopcnt || (best && HasHammingPath(HammingPath::kPopcnt))) return NearestPopcnt;
#endif
  return NearestPortable;
}

}  // namespace dmslam
