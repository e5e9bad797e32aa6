#pragma once

#include <deque>

#include "dmslam/loops/loop_options.h"
#include "dmslam/loops/loop_verifier.h"
#include "dmslam/map/map.h"

namespace dmslam {

/// Keyframes of one map that geometry found in another, each for itself. One of them may show a picture that
/// hangs there, too. That several lay the two maps onto one another in the same way is no accident: pairwise
/// consistency (Mangelson et al., "Pairwise consistent measurement set maximization", ICRA 2018), between
/// maps instead of robots.
class Sightings {
 public:
  /// The newest of each keyframe counts.
  void Add(const LoopClaim& claim);
  void Clear() { claims_.clear(); }

  /// Whether enough other keyframes, over enough time, say the same of the two maps as `loop` does. The
  /// keyframes may have moved since they were found.
  bool BearOut(const Map& map, const VerifiedLoop& loop, const JoiningOptions& options) const;

 private:
  std::deque<LoopClaim> claims_;  ///< oldest first
};

}  // namespace dmslam
