#pragma once

#include <cstdint>
#include <span>

namespace dmslam {

/// CRC-32C (Castagnoli, RFC 3720 appendix B.4) of some bytes; pass an earlier result as `crc` to continue it.
/// Uses the CPU's instruction where there is one; the result is the same everywhere.
uint32_t Crc32c(std::span<const uint8_t> bytes, uint32_t crc = 0);

}  // namespace dmslam
