#pragma once

#include <deque>
#include <functional>

#include "dmslam/initialization/candidate_map.h"
#include "dmslam/initialization/reference_window.h"

namespace dmslam {

/// What a candidate must meet to become the first map. Holds no state but its options.
class MapGates {
 public:
  /// The builder must outlive it.
  MapGates(const InitializerOptions& options, const CandidateBuilder& builder)
      : options_(options), builder_(builder) {}

  using MatchFunction = std::function<ReferenceView(const InitializerFrame&)>;
  /// Adjusts `candidate` with all its points, drops those that frames just before the reference frame see
  /// elsewhere, and says whether it may become a map; otherwise `refused` says why not. `window`, one of
  /// `windows`, notes what was found. `match` matches a frame with the window's reference frame.
  bool Admit(const std::deque<ReferenceWindow>& windows, const MatchFunction& match, ReferenceWindow* window,
             CandidateMap* candidate, Refused* refused) const;

 private:
  bool HasPointsAndParallax(const CandidateMap& candidate, const ReferenceWindow& window,
                            Refused* refused) const;
  bool HasParallax(const CandidateMap& candidate, const ReferenceWindow& window, Refused* refused) const;
  bool TurnsAway(const CandidateMap& candidate, const ReferenceWindow& window) const;
  bool AgreesWithPast(const MatchFunction& match, ReferenceWindow* window, CandidateMap* candidate,
                      Refused* refused) const;
  bool IsBelieved(const std::deque<ReferenceWindow>& windows, const CandidateMap& candidate,
                  ReferenceWindow* window, Refused* refused) const;
  bool IsSure(const CandidateMap& candidate, const ReferenceWindow& window) const;
  bool FoundAgain(const CandidateMap& candidate, ReferenceWindow* window) const;

  InitializerOptions options_;
  const CandidateBuilder& builder_;
};

}  // namespace dmslam
