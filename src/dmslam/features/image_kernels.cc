#include "dmslam/features/image_kernels.h"

#include "dmslam/features/image_kernels_paths.h"
#include "dmslam/util/check.h"

namespace dmslam {

bool HasSimdPath(SimdPath path) {
  if (path == SimdPath::kBest || path == SimdPath::kPortable) return true;
#if defined(__x86_64__)
  return path == SimdPath::kSse2 || (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt") &&
                                     __builtin_cpu_supports("bmi"));
#else
  return false;
#endif
}

const ImageKernels& KernelsOn(SimdPath path) {
  DMSLAM_CHECK(HasSimdPath(path), "the CPU lacks the instructions of this path");
#if defined(__x86_64__)
  if (path == SimdPath::kAvx2 || (path == SimdPath::kBest && HasSimdPath(SimdPath::kAvx2)))
    return Avx2Kernels();
  if (path != SimdPath::kPortable) return Sse2Kernels();
#endif
  return PortableKernels();
}

}  // namespace dmslam
