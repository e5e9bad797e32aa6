#pragma once

#include <cstdint>
#include <vector>

namespace dmslam {

/// Functions that are compiled a second time for what most CPUs have. Without fused multiply-add both give
/// the same bits.
enum class VectorPath : uint8_t { kBaseline, kAvx2 };

/// Of this machine.
inline bool HasAvx2() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2");
#else
  return false;
#endif
}

/// Those that this machine has.
inline std::vector<VectorPath> VectorPaths() {
  std::vector<VectorPath> paths{VectorPath::kBaseline};
  if (HasAvx2()) paths.push_back(VectorPath::kAvx2);
  return paths;
}

}  // namespace dmslam
