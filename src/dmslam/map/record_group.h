#pragma once

#include <cstdint>

namespace dmslam {

/// A change that is too large for one record travels as several, which are applied as one or not at all:
/// records `index` = 0, 1 ... `count` - 1 of group `id`, one behind the other in their stream.
struct RecordGroup {
  uint64_t id = 0;  ///< 0 where the record stands alone
  uint32_t index = 0;
  uint32_t count = 1;
  bool alone() const { return count == 1; }
  bool operator==(const RecordGroup&) const = default;
};

}  // namespace dmslam
