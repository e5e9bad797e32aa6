#if defined(__x86_64__)
#include <immintrin.h>

#include "dmslam/features/image_kernels.h"
#include "dmslam/features/image_kernels_paths.h"

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,popcnt,bmi"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,popcnt,bmi")
#endif

namespace dmslam {
namespace kernels_avx2 {
namespace {

inline constexpr int kLanes = 32;
using Bytes = __m256i;

inline Bytes Load(const uint8_t* from) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)); }
inline void Store(uint8_t* to, Bytes value) { _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), value); }
inline Bytes Fill(uint8_t value) { return _mm256_set1_epi8(static_cast<char>(value)); }
inline Bytes Zero() { return _mm256_setzero_si256(); }
inline Bytes Min(Bytes a, Bytes b) { return _mm256_min_epu8(a, b); }
inline Bytes Max(Bytes a, Bytes b) { return _mm256_max_epu8(a, b); }
inline Bytes SubtractSaturated(Bytes a, Bytes b) { return _mm256_subs_epu8(a, b); }
inline Bytes Average(Bytes a, Bytes b) { return _mm256_avg_epu8(a, b); }
inline Bytes And(Bytes a, Bytes b) { return _mm256_and_si256(a, b); }
/// Lanes of b where a has no bit.
inline Bytes AndNot(Bytes a, Bytes b) { return _mm256_andnot_si256(a, b); }
/// 255 where the lane is not zero.
inline Bytes NotZero(Bytes a) { return _mm256_andnot_si256(_mm256_cmpeq_epi8(a, Zero()), Fill(255)); }
inline uint32_t NonZeroMask(Bytes a) {
  return ~static_cast<uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(a, Zero())));
}

#include "dmslam/features/image_kernels_plain.inc"

/// Two rows, interleaved byte by byte, times their weights in 64ths.
inline void ResizeBlend(const uint8_t* upper, const uint8_t* lower, int lower_weight, int width,
                        uint8_t* out) {
  const __m256i weights = _mm256_set1_epi16(static_cast<int16_t>((lower_weight << 8) | (64 - lower_weight)));
  const __m256i half = _mm256_set1_epi16(32);
  for (int x = 0; x < width; x += kLanes) {
    const __m256i a = Load(upper + x), b = Load(lower + x);
    const __m256i low = _mm256_maddubs_epi16(_mm256_unpacklo_epi8(a, b), weights);
    const __m256i high = _mm256_maddubs_epi16(_mm256_unpackhi_epi8(a, b), weights);
    Store(out + x, _mm256_packus_epi16(_mm256_srli_epi16(_mm256_add_epi16(low, half), 6),
                                       _mm256_srli_epi16(_mm256_add_epi16(high, half), 6)));
  }
}

/// Sums of eight pixels' sources, times 64.
inline __m128i ResizeSums(const uint8_t* source, const ResizeBlock& block) {
  const __m128i pixels = _mm_loadu_si128(reinterpret_cast<const __m128i*>(source + block.source_begin));
  const __m128i pick = _mm_loadu_si128(reinterpret_cast<const __m128i*>(block.pick));
  const __m128i weight = _mm_loadu_si128(reinterpret_cast<const __m128i*>(block.weight));
  return _mm_maddubs_epi16(_mm_shuffle_epi8(pixels, pick), weight);
}

inline void ResizeAlong(const uint8_t* source, const ResizeBlock* blocks, int num_blocks, uint8_t* out) {
  const __m128i half = _mm_set1_epi16(32);
  for (int block = 0; block < num_blocks; ++block) {
    const __m128i sums = _mm_srli_epi16(_mm_add_epi16(ResizeSums(source, blocks[block]), half), 6);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + 8 * block), _mm_packus_epi16(sums, sums));
  }
}

/// Bytes -15 .. 16 of a row of the disc: 255 inside, 0 outside.
struct DiscMasks {
  alignas(32) uint8_t row[16][32];
};
constexpr DiscMasks MakeDiscMasks() {
  DiscMasks masks{};
  for (int y = 0; y < 16; ++y) {
    for (int x = -15; x <= 15; ++x) {
      const bool inside = -kDiscHalfWidth[y] <= x && x <= kDiscHalfWidth[y];
      masks.row[y][x + 15] = inside ? 255 : 0;
    }
  }
  return masks;
}
inline constexpr DiscMasks kDiscMasks = MakeDiscMasks();

inline int SumOfInts(__m256i v) {
  const __m128i four = _mm_add_epi32(_mm256_castsi256_si128(v), _mm256_extracti128_si256(v, 1));
  const __m128i two = _mm_add_epi32(four, _mm_shuffle_epi32(four, 0x4e));
  return _mm_cvtsi128_si32(_mm_add_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}

inline void DiscMoments(const uint8_t* center, ptrdiff_t stride, int* moment_x, int* moment_y) {
  const __m256i x = _mm256_setr_epi8(-15, -14, -13, -12, -11, -10, -9, -8, -7, -6, -5, -4, -3, -2, -1, 0,  //
                                     1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 0);
  const __m256i ones = _mm256_set1_epi16(1);
  const __m256i middle = And(Load(center - 15), Load(kDiscMasks.row[0]));
  __m256i sum_x = _mm256_madd_epi16(_mm256_maddubs_epi16(middle, x), ones);
  __m256i sum_y = Zero();
  for (int y = 1; y <= 15; ++y) {
    const __m256i mask = Load(kDiscMasks.row[y]);
    const __m256i up = And(Load(center - y * stride - 15), mask);
    const __m256i down = And(Load(center + y * stride - 15), mask);
    const __m256i row_x = _mm256_add_epi16(_mm256_maddubs_epi16(up, x), _mm256_maddubs_epi16(down, x));
    sum_x = _mm256_add_epi32(sum_x, _mm256_madd_epi16(row_x, ones));
    const __m256i difference = _mm256_sub_epi32(_mm256_sad_epu8(down, Zero()), _mm256_sad_epu8(up, Zero()));
    sum_y = _mm256_add_epi32(sum_y, _mm256_mullo_epi32(difference, _mm256_set1_epi32(y)));
  }
  *moment_x = SumOfInts(sum_x);
  *moment_y = SumOfInts(sum_y);
}

#include "dmslam/features/image_kernels.inc"

}  // namespace
}  // namespace kernels_avx2

const ImageKernels& Avx2Kernels() { return kernels_avx2::kKernels; }

}  // namespace dmslam

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
