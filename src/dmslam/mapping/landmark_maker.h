#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <utility>

#include "dmslam/map/map_editor.h"
#include "dmslam/util/check.h"

namespace dmslam {

/// Makes landmarks with ids of one epoch's ordinal.
class LandmarkMaker {
 public:
  explicit LandmarkMaker(uint16_t epoch_ordinal) : epoch_ordinal_(epoch_ordinal) {}

  /// The same for a map that others began: ids of an ordinal above all that it knows. `successor`: a random
  /// number of the one who continues it: after a network was split there may be two, and their ordinals are
  /// to differ. It chooses among the next ordinals, of which the fewer there are left the fewer are passed
  /// over.
  void Continue(const Map& map, uint64_t successor = 0) {
    const uint32_t highest = std::max(map.HighestOrdinal(), epoch_ordinal_);
    DMSLAM_CHECK(highest < LandmarkId::kLastOrdinal, "the ordinals of landmarks are used up");
    const uint32_t choice = std::clamp<uint32_t>((LandmarkId::kLastOrdinal - highest) / 64, 1, kMostChoice);
    epoch_ordinal_ = static_cast<uint16_t>(highest + 1 + successor % choice);
    next_ = 1;
  }

  /// Adds a landmark that follows `reference`. `newest`: the newest keyframe; the landmark's age is counted
  /// from there.
  const Landmark& Add(MapEditor& map, const Keyframe& reference, const Keyframe& newest,
                      const Eigen::Vector3d& p_world) {
    Landmark landmark;
    landmark.id = LandmarkId::Make(epoch_ordinal_, next_++);
    landmark.map_id = reference.map_id;
    landmark.p_world = p_world;
    landmark.reference = reference.id;
    landmark.first_keyframe = newest.id;
    landmark.first_ns = newest.stamp_ns;
    landmark.evidence.visible = 1;
    landmark.evidence.found = 1;
    return map.AddLandmark(std::move(landmark));
  }

 private:
  static constexpr uint32_t kMostChoice = 1021;

  uint16_t epoch_ordinal_;
  uint64_t next_ = 1;
};

}  // namespace dmslam
