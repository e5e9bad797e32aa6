#pragma once

#include "dmslam/features/image_kernels.h"

namespace dmslam {

/// One set per path; those of x86 exist there only, and calling what they hold needs the CPU to have the
/// instructions.
const ImageKernels& PortableKernels();
const ImageKernels& Sse2Kernels();
const ImageKernels& Avx2Kernels();

}  // namespace dmslam
