#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/map/replica.h"

namespace dmslam {

/// The map with which a run has ended.
struct EndedMap {
  std::optional<Replica> found;          ///< on the disk, not yet taken over
  std::optional<uint64_t> safe_version;  ///< need not be written again
  std::optional<int64_t> here_ns;        ///< since when it is here
};

}  // namespace dmslam
