#pragma once

#include <cstdint>
#include <vector>

namespace dmslam {

/// Functions that are compiled again for what many CPUs have; from the narrowest to the widest. Without fused
/// multiply-add all give the same bits.
enum class VectorPath : uint8_t { kBaseline, kAvx2, kAvx512, kWidest = kAvx512 };

#if defined(__x86_64__) && defined(__clang__)
#define DMSLAM_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl"), min_vector_width(512)))
#elif defined(__x86_64__)
#define DMSLAM_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,prefer-vector-width=512")))
#endif

/// Whether this machine has it.
inline bool Has([[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (path == VectorPath::kAvx2) return __builtin_cpu_supports("avx2");
  if (path == VectorPath::kAvx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
  }
#endif
  return path == VectorPath::kBaseline;
}

/// Whether a function that may go as far as `widest` can take `path` here.
inline bool Takes(VectorPath path, VectorPath widest) { return path <= widest && Has(path); }

/// Those that this machine has.
inline std::vector<VectorPath> VectorPaths() {
  std::vector<VectorPath> paths;
  for (const VectorPath path : {VectorPath::kBaseline, VectorPath::kAvx2, VectorPath::kAvx512}) {
    if (Has(path)) paths.push_back(path);
  }
  return paths;
}

}  // namespace dmslam
