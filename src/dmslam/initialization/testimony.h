#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "dmslam/initialization/candidate_map.h"
#include "dmslam/initialization/reference_window.h"

namespace dmslam {

/// Reference frames that are kept side by side see the same camera move: what one of them found is worth a
/// try at the others, and has a say in what they find. A wrong motion may explain the views of one reference
/// frame better than the true one does, but seldom those of several, and seldom for long. A motion T_to_from
/// takes points from one camera's frame into the other's, up to scale; `from` and `to` are indices of frames.

/// How the camera moved between two frames, if the candidate's motion is its. None: one of the two is no view
/// of the window, or shows too few of the candidate's points where they should be.
std::optional<Rigid3d> MotionBetween(const CandidateBuilder& builder, const ReferenceWindow& window,
                                     const CandidateMap& candidate, uint32_t from, uint32_t to);

/// What this window and older ones in `windows`, which contains it, found last, as motions from its reference
/// frame to its newest view.
std::vector<Rigid3d> MotionsToTry(const CandidateBuilder& builder, const std::deque<ReferenceWindow>& windows,
                                  const ReferenceWindow& window, const TestimonyOptions& options);

enum class Verdict {
  kUnheard,       ///< nobody else has a say, and the window itself found nothing else within the last second
  kConfirmed,     ///< others are for it, and those against it have watched for less time than it and they
                  ///< together
  kContradicted,  ///< somebody is against it, and it is not confirmed
};

/// What all windows, by what they claimed within the last second, say of the candidate's motion. Each is for
/// or against it and counts by how long it has watched; the candidate's own window can only be against it.
Verdict Hear(const CandidateBuilder& builder, const std::deque<ReferenceWindow>& windows,
             const ReferenceWindow& window, const CandidateMap& candidate, const TestimonyOptions& options);

}  // namespace dmslam
