#include <cstring>

#include "dmslam/features/image_kernels.h"
#include "dmslam/features/image_kernels_paths.h"

namespace dmslam {
namespace kernels_portable {
namespace {

inline constexpr int kLanes = 16;

struct Bytes {
  uint8_t lane[kLanes];
};

template <typename Operation>
Bytes PerLane(Bytes a, Bytes b, Operation operation) {
  Bytes result;
  for (int i = 0; i < kLanes; ++i) result.lane[i] = static_cast<uint8_t>(operation(a.lane[i], b.lane[i]));
  return result;
}

Bytes Load(const uint8_t* from) {
  Bytes result;
  std::memcpy(result.lane, from, kLanes);
  return result;
}
void Store(uint8_t* to, Bytes value) { std::memcpy(to, value.lane, kLanes); }
Bytes Fill(uint8_t value) {
  Bytes result;
  std::memset(result.lane, value, kLanes);
  return result;
}
Bytes Zero() { return Fill(0); }
Bytes Min(Bytes a, Bytes b) {
  return PerLane(a, b, [](int x, int y) { return x < y ? x : y; });
}
Bytes Max(Bytes a, Bytes b) {
  return PerLane(a, b, [](int x, int y) { return x > y ? x : y; });
}
Bytes SubtractSaturated(Bytes a, Bytes b) {
  return PerLane(a, b, [](int x, int y) { return x > y ? x - y : 0; });
}
Bytes Average(Bytes a, Bytes b) {
  return PerLane(a, b, [](int x, int y) { return (x + y + 1) >> 1; });
}
Bytes And(Bytes a, Bytes b) {
  return PerLane(a, b, [](int x, int y) { return x & y; });
}
/// Lanes of b where a has no bit.
Bytes AndNot(Bytes a, Bytes b) {
  return PerLane(a, b, [](int x, int y) { return ~x & y; });
}
/// 255 where the lane is not zero.
Bytes NotZero(Bytes a) {
  return PerLane(a, a, [](int x, int) { return x != 0 ? 255 : 0; });
}
uint32_t NonZeroMask(Bytes a) {
  uint32_t mask = 0;
  for (int i = 0; i < kLanes; ++i) mask |= static_cast<uint32_t>(a.lane[i] != 0) << i;
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
