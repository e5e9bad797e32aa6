#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// People stand still no longer than this [s]: what was longer in its place is trusted.
inline constexpr double kPeopleStandS = 4.0;

/// When a landmark is proven to be no part of somebody who stood still for a while.
struct ProvenOptions {
  double standing_s = kPeopleStandS;
  int outer_observations = 2;  ///< a landmark with so many observations outside such a time is proven
};

/// So many proven landmarks in view confirm a place.
inline constexpr int kManyProven = 50;
/// In a map that is old enough to have proven landmarks, neither time nor the motion confirms a place that
/// shows fewer.
inline constexpr int kSomeProven = 8;

/// Whether some of these sorted stamps lie outside any window as long as people stand.
bool OutlastsStanding(const std::vector<int64_t>& stamps_ns, const ProvenOptions& options);

/// Stamps of the keyframes that see the landmark, in order.
std::vector<int64_t> ObservationStamps(const Map& map, const Landmark& landmark);

/// Whether keyframes from a longer time than people stand see the landmark where it is, and it is not
/// believed to move. What was seen for a shorter time may be a person, however still it stood and from
/// however many sides it was seen.
bool IsProven(const Map& map, const Landmark& landmark, const ProvenOptions& options);

/// How many of these landmarks (invalid ids: none) are proven.
int CountProven(const Map& map, const std::vector<LandmarkId>& landmarks, const ProvenOptions& options);

/// Whether a map is old enough for the landmarks that are seen time and again to be proven: its keyframes
/// span twice as long as people stand.
bool CanBeProven(const Map& map, MapId map_id, const ProvenOptions& options);

}  // namespace dmslam
