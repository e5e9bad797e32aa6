#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"

namespace dmslam {

/// Log odds are kept within these: however long a landmark stood still, it may start to move, and the other
/// way round.
inline constexpr float kLowestBelief = -4.0F, kHighestBelief = 4.0F;

/// What each landmark's evidence does to the belief that it moves.
struct MotionBeliefOptions {
  bool enabled = true;
  float found_step = 0.5F;    ///< taken from the log odds for each frame that found it in its place
  float moved_step = 1.0F;    ///< added for each frame that found it elsewhere
  float remove_above = 2.5F;  ///< beyond this it leaves the map; kHighestBelief: it never does

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Shared("tracking.motion_belief", enabled);  // one switch for frontend and mapper
    v.Number("mapping.belief_found_step", found_step, 0, 10, "log odds",
             "taken by a frame that finds a landmark in its place");
    v.Number("mapping.belief_moved_step", moved_step, 0, 10, "log odds",
             "added by a frame that finds it elsewhere");
    v.Number("mapping.belief_remove_above", remove_above, 0, kHighestBelief, "log odds",
             "above which a landmark leaves the map; the highest value: none leaves");
  }
};

/// Log odds of motion above which a landmark is believed to move.
constexpr float kBelievedToMove = 0.0F;

inline bool IsBelievedToMove(const LandmarkEvidence& evidence) {
  return evidence.motion_belief > kBelievedToMove;
}

/// Whether a landmark is in the map and is not believed to move. Only such a landmark speaks for a place.
inline bool IsStatic(const Landmark* landmark) {
  return landmark != nullptr && !IsBelievedToMove(landmark->evidence);
}

/// Removes those that are gone (null) or are believed to move.
void KeepStatic(std::vector<const Landmark*>* landmarks);

/// One entry per feature of a keyframe: 1 where it sees a static landmark.
std::vector<uint8_t> StaticFeatures(const Map& map, const Keyframe& keyframe);

/// What is known of two landmarks that were found to be one: all that was said of either. The belief that it
/// moves, and when it last did, are those of the landmark that stays.
LandmarkEvidence Merged(const LandmarkEvidence& stays, const LandmarkEvidence& goes);

/// A landmark's evidence with what a record of frames, the newest of which has this stamp, says of it.
LandmarkEvidence Updated(LandmarkEvidence state, const FrameEvidence::Item& item, int64_t stamp_ns,
                         const MotionBeliefOptions& options);

/// Whether a landmark of this evidence has been believed to move for so long that it leaves the map.
bool IsToBeRemoved(const LandmarkEvidence& evidence, const MotionBeliefOptions& options);

struct EvidenceReport {
  int applied = 0;
  int unknown = 0;  ///< landmarks that are gone
  int removed = 0;  ///< landmarks that were believed to move for too long
};

/// Adds what frames said to the landmarks' counters and motion belief; removes those that move.
EvidenceReport ApplyEvidence(MapEditor& map, const FrameEvidence& evidence,
                             const MotionBeliefOptions& options);

}  // namespace dmslam
