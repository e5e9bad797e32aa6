#include <cstring>

#include "dmslam/features/image_kernels.h"
#include "dmslam/features/image_kernels_paths.h"

namespace dmslam {
namespace kernels_portable {
namespace {

inline constexpr int kLanes = 16;

// A vector type of the compiler (GCC, Clang): one instruction per operation wherever the CPU has vectors of
// 16 bytes.
using Bytes = uint8_t __attribute__((vector_size(kLanes)));

Bytes Load(const uint8_t* from) {
  Bytes result;
  std::memcpy(&result, from, kLanes);
  return result;
}
void Store(uint8_t* to, Bytes value) { std::memcpy(to, &value, kLanes); }
Bytes Zero() { return Bytes{}; }
Bytes Fill(uint8_t value) { return Zero() + value; }
Bytes Min(Bytes a, Bytes b) { return a < b ? a : b; }
Bytes Max(Bytes a, Bytes b) { return a > b ? a : b; }
Bytes SubtractSaturated(Bytes a, Bytes b) { return Max(a, b) - b; }
/// (a + b + 1) / 2 without leaving eight bits.
Bytes Average(Bytes a, Bytes b) { return (a | b) - ((a ^ b) >> 1); }
Bytes And(Bytes a, Bytes b) { return a & b; }
/// Lanes of b where a has no bit.
Bytes AndNot(Bytes a, Bytes b) { return ~a & b; }
/// 255 where the lane is not zero.
Bytes NotZero(Bytes a) { return a != Zero() ? Fill(255) : Zero(); }
uint32_t NonZeroMask(Bytes a) {
  uint64_t halves[2];
  std::memcpy(halves, &a, kLanes);
  if ((halves[0] | halves[1]) == 0) return 0;
  uint32_t mask = 0;
  for (int i = 0; i < kLanes; ++i) mask |= static_cast<uint32_t>(a[i] != 0) << i;
  return mask;
}

#include "dmslam/features/image_kernels_plain.inc"

void ResizeBlend(const uint8_t* upper, const uint8_t* lower, int lower_weight, int width, uint8_t* out) {
  PlainResizeBlend(upper, lower, lower_weight, width, out);
}
void ResizeAlong(const uint8_t* source, const ResizeBlock* blocks, int num_blocks, uint8_t* out) {
  PlainResizeAlong(source, blocks, num_blocks, out);
}
void DiscMoments(const uint8_t* center, ptrdiff_t stride, int* moment_x, int* moment_y) {
  PlainDiscMoments(center, stride, moment_x, moment_y);
}

#include "dmslam/features/image_kernels.inc"

}  // namespace
}  // namespace kernels_portable

const ImageKernels& PortableKernels() { return kernels_portable::kKernels; }

}  // namespace dmslam
