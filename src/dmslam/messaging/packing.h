#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "dmslam/messaging/types.h"

namespace dmslam {

/// The bytes of which a record's parts are pieces: the name of its channel, a zero byte, the record; or,
/// where `pack` is set and that is shorter, a zero byte, the length of all that (4 bytes, big-endian), and it
/// deflated (zlib).
Bytes ContentOf(std::string_view channel, std::span<const uint8_t> record, bool pack);

/// Channel and record again; none where the bytes are no such content, or where it would be longer than
/// `max_bytes`.
std::optional<std::pair<std::string, Bytes>> ParseContent(std::span<const uint8_t> content, size_t max_bytes);

}  // namespace dmslam
