#pragma once

#include <functional>
#include <string>

#include "dmslam/loops/loop_options.h"
#include "dmslam/loops/loop_verifier.h"
#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"

namespace dmslam {

/// What a verified loop does to the map: the keyframe and its neighbours are carried to where the place says
/// they are, the essential graph spreads what is left over all keyframes (Strasdat et al. 2010; Mur-Artal et
/// al. 2015, section VII.C), and landmarks seen from both sides become one. Between two maps there is nothing
/// to spread: the keyframe's whole map is carried over.
LoopAnswer CorrectLoop(const Map& map, const VerifiedLoop& loop, const LoopVerifier& verifier,
                       const LoopcloserOptions& options, const std::function<bool()>& interrupt);

/// Bundle adjustment of a whole map, as a correction by that number. Kind kNone when it failed.
LoopAnswer AdjustGlobally(const Map& map, MapId map_id, uint64_t correction_id,
                          const LoopCorrectionOptions& options, const std::function<bool()>& interrupt);

}  // namespace dmslam
