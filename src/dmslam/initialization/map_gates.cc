#include "dmslam/initialization/map_gates.h"

#include <cmath>
#include <string>

#include "dmslam/initialization/motion_race.h"
#include "dmslam/initialization/testimony.h"

namespace dmslam {
namespace {

std::string Degrees(double rad) { return std::to_string(rad * 180.0 / M_PI) + " degrees"; }

}  // namespace

bool MapGates::HasPointsAndParallax(const CandidateMap& candidate, const ReferenceWindow& window,
                                    Refused* refused) const {
  const int points = candidate.NumPoints();
  if (points < options_.geometry.min_points) {
    *refused = {WaitReason::kTooFewStatic, std::to_string(points) + " points are seen consistently"};
    return false;
  }
  return HasParallax(candidate, window, refused);
}

/// Less of it is asked where waiting brings no more.
bool MapGates::HasParallax(const CandidateMap& candidate, const ReferenceWindow& window,
                           Refused* refused) const {
  const GeometryOptions& asked = options_.geometry;
  const double parallax = builder_.Parallax(candidate), sigma = builder_.DirectionSigma(candidate);
  if (parallax >= asked.min_parallax_rad && sigma <= asked.max_direction_sigma_rad) return true;
  if (parallax >= asked.losing_parallax_rad && sigma <= asked.clear_direction_sigma_rad &&
      TurnsAway(candidate, window))
    return true;
  *refused = {WaitReason::kParallaxTooSmall,
              "median " + Degrees(parallax) + ", direction known to " + Degrees(sigma), parallax};
  return false;
}

/// Whether little is left of what the first view showed. Somebody who leaves the picture is no loss.
bool MapGates::TurnsAway(const CandidateMap& candidate, const ReferenceWindow& window) const {
  const ReferenceView& first = window.views().front();
  const std::optional<Rigid3d> T_first_0 = builder_.PoseOf(first, candidate);
  return T_first_0 && builder_.NumAgreeing(candidate.last(), candidate.T_last_0()) <=
                          options_.geometry.losing_share * builder_.NumAgreeing(first, *T_first_0);
}

bool MapGates::Admit(const std::deque<ReferenceWindow>& windows, const MatchFunction& match,
                     ReferenceWindow* window, CandidateMap* candidate, Refused* refused) const {
  if (!HasPointsAndParallax(*candidate, *window, refused)) return false;
  if (!builder_.Adjust(candidate)) {
    *refused = {WaitReason::kInconsistent, "the adjustment failed"};
    return false;
  }
  builder_.KeepConsistent(candidate);
  if (!AgreesWithPast(match, window, candidate, refused)) return false;
  return HasPointsAndParallax(*candidate, *window, refused) &&
         IsBelieved(windows, *candidate, window, refused);
}

/// Other reference frames decide. Where none has a say, the motion must be a clear one, or be found again.
bool MapGates::IsBelieved(const std::deque<ReferenceWindow>& windows, const CandidateMap& candidate,
                          ReferenceWindow* window, Refused* refused) const {
  const bool again = FoundAgain(candidate, window);
  switch (Hear(builder_, windows, *window, candidate, options_.testimony)) {
    case Verdict::kConfirmed:
      return true;
    case Verdict::kContradicted:
      *refused = {WaitReason::kInconsistent, "other reference frames say another motion"};
      return false;
    case Verdict::kUnheard:
      break;
  }
  if (IsSure(candidate, *window) || (again && IsAlone(candidate, options_.motion))) return true;
  *refused = {WaitReason::kOnTrial, "another view or reference frame must find the same motion"};
  return false;
}

/// True unless motions were hard to tell apart before, the views are near each other in time, or another
/// motion explains them nearly as well and the direction is hardly known.
bool MapGates::IsSure(const CandidateMap& candidate, const ReferenceWindow& window) const {
  const bool clear = IsAlone(candidate, options_.motion) ||
                     builder_.DirectionSigma(candidate) <= options_.geometry.clear_direction_sigma_rad;
  return !window.IsDoubtful() && clear && candidate.last().since_reference_s >= options_.sure_age_s;
}

/// Whether the map found last says the same of the camera's motion. What holds for one view by chance seldom
/// holds for the next.
bool MapGates::FoundAgain(const CandidateMap& candidate, ReferenceWindow* window) const {
  const auto before = window->OnFound({&candidate.last(), candidate.T_last_0()});
  if (!before) return false;
  CandidateMap longer = candidate;
  builder_.PlaceView(*before->view, &longer);
  const CandidateMap::Placed& placed = longer.placed.back();
  return placed.view == before->view && CandidateBuilder::SameMotion(placed.T_k_0, before->T_view_0);
}

/// Drops points that frames just before the reference frame see elsewhere. If there are many, somebody has
/// just stopped, and what is his cannot be told from the rest: what these frames do not show is not dropped.
bool MapGates::AgreesWithPast(const MatchFunction& match, ReferenceWindow* window, CandidateMap* candidate,
                              Refused* refused) const {
  CandidateMap longer = *candidate;
  for (const ReferenceView& view : window->Past(match)) builder_.PlaceView(view, &longer);
  builder_.KeepConsistent(&longer);
  const int points = candidate->NumPoints(), left = longer.NumPoints();
  if (points - left > options_.past.max_conflict * points) {
    *refused = {WaitReason::kInconsistent, std::to_string(points - left) + " of " + std::to_string(points) +
                                               " points were elsewhere just before"};
    return false;
  }
  candidate->use = longer.use;
  return true;
}

}  // namespace dmslam
