#include "dmslam/tracking/pose_search.h"

#include <algorithm>

#include "dmslam/camera/image_scale.h"
#include "dmslam/dynamics/elders.h"
#include "dmslam/dynamics/landmark_votes.h"
#include "dmslam/geometry/solve_symmetric.h"

namespace dmslam {
namespace {

constexpr double kWiderAfterRelocalization = 2.0;  // times the radius of the search
constexpr double kWiderAroundPrediction = 4.0;
constexpr size_t kMinKeyframeMatches = 15;
constexpr double kSeenShare = 0.5;  // of what the last frame showed: less is hidden, and contradicts nothing
// Somebody who fills the picture hides the room: of the landmarks that are older than people stand less than
// this share is seen.
constexpr double kLeastOldShare = 0.02;

void SetMatches(const std::vector<LandmarkMatch>& matches, const Rigid3d& T_cam_world, TrackedFrame* frame) {
  frame->ClearMatches();
  for (const LandmarkMatch& match : matches) frame->landmarks[match.feature] = match.landmark->id;
  frame->T_cam_world = T_cam_world;
}

}  // namespace

PoseSearch::PoseSearch(const TrackingOptions& options, const Camera& camera)
    : options_(options),
      camera_(camera),
      local_map_(options.max_local_keyframes),
      search_(options),
      solver_(options.chi2),
      judge_(options.dynamics, camera) {}

void PoseSearch::Reset() {
  local_map_.Reset();
  judge_.Reset();
}

PoseSearch::FromFrameResult PoseSearch::FromFrame(const Map& map, const TrackedFrame& last,
                                                  const Rigid3d& T_predicted, const Prior& prior,
                                                  TrackedFrame* frame) {
  const size_t needed = static_cast<size_t>(options_.min_motion_matches);
  const double radius_px = SearchRadiusPx(camera_, options_.motion_radius_rad);
  const auto* matches =
      &search_.MatchFrame(map, judge_.votes(), last, T_predicted, radius_px, *frame->features);
  if (matches->size() < needed) {
    matches = &search_.MatchFrame(map, judge_.votes(), last, T_predicted, 2 * radius_px, *frame->features);
  }
  if (matches->size() < needed) return FromFrameResult::kNotSeen;
  SetMatches(*matches, T_predicted, frame);
  const PoseFit fit = solver_.Solve(map, prior, &judge_, frame);
  if (fit.inliers < options_.min_motion_inliers) {
    const auto shown = std::ranges::count_if(last.landmarks, &LandmarkId::valid);
    const bool hidden = static_cast<double>(matches->size()) < kSeenShare * static_cast<double>(shown);
    return hidden ? FromFrameResult::kNotSeen : FromFrameResult::kContradicted;
  }
  return fit.by_rival ? FromFrameResult::kFoundRival : FromFrameResult::kFound;
}

int PoseSearch::FromPrediction(const Map& map, const Rigid3d& T_predicted, const Prior& prior,
                               TrackedFrame* frame) {
  local_map_.DropGone(map);
  SetMatches({}, T_predicted, frame);
  MatchAround(map, kWiderAroundPrediction, frame);
  return solver_.Solve(map, prior, &judge_, frame).inliers;
}

bool PoseSearch::FromKeyframe(const Map& map, KeyframeId keyframe_id, uint64_t seed, const Prior& prior,
                              TrackedFrame* frame) {
  const Keyframe* found = map.Resolve(keyframe_id);
  if (found == nullptr) return false;
  const std::vector<LandmarkMatch>& matches =
      search_.MatchKeyframe(map, judge_.votes(), *found, *frame->features);
  if (matches.size() < kMinKeyframeMatches) return false;
  PoseRansacOptions ransac;
  ransac.seed = seed;
  const auto report = PoseFromLandmarks(map, *frame->features, matches, ransac);
  if (!report.success) return false;
  SetMatches(matches, report.model, frame);
  return solver_.Solve(map, prior, &judge_, frame).inliers >= options_.min_motion_inliers;
}

bool PoseSearch::FromTurn(const Map& map, const TrackedFrame& last, const Rigid3d& T_cam_world,
                          const TurnRange& range, TrackedFrame* frame) {
  local_map_.Collect(map, last);
  const std::optional<Rigid3d> T_turned =
      turns_.Find(map, judge_.votes(), local_map_.landmarks(), T_cam_world, range.most_rad, *frame->features);
  if (!T_turned || AngleBetween(T_turned->rotation, T_cam_world.rotation) < range.least_rad) return false;
  SetMatches({}, *T_turned, frame);
  MatchAround(map, kWiderAroundPrediction, frame);
  return solver_.Solve(map, std::nullopt, &judge_, frame).inliers >= options_.min_motion_inliers;
}

TrackingReport PoseSearch::InLocalMap(const Map& map, bool careful, const Prior& prior, TrackedFrame* frame) {
  const Fitted fitted = FitInLocalMap(map, careful, prior, frame);
  if (fitted.report.IsTracked()) judge_.Believe(map, fitted.expected, *frame);
  return fitted.report;
}

bool PoseSearch::FitsLocalMap(const Map& map, TrackedFrame* frame) {
  return FitInLocalMap(map, false, std::nullopt, frame).report.HasPose();
}

PoseSearch::Fitted PoseSearch::FitInLocalMap(const Map& map, bool careful, const Prior& prior,
                                             TrackedFrame* frame) {
  local_map_.Collect(map, *frame);
  const double wider = careful ? kWiderAfterRelocalization : 1.0;
  auto expected = MatchAround(map, wider, frame);
  PoseFit fit = solver_.Solve(map, prior, &judge_, frame);
  judge_.Judge(map, expected, fit.rejected, frame);
  bool by_rival = fit.by_rival;
  if (!fit.by_trusted_elders && solver_.FollowWiderMotion(map, prior, judge_, frame)) {
    by_rival = true;
    expected = MatchAround(map, wider, frame);
    fit = solver_.Solve(map, std::nullopt, &judge_, frame, Elderhood::kIgnored);
    judge_.Judge(map, expected, fit.rejected, frame);
  }
  TrackingReport report = CountClasses(camera_, *frame);
  CountExpected(map, expected, *frame, &report);
  report.by_rival = by_rival;
  Decide(fit, careful, &report);
  return {report, expected};
}

std::span<const ExpectedLandmark> PoseSearch::MatchAround(const Map& map, double wider, TrackedFrame* frame) {
  const auto expected = search_.MatchLandmarks(map, judge_.votes(), local_map_.landmarks(), wider, frame);
  judge_.DropMatchesOfHiddenPlaces(map, expected, frame);
  return expected;
}

FoundPose PoseSearch::found(const TrackedFrame& frame) const {
  return {frame.T_cam_world, InverseOf(basis().information)};
}

void PoseSearch::CountExpected(const Map& map, std::span<const ExpectedLandmark> expected,
                               const TrackedFrame& frame, TrackingReport* report) const {
  report->num_expected = static_cast<int>(expected.size());
  const auto is_old = [&](const Landmark* landmark) {
    return landmark != nullptr && IsOldAt(*landmark, frame.stamp_ns, options_.dynamics.vote);
  };
  const auto is_match_old = [&](LandmarkId id) { return id.valid() && is_old(map.FindLandmark(id)); };
  report->num_old_expected =
      static_cast<int>(std::ranges::count_if(expected, is_old, &ExpectedLandmark::landmark));
  report->num_old = static_cast<int>(std::ranges::count_if(frame.landmarks, is_match_old));
}

void PoseSearch::Decide(const PoseFit& fit, bool careful, TrackingReport* report) const {
  report->outcome = TrackingReport::Outcome::kTracked;
  report->num_static = fit.inliers;
  report->num_elsewhere = static_cast<int>(fit.rejected.size());
  report->mean_chi2 = fit.mean_chi2;
  const int needed = careful ? options_.min_inliers_after_relocalization : options_.min_local_inliers;
  if (fit.inliers < needed) {
    report->TakePoseAway("too few static features match the map");
  } else if (report->cells < options_.min_cells) {
    report->TakePoseAway("the static features lie in too small a part of the image");
  } else if (options_.doubt) {
    Doubt(fit, report);
  }
}

/// A pose that shows much of what it should is right even where all that has stood for long is hidden. Where
/// it shows little, that may be somebody who hides the room, or chance.
void PoseSearch::Doubt(const PoseFit& fit, TrackingReport* report) {
  if (!report->MayMatchByChance()) return;
  if (report->num_old_expected >= TrackingReport::kEnoughOld &&
      report->num_old < kLeastOldShare * report->num_old_expected) {
    report->reason = "what has stood here for long is not seen";
  } else if (fit.mean_chi2 > kOneMotionChi2) {
    report->reason = "what matches the map may do so by chance";
  } else {
    return;
  }
  report->outcome = TrackingReport::Outcome::kDoubtful;
}

}  // namespace dmslam
