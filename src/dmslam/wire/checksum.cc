#include <zlib.h>

#include <array>

#include "dmslam/wire/codec_impl.h"

namespace dmslam::wire {
namespace {

constexpr size_t kOffset = 16;  // behind fingerprint and utime
constexpr size_t kBytes = 4;

}  // namespace

uint32_t ChecksumOf(std::span<const uint8_t> bytes) {
  constexpr std::array<uint8_t, kBytes> kZero{};
  uLong checksum = crc32_z(0, bytes.data(), kOffset);
  checksum = crc32_z(checksum, kZero.data(), kBytes);
  const std::span<const uint8_t> rest = bytes.subspan(kOffset + kBytes);
  return static_cast<uint32_t>(crc32_z(checksum, rest.data(), rest.size()));
}

void PutChecksum(std::span<uint8_t> bytes) {
  const uint32_t checksum = ChecksumOf(bytes);
  for (size_t i = 0; i < kBytes; ++i)
    bytes[kOffset + i] = static_cast<uint8_t>(checksum >> (8 * (kBytes - 1 - i)));
}

bool ChecksumFits(std::span<const uint8_t> bytes) {
  uint32_t said = 0;
  for (size_t i = 0; i < kBytes; ++i) said = (said << 8) | bytes[kOffset + i];
  return said == ChecksumOf(bytes);
}

}  // namespace dmslam::wire
