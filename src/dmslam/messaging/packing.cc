#include "dmslam/messaging/packing.h"

#include <zlib.h>

#include <algorithm>

#include "dmslam/messaging/codec.h"

namespace dmslam {
namespace {

constexpr size_t kHeadBytes = 5;
constexpr int kLevel = 1;  // fast; more gains little on coordinates and descriptors

/// None where it does not become shorter.
std::optional<Bytes> Pack(std::span<const uint8_t> plain) {
  uLongf size = compressBound(static_cast<uLong>(plain.size()));
  Bytes packed(kHeadBytes + size);
  if (compress2(packed.data() + kHeadBytes, &size, plain.data(), static_cast<uLong>(plain.size()), kLevel) !=
      Z_OK) {
    return std::nullopt;
  }
  packed.resize(kHeadBytes + size);
  if (packed.size() >= plain.size()) return std::nullopt;
  packed[0] = 0;
  PutInt(static_cast<uint32_t>(plain.size()), 1, packed);
  return packed;
}

std::optional<Bytes> Unpack(std::span<const uint8_t> content, size_t max_bytes) {
  if (content.size() <= kHeadBytes) return std::nullopt;
  const size_t announced = GetInt<uint32_t>(content, 1);
  if (announced > max_bytes) return std::nullopt;
  Bytes plain(announced);
  uLongf size = static_cast<uLongf>(announced);
  const auto packed = content.subspan(kHeadBytes);
  const int result = uncompress(plain.data(), &size, packed.data(), static_cast<uLong>(packed.size()));
  if (result != Z_OK || size != announced) return std::nullopt;
  return plain;
}

}  // namespace

Bytes ContentOf(std::string_view channel, std::span<const uint8_t> record, bool pack) {
  Bytes plain;
  plain.reserve(channel.size() + 1 + record.size());
  plain.insert(plain.end(), channel.begin(), channel.end());
  plain.push_back(0);
  plain.insert(plain.end(), record.begin(), record.end());
  if (!pack) return plain;
  std::optional<Bytes> packed = Pack(plain);
  return packed ? std::move(*packed) : plain;
}

std::optional<std::pair<std::string, Bytes>> ParseContent(std::span<const uint8_t> content,
                                                          size_t max_bytes) {
  if (content.empty()) return std::nullopt;
  Bytes plain;
  if (content[0] == 0) {
    std::optional<Bytes> unpacked = Unpack(content, max_bytes);
    if (!unpacked) return std::nullopt;
    plain = std::move(*unpacked);
  } else {
    plain.assign(content.begin(), content.end());
  }
  const auto name_end = std::find(plain.begin(), plain.end(), uint8_t{0});
  if (name_end == plain.end()) return std::nullopt;
  return std::pair(std::string(plain.begin(), name_end), Bytes(name_end + 1, plain.end()));
}

}  // namespace dmslam
