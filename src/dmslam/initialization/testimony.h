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
/// frame better than the true one does, but seldom those of several, and seldom for long. All indices are of
/// frames; motions take points of the first frame into the second, up to scale.

/// How the camera moved between two frames, if the candidate's motion is its. None: one of the two is no view
/// of the window, or shows too few of the candidate's points where they should be.
std::optional<Rigid3d> MotionBetween(const CandidateBuilder& builder, const ReferenceWindow& window,
                                     const CandidateMap& candidate, uint32_t from, uint32_t to);

/// Motions from the window's reference frame to its newest view by what it and older ones found last. `older`
/// are those before it in `windows`, which hold it.
std::vector<Rigid3d> MotionsToTry(const CandidateBuilder& builder, const std::deque<ReferenceWindow>& windows,
                                  const ReferenceWindow& window, const TestimonyOptions& options);

enum class Verdict {
  kUnheard,       ///< no other reference frame has a say
  kConfirmed,     ///< at least one says the same, and those that do not have watched for less time together
  kContradicted,  ///< otherwise; or the window itself found another motion for most of the last second
};

/// What all windows, with what they found within the last second, say of the candidate's motion. Each one
/// counts by how long it has watched.
Verdict Hear(const CandidateBuilder& builder, const std::deque<ReferenceWindow>& windows,
             const ReferenceWindow& window, const CandidateMap& candidate, const TestimonyOptions& options);

}  // namespace dmslam
