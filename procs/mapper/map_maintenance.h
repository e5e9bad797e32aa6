#pragma once

#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "mapper/mapper_options.h"

namespace dmslam {

/// Removes landmarks that were made within the last keyframes and do not hold up (ORB-SLAM2's rule): found
/// too rarely, or with too few observers after two keyframes. Returns how many.
int CullYoungLandmarks(Map& map, MapId map_id, const MapperOptions& options);

/// Removes neighbours of keyframe `id` whose landmarks others see as well. `keep` is never removed (the
/// frontend tracks against it). Returns how many.
int CullRedundantKeyframes(Map& map, KeyframeId id, KeyframeId keep, const MapperOptions& options);

struct EvidenceReport {
  int applied = 0;
  int unknown = 0;  ///< landmarks that are gone
  int removed = 0;  ///< landmarks that were believed to move for too long
};

/// Adds what frames said to the landmarks' counters and motion belief; removes those that move.
EvidenceReport ApplyEvidence(Map& map, const FrameEvidence& evidence, const MotionBeliefOptions& options);

}  // namespace dmslam
