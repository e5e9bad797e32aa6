#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "dmslam/map/map.h"
#include "dmslam/map/snapshot.h"

namespace dmslam {

/// A map of which nobody has heard, as records like any others. They go out one at a time, and not too fast:
/// a logger, which nobody repairs, keeps up.
class MapParts {
 public:
  static constexpr int64_t kEveryNs = 3'000'000;

  /// That map is to go out; it has a keyframe.
  void Cut(const Map& map, size_t bytes_of_a_part = kSnapshotPieceBytes);
  /// Others hold what is newer.
  void Drop() { parts_.clear(); }
  /// Whether all of it is out.
  bool empty() const { return parts_.empty(); }
  /// The next one, if its time has come. `has_room`: whether its writer can keep another record; where it
  /// cannot it is asked again as long after.
  std::optional<MapDelta> TakeNext(int64_t now_ns, bool has_room);
  /// When the next one goes out; INT64_MAX: none does.
  int64_t next_ns() const { return empty() ? INT64_MAX : next_ns_; }

 private:
  std::deque<MapDelta> parts_;
  int64_t next_ns_ = 0;
};

}  // namespace dmslam
