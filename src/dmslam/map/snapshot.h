#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// Payload of a snapshot's pieces that are published or written to a file: with headers below 64 KiB.
inline constexpr size_t kSnapshotPieceBytes = size_t{56} * 1024;

/// The whole map as deltas with at most `max_bytes_hint` of payload each, keyframes near `center` first.
/// Applying all of them to an empty replica gives this map.
std::vector<MapDelta> CutSnapshot(const Map& map, std::optional<KeyframeId> center, size_t max_bytes_hint);

}  // namespace dmslam
