#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>

#include "dmslam/messaging/types.h"
#include "dmslam/util/check.h"

namespace dmslam {

inline constexpr size_t kHeaderOffset = 16;  ///< of the record header within every record-bearing message
inline constexpr size_t kHeaderBytes = 60;

/// Big-endian integers, as LCM writes them. The caller has checked that `offset` leaves room.
template <typename Int>
Int GetInt(std::span<const uint8_t> bytes, size_t offset) {
  using Unsigned = std::make_unsigned_t<Int>;
  Unsigned value = 0;
  for (size_t i = 0; i < sizeof(Int); ++i) value = static_cast<Unsigned>((value << 8) | bytes[offset + i]);
  return static_cast<Int>(value);
}
template <typename Int>
void PutInt(Int value, size_t offset, std::span<uint8_t> bytes) {
  auto rest = static_cast<std::make_unsigned_t<Int>>(value);
  for (size_t i = sizeof(Int); i-- > 0; rest = static_cast<decltype(rest)>(rest >> 8)) {
    bytes[offset + i] = static_cast<uint8_t>(rest);
  }
}

/// The bytes of a generated LCM message.
template <typename Message>
Bytes Encode(const Message& message) {
  const int size = message.getEncodedSize();
  Bytes bytes(static_cast<size_t>(size));
  const int written = message.encode(bytes.data(), 0, size);
  DMSLAM_CHECK(written == size, "an LCM message must encode to its announced size");
  return bytes;
}

/// Walks the layout of an encoded message and stops at the first count or length that does not fit. The
/// generated decoders trust the counts they read, so a message is walked before it is decoded:
///
///   LayoutWalker walk(bytes);
///   const int64_t n = walk.Skip(kAfterHeader).Count();
///   if (!walk.Array(n, 8).String().complete()) drop it;
class LayoutWalker {
 public:
  /// Starts behind the fingerprint.
  explicit LayoutWalker(std::span<const uint8_t> bytes) : bytes_(bytes) { Skip(8); }
  LayoutWalker& Skip(int64_t num_bytes);
  /// Reads an int32_t count: never negative, never more than bytes are left; 0 after a failure.
  int64_t Count();
  /// `count` elements of `element_bytes` each.
  LayoutWalker& Array(int64_t count, int64_t element_bytes) { return Skip(count * element_bytes); }
  /// An LCM string: a length that includes the closing zero, then the characters.
  LayoutWalker& String();
  bool ok() const { return ok_; }
  /// Everything fits, and nothing is left over.
  bool complete() const { return ok_ && offset_ == bytes_.size(); }

 private:
  std::span<const uint8_t> bytes_;
  size_t offset_ = 0;
  bool ok_ = true;
};

/// Fingerprint of the type some bytes claim to be; nothing if there are not even that many.
std::optional<int64_t> FingerprintOf(std::span<const uint8_t> bytes);

/// Decodes a message whose layout was walked and found complete: the fingerprint must be the type's and the
/// decoder must consume exactly the bytes received.
template <typename Message>
std::optional<Message> DecodeWalked(std::span<const uint8_t> bytes) {
  const auto size = static_cast<int>(bytes.size());
  Message message{};
  if (FingerprintOf(bytes) != Message::getHash() || message.decode(bytes.data(), 0, size) != size)
    return std::nullopt;
  return message;
}

/// The header of a record-bearing message; nothing if the message is too short for one.
std::optional<RecordHeader> ParseHeader(std::span<const uint8_t> message);

/// Writes `header` into the message and completes it with the checksum over channel and bytes.
void Seal(const RecordHeader& header, std::string_view channel, Bytes& message);

/// Whether channel and bytes are those that were sealed.
bool IsIntact(std::string_view channel, std::span<const uint8_t> message);

}  // namespace dmslam
