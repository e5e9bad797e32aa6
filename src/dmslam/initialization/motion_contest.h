#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "dmslam/initialization/candidate_map.h"

namespace dmslam {

/// A motion carried through all views, and what of the last view's matches it explains in all of them.
struct Contender {
  CandidateMap candidate;
  std::vector<uint8_t> support;  ///< parallel to the last view's matches
};

/// What a contest came to.
struct ContestResult {
  std::optional<Contender> winner;
  double rival_share = 0;  ///< of the widest other motion, outside the winner's support: D times number, as a
                           ///< share of the winner's
  Refused refused;         ///< why there is no winner
};

/// The widest of the contenders by D (paper Eq. 3) times number of their supports, where no other that
/// explains something else comes near.
ContestResult DecideContest(std::vector<Contender> contenders, const ContestOptions& options,
                            double diagonal_px);

}  // namespace dmslam
