#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/util/crc32c.h"

namespace dmslam::vocabulary_format {

// The binary format, all little-endian:
//   Header                                       64 bytes
//   uint8  child count of each node              padded with zeros to a multiple of 64
//   32 bytes descriptor of each node
//   float32 weight of each word
// The checksum is CRC-32C over branching, levels, num_nodes, num_words and the three arrays without padding.
static_assert(std::endian::native == std::endian::little, "vocabularies are mapped as they are");

inline constexpr std::array<char, 8> kMagic = {'D', 'M', 'V', 'O', 'C', 'A', 'B', '\n'};
inline constexpr uint32_t kVersion = 1;
inline constexpr uint32_t kMaxBranching = 64;
inline constexpr uint32_t kMaxLevels = 10;
inline constexpr uint32_t kMaxNodes = 1U << 26;

struct Header {
  std::array<char, 8> magic = kMagic;
  uint32_t version = kVersion;
  uint32_t branching = 0;
  uint32_t levels = 0;
  uint32_t num_nodes = 0;
  uint32_t num_words = 0;
  uint32_t checksum = 0;
  uint32_t descriptor_id = 0;
  std::array<uint8_t, 24> reserved{};
  uint32_t header_crc = 0;  ///< CRC-32C over what is above
};
static_assert(sizeof(Header) == 64 && std::is_trivially_copyable_v<Header>);

inline uint32_t HeaderCrc(const Header& header) {
  return Crc32c({reinterpret_cast<const uint8_t*>(&header), offsetof(Header, header_crc)});
}

inline constexpr size_t PaddedTo64(size_t bytes) { return (bytes + 63) / 64 * 64; }

/// Where the arrays of a file with this header lie [bytes].
struct Layout {
  explicit Layout(const Header& header)
      : child_counts(sizeof(Header)),
        descriptors(child_counts + PaddedTo64(header.num_nodes)),
        weights(descriptors + size_t{header.num_nodes} * sizeof(Descriptor)),
        end(weights + size_t{header.num_words} * sizeof(float)) {}
  size_t child_counts;
  size_t descriptors;
  size_t weights;
  size_t end;
};

/// Parses DBoW2's text format. `name` begins every error.
VocabularyTree ParseText(std::string_view text, const std::string& name);

/// Writes it.
void WriteText(const Vocabulary& vocabulary, const std::filesystem::path& path);

}  // namespace dmslam::vocabulary_format
