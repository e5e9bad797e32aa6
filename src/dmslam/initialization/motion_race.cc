#include "dmslam/initialization/motion_race.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "dmslam/geometry/two_view.h"
#include "dmslam/initialization/plane_motions.h"
#include "dmslam/initialization/testimony.h"
#include "dmslam/motion_segmentation/two_view_model.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

TwoViewModel ModelOf(const Rigid3d& T_1_0) {
  return {EssentialFromPose(T_1_0), T_1_0.rotation.toRotationMatrix(), T_1_0.translation};
}

}  // namespace

bool MotionRace::HasRun(const Rigid3d& T_last_0) const {
  return std::any_of(entered.begin(), entered.end(),
                     [&](const Rigid3d& other) { return CandidateBuilder::SameMotion(other, T_last_0); });
}

void MotionRace::Enter(CandidateMap candidate) {
  entered.push_back(candidate.T_last_0());
  const bool wins = !best || candidate.cost < best->cost;
  if (best && !CandidateBuilder::SameMotion(best->T_last_0(), candidate.T_last_0())) {
    CandidateMap& loser = wins ? *best : candidate;
    if (!runner_up || loser.cost < runner_up->cost) runner_up = std::move(loser);
  }
  if (wins) best = std::move(candidate);
}

MotionRace MotionSearch::Run(const std::deque<ReferenceWindow>& windows, const ReferenceWindow& window,
                             std::span<const uint8_t> is_static, Refused* refused) const {
  const ReferenceView& last = window.views().back();
  const std::vector<const ReferenceView*> between = window.ViewsBetween(last, options_.max_views - 1);
  std::vector<uint32_t> order(last.pair.matches.size());
  std::iota(order.begin(), order.end(), 0U);
  const MatchArrays arrays = MakeArrays(last.pair.matches, order, camera_, options_.selector.inlier);
  const std::vector<EssentialMinimum> minima = FindEssentialMinima(
      arrays, is_static, options_.motion.minima, DeriveSeed(seed_, last.frame.index, "minima"));
  MotionRace race;
  *refused = {WaitReason::kNoReconstruction, "the static matches determine no motion"};
  const auto enter = [&](const TwoViewModel& model) {
    Refused own;
    auto candidate = builder_.Build(last, between, is_static, model, race.best ? &own : refused);
    if (candidate) race.Enter(*std::move(candidate));
  };
  for (const EssentialMinimum& minimum : minima) {
    if (minimum.cost > options_.motion.minima_slack * minima.front().cost) break;
    enter(minimum.model);
  }
  const auto enter_new = [&](const Rigid3d& motion) {
    if (race.HasRun(motion)) return;
    enter(ModelOf(motion));
    race.entered.push_back(motion);
  };
  std::ranges::for_each(PlaneMotions(arrays, is_static), enter_new);
  std::ranges::for_each(MotionsToTry(builder_, windows, window, options_.testimony), enter_new);
  if (race.best && race.runner_up) race.best->rival_ratio = race.runner_up->cost / race.best->cost;
  return race;
}

bool IsAlone(const CandidateMap& candidate, const PairMotionOptions& options) {
  return !candidate.HasRivalBelow(options.alone_runner_up_cost);
}

std::optional<CandidateMap> MotionSearch::WinnerOf(const MotionRace& race, Refused* refused) const {
  const PairMotionOptions& asked = options_.motion;
  const std::optional<CandidateMap>& best = race.best;
  if (!best) return std::nullopt;
  if (best->HasRivalBelow(asked.min_runner_up_cost)) {
    *refused = {WaitReason::kNoReconstruction, "two motions explain the views about equally well"};
    return std::nullopt;
  }
  if (best->cost > (IsAlone(*best, asked) ? asked.max_cost_alone : asked.max_cost)) {
    *refused = {WaitReason::kInconsistent, "no motion explains all views well"};
    return std::nullopt;
  }
  return best;
}

}  // namespace dmslam
