#include "dmslam/messaging/codec.h"

#include "dmslam/util/crc32c.h"

namespace dmslam {
namespace {

constexpr size_t kCrcOffset = kHeaderOffset + kHeaderBytes - 4;

uint32_t ChecksumOf(std::string_view channel, std::span<const uint8_t> message) {
  constexpr uint8_t kZeros[4] = {};
  uint32_t crc = Crc32c({reinterpret_cast<const uint8_t*>(channel.data()), channel.size()});
  crc = Crc32c(message.first(kCrcOffset), crc);
  crc = Crc32c(kZeros, crc);
  return Crc32c(message.subspan(kCrcOffset + 4), crc);
}

}  // namespace

LayoutWalker& LayoutWalker::Skip(int64_t num_bytes) {
  if (!ok_ || num_bytes < 0 || static_cast<uint64_t>(num_bytes) > bytes_.size() - offset_) {
    ok_ = false;
  } else {
    offset_ += static_cast<size_t>(num_bytes);
  }
  return *this;
}

int64_t LayoutWalker::Count() {
  const size_t at = offset_;
  if (!Skip(4).ok_) return 0;
  const auto count = GetInt<int32_t>(bytes_, at);
  if (count < 0 || static_cast<size_t>(count) > bytes_.size() - offset_) {
    ok_ = false;
    return 0;
  }
  return count;
}

LayoutWalker& LayoutWalker::String() {
  const int64_t length = Count();
  Skip(length);
  if (ok_ && (length == 0 || bytes_[offset_ - 1] != 0)) ok_ = false;
  return *this;
}

std::optional<int64_t> FingerprintOf(std::span<const uint8_t> bytes) {
  if (bytes.size() < 8) return std::nullopt;
  return GetInt<int64_t>(bytes, 0);
}

std::optional<RecordHeader> ParseHeader(std::span<const uint8_t> message) {
  if (message.size() < kHeaderOffset + kHeaderBytes) return std::nullopt;
  RecordHeader header{};
  const auto size = static_cast<int>(kHeaderBytes);
  if (header._decodeNoHash(message.data(), static_cast<int>(kHeaderOffset), size) != size)
    return std::nullopt;
  return header;
}

void Seal(const RecordHeader& header, std::string_view channel, Bytes& message) {
  DMSLAM_CHECK(message.size() >= kHeaderOffset + kHeaderBytes, "a record needs its header as second field");
  const auto size = static_cast<int>(kHeaderBytes);
  header._encodeNoHash(message.data(), static_cast<int>(kHeaderOffset), size);
  PutInt(ChecksumOf(channel, message), kCrcOffset, message);
}

bool IsIntact(std::string_view channel, std::span<const uint8_t> message) {
  return message.size() >= kHeaderOffset + kHeaderBytes &&
         GetInt<uint32_t>(message, kCrcOffset) == ChecksumOf(channel, message);
}

}  // namespace dmslam
