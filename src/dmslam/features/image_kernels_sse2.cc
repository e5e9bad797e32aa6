#if defined(__x86_64__)
#include <emmintrin.h>

#include "dmslam/features/image_kernels.h"
#include "dmslam/features/image_kernels_paths.h"

namespace dmslam {
namespace kernels_sse2 {
namespace {

inline constexpr int kLanes = 16;
using Bytes = __m128i;

inline Bytes Load(const uint8_t* from) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from)); }
inline void Store(uint8_t* to, Bytes value) { _mm_storeu_si128(reinterpret_cast<__m128i*>(to), value); }
inline Bytes Fill(uint8_t value) { return _mm_set1_epi8(static_cast<char>(value)); }
inline Bytes Zero() { return _mm_setzero_si128(); }
inline Bytes Min(Bytes a, Bytes b) { return _mm_min_epu8(a, b); }
inline Bytes Max(Bytes a, Bytes b) { return _mm_max_epu8(a, b); }
inline Bytes SubtractSaturated(Bytes a, Bytes b) { return _mm_subs_epu8(a, b); }
inline Bytes Average(Bytes a, Bytes b) { return _mm_avg_epu8(a, b); }
inline Bytes And(Bytes a, Bytes b) { return _mm_and_si128(a, b); }
/// Lanes of b where a has no bit.
inline Bytes AndNot(Bytes a, Bytes b) { return _mm_andnot_si128(a, b); }
/// 255 where the lane is not zero.
inline Bytes NotZero(Bytes a) { return _mm_andnot_si128(_mm_cmpeq_epi8(a, Zero()), Fill(255)); }
inline uint32_t NonZeroMask(Bytes a) {
  return static_cast<uint32_t>(_mm_movemask_epi8(_mm_cmpeq_epi8(a, Zero()))) ^ 0xffffU;
}

#include "dmslam/features/image_kernels_plain.inc"

inline void ResizeBlend(const uint8_t* upper, const uint8_t* lower, int lower_weight, int width,
                        uint8_t* out) {
  PlainResizeBlend(upper, lower, lower_weight, width, out);
}
inline void ResizeAlong(const uint8_t* source, const ResizeBlock* blocks, int num_blocks, uint8_t* out) {
  PlainResizeAlong(source, blocks, num_blocks, out);
}
inline void DiscMoments(const uint8_t* center, ptrdiff_t stride, int* moment_x, int* moment_y) {
  PlainDiscMoments(center, stride, moment_x, moment_y);
}

#include "dmslam/features/image_kernels.inc"

}  // namespace
}  // namespace kernels_sse2

const ImageKernels& Sse2Kernels() { return kernels_sse2::kKernels; }

}  // namespace dmslam
#endif
