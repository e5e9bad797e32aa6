#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/map/map_editor.h"
#include "dmslam/mapping/insertion_order.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// Why a landmark on probation does not hold up.
enum class ProbationFault : uint8_t {
  kRarelyFound = 1,   ///< found in too small a share of the frames that should have seen it
  kFewObservers = 2,  ///< seen by too few keyframes when its probation is nearly over
};

/// None: it holds up so far, or its probation is over.
std::optional<ProbationFault> FaultOnProbation(const Map& map, const Landmark& landmark,
                                               const InsertionOrder& order, const MapperOptions& options);

/// Removes landmarks that were made within the last keyframes and do not hold up (ORB-SLAM2's rule): found
/// too rarely, or with too few observers after two keyframes. Returns how many.
int CullYoungLandmarks(MapEditor& map, MapId map_id, const InsertionOrder& order,
                       const MapperOptions& options);

/// Removes neighbours of `keyframe` whose landmarks others see as well. `keep` is never removed (the frontend
/// tracks against it). Returns how many.
int CullRedundantKeyframes(MapEditor& map, const Keyframe& keyframe, std::optional<KeyframeId> keep,
                           const MapperOptions& options);

/// Removes a keyframe, and of its landmarks those that no two others see.
void RemoveWithLonelyLandmarks(MapEditor& map, const Keyframe& keyframe);

/// Whether a landmark lies nearer to a keyframe that sees it than `share` of what the keyframe sees in the
/// median.
bool IsTooNear(const Map& map, const Landmark& landmark, double share);

/// Removes landmarks that lie just before the lens of a keyframe that sees them: nearer than `share` of what
/// the keyframe sees in the median. A mismatch beside the epipole makes them, and one pulls at the poses
/// harder than all others together. Returns how many.
int RemoveTooNear(MapEditor& map, MapId map_id, double share);

}  // namespace dmslam
