#include "dmslam/initialization/initializer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <utility>

#include "dmslam/camera/image_scale.h"
#include "dmslam/geometry/two_view.h"
#include "dmslam/initialization/motion_contest.h"
#include "dmslam/initialization/plane_motions.h"
#include "dmslam/initialization/reference_window.h"
#include "dmslam/initialization/testimony.h"
#include "dmslam/motion_segmentation/turn.h"
#include "dmslam/motion_segmentation/two_view_model.h"
#include "dmslam/util/check.h"
#include "dmslam/util/parallel.h"

namespace dmslam {
namespace {

double MedianDisplacement(std::span<const Match> matches) {
  std::vector<double> squared;
  for (const Match& match : matches) squared.push_back((match.uv1_px - match.uv0_px).squaredNorm());
  const auto middle = squared.begin() + static_cast<ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return squared.empty() ? 0.0 : std::sqrt(*middle);
}

WaitReason FromAgreement(AgreementRefusal refusal) {
  switch (refusal) {
    case AgreementRefusal::kNone:
      return WaitReason::kNone;
    case AgreementRefusal::kSelectionRefused:
      return WaitReason::kSelectionRefused;
    case AgreementRefusal::kTooFewCommon:
      return WaitReason::kTooFewMatches;
    case AgreementRefusal::kDisagreement:
      return WaitReason::kDisagreement;
    case AgreementRefusal::kTooFewStatic:
      return WaitReason::kTooFewStatic;
    case AgreementRefusal::kDistributionTooSmall:
      return WaitReason::kDistributionTooSmall;
  }
  return WaitReason::kNone;
}

double SecondsSince(int64_t stamp_ns, const InitializerFrame& frame) {
  return static_cast<double>(frame.stamp_ns - stamp_ns) * 1e-9;
}

std::string Degrees(double rad) { return std::to_string(rad * 180.0 / M_PI) + " degrees"; }

}  // namespace

std::string_view ToString(WaitReason reason) {
  switch (reason) {
    case WaitReason::kNone:
      return "none";
    case WaitReason::kTooFewFeatures:
      return "too few features";
    case WaitReason::kTooFewFrames:
      return "too few frames";
    case WaitReason::kTooFewMatches:
      return "too few matches";
    case WaitReason::kTooLittleMotion:
      return "too little motion";
    case WaitReason::kSelectionRefused:
      return "selection refused";
    case WaitReason::kDistributionTooSmall:
      return "distribution too small";
    case WaitReason::kDisagreement:
      return "disagreement between pairs";
    case WaitReason::kTooFewStatic:
      return "too few static matches";
    case WaitReason::kParallaxTooSmall:
      return "parallax too small";
    case WaitReason::kNoReconstruction:
      return "no reconstruction";
    case WaitReason::kInconsistent:
      return "views inconsistent";
    case WaitReason::kOnTrial:
      return "on trial";
  }
  return "unknown";
}

namespace {

RansacSelectorOptions RansacOptionsOf(const InitializerOptions& options) {
  RansacSelectorOptions own;
  own.sampling = options.selector.sampling;
  own.input = options.selector.input;
  own.inlier = options.selector.inlier;
  return own;
}

std::unique_ptr<StaticSelector> MakeInitializerSelector(const InitializerOptions& options) {
  if (options.method == "dlrsac") return std::make_unique<Dlrsac>(options.selector);
  if (options.method == "ransac") return std::make_unique<RansacSelector>(RansacOptionsOf(options));
  if (options.method != "arsac") {
    throw InputError("unknown method '" + options.method + "': use dlrsac, arsac or ransac");
  }
  ArsacOptions own;
  own.sampling = options.selector.sampling;
  own.input = options.selector.input;
  own.inlier = options.selector.inlier;
  return std::make_unique<Arsac>(own);
}

/// The other motions are wanted even where their matches lie close together.
RansacSelectorOptions RestOptions(const InitializerOptions& options) {
  RansacSelectorOptions own = RansacOptionsOf(options);
  own.input.min_extent_share = 0;
  own.input.min_displacement_px = 0;
  own.min_static = options.contest.min_support;
  return own;
}

InitializerReport Wait(WaitReason reason, const std::string& text) {
  InitializerReport report;
  report.wait = reason;
  report.reason = std::string(ToString(reason)) + (text.empty() ? "" : ": " + text);
  return report;
}
InitializerReport Wait(const Refused& refused) {
  InitializerReport report = Wait(refused.wait, refused.text);
  report.parallax_rad = refused.parallax_rad;
  return report;
}

/// No single motion could be told from the pairs of a reference frame; there may be more than one.
bool MayHideSeveralMotions(WaitReason wait) {
  return wait == WaitReason::kDisagreement || wait == WaitReason::kTooFewStatic ||
         wait == WaitReason::kSelectionRefused || wait == WaitReason::kDistributionTooSmall;
}

/// Maps under different motions: the one that explains the views best, and the next best.
struct MotionRace {
  std::optional<CandidateMap> best, runner_up;
  std::vector<Rigid3d> entered;  ///< as they came out, and those that were tried besides

  bool HasRun(const Rigid3d& T_last_0) const {
    return std::any_of(entered.begin(), entered.end(),
                       [&](const Rigid3d& other) { return CandidateBuilder::SameMotion(other, T_last_0); });
  }
  void Enter(CandidateMap candidate) {
    entered.push_back(candidate.T_last_0());
    const bool wins = !best || candidate.cost < best->cost;
    if (best && !CandidateBuilder::SameMotion(best->T_last_0(), candidate.T_last_0())) {
      CandidateMap& loser = wins ? *best : candidate;
      if (!runner_up || loser.cost < runner_up->cost) runner_up = std::move(loser);
    }
    if (wins) best = std::move(candidate);
  }
};

TwoViewModel ModelOf(const Rigid3d& T_1_0) {
  return {EssentialFromPose(T_1_0), T_1_0.rotation.toRotationMatrix(), T_1_0.translation};
}

/// That with a map, or of two that wait, that which came farther.
InitializerReport Farther(InitializerReport a, InitializerReport b) {
  const bool farther = a.wait > b.wait || (a.wait == b.wait && a.parallax_rad > b.parallax_rad);
  const bool first = a.result || (!b.result && farther);
  return first ? std::move(a) : std::move(b);
}

}  // namespace

/// The work of one stream of frames.
class Initializer::Impl {
 public:
  Impl(const InitializerOptions& options, const Camera& camera, uint64_t seed, AdjustFunction adjust)
      : options_(options),
        camera_(camera),
        seed_(seed),
        builder_(options, camera, std::move(adjust)),
        selector_(MakeInitializerSelector(options)),
        rest_selector_(RestOptions(options)) {}

  InitializerReport AddFrame(const InitializerFrame& frame) {
    InitializerReport report = Consider(frame);
    if (report.result) {
      windows_.clear();
      recent_.clear();
    } else {
      last_wait_ = report;
    }
    return report;
  }

 private:
  InitializerReport Consider(const InitializerFrame& frame);
  bool IsNearlyThere(const InitializerReport& report) const;
  InitializerReport TryWindows(const InitializerFrame& frame);
  void KeepRecent(const InitializerFrame& frame);
  void DropOld(const InitializerFrame& frame);
  void BeginWindowIfDue(const InitializerFrame& frame);
  bool BriefOnesHelp(const InitializerFrame& frame) const;
  double PairStepAt(const InitializerFrame& frame) const;
  bool MakeRoom();
  void BeginWindow(const InitializerFrame& frame);
  ReferenceView MakeView(const ReferenceWindow& window, const InitializerFrame& frame) const;
  std::vector<ReferenceView> MakeViews(const InitializerFrame& frame) const;
  bool ShowsEnough(const ReferenceView& view) const;
  bool AddView(ReferenceView view, ReferenceWindow* window, InitializerReport* report) const;
  InitializerReport TryAgreed(ReferenceWindow* window);
  InitializerReport TryContest(ReferenceWindow* window);
  std::vector<std::vector<uint8_t>> MotionsOf(const InitializerFrame& reference,
                                              const ReferenceView& view) const;
  MotionRace RunRace(const ReferenceWindow& window, std::span<const uint8_t> is_static,
                     Refused* refused) const;
  std::optional<CandidateMap> WinnerOf(const MotionRace& race, Refused* refused) const;
  std::optional<CandidateMap> Reconstruct(ReferenceWindow* window, std::span<const uint8_t> is_static,
                                          Refused* refused) const;
  bool IsAlone(const CandidateMap& candidate) const;
  bool Passes(const CandidateMap& candidate, const ReferenceWindow& window, Refused* refused) const;
  bool HasParallax(const CandidateMap& candidate, const ReferenceWindow& window, Refused* refused) const;
  bool AgreesWithPast(ReferenceWindow* window, CandidateMap* candidate, Refused* refused);
  bool Finish(ReferenceWindow* window, CandidateMap* candidate, Refused* refused);
  bool IsBelieved(const CandidateMap& candidate, ReferenceWindow* window, Refused* refused) const;
  bool IsSure(const CandidateMap& candidate, const ReferenceWindow& window) const;
  bool FoundAgain(const CandidateMap& candidate, ReferenceWindow* window) const;
  bool Leads(const InitializerFrame& now, const Contender& winner, ReferenceWindow* window) const;

  InitializerOptions options_;
  Camera camera_;
  uint64_t seed_;
  CandidateBuilder builder_;
  std::unique_ptr<StaticSelector> selector_;
  RansacSelector rest_selector_;
  std::deque<ReferenceWindow> windows_;  ///< the oldest first
  std::deque<InitializerFrame> recent_;  ///< what the next reference frame's past will be
  int only_testified_ = 0;
  int64_t last_looked_ns_ = 0;
  int64_t last_contest_ns_ = 0;
  std::optional<int64_t> lost_soon_ns_;  ///< when a reference frame was lost sight of soon, the last time
  InitializerReport last_wait_;
};

InitializerReport Initializer::Impl::Consider(const InitializerFrame& frame) {
  if (static_cast<int>(frame.features->size()) < options_.min_features) {
    return Wait(WaitReason::kTooFewFeatures,
                std::to_string(frame.features->size()) + " of " + std::to_string(options_.min_features));
  }
  if (only_testified_ < options_.past.first) {
    ++only_testified_;
    KeepRecent(frame);
    return Wait(WaitReason::kTooFewFrames, "this one only testifies");
  }
  if (windows_.empty()) {
    BeginWindow(frame);
    return Wait(WaitReason::kTooFewFrames, "this is the first");
  }
  if (SecondsSince(last_looked_ns_, frame) < options_.frame_step_s && !IsNearlyThere(last_wait_))
    return last_wait_;
  last_looked_ns_ = frame.stamp_ns;
  DropOld(frame);
  InitializerReport report = TryWindows(frame);
  if (!report.result) BeginWindowIfDue(frame);
  KeepRecent(frame);
  return report;
}

/// The parallax was almost enough, or it was and the direction not known well enough: the next frame may do.
bool Initializer::Impl::IsNearlyThere(const InitializerReport& report) const {
  return report.wait == WaitReason::kParallaxTooSmall &&
         report.parallax_rad >= options_.nearly_parallax_share * options_.geometry.min_parallax_rad;
}

/// What the reference frames make of this one, the oldest first, until one has a map. At most one of them may
/// try a contest with a frame: it is dear.
InitializerReport Initializer::Impl::TryWindows(const InitializerFrame& frame) {
  InitializerReport report = Wait(WaitReason::kTooFewFrames, "a new reference frame");
  bool may_contend =
      options_.contest.enabled && SecondsSince(last_contest_ns_, frame) >= options_.contest.step_s;
  std::vector<ReferenceView> views = MakeViews(frame);
  auto view = views.begin();
  for (auto window = windows_.begin(); window != windows_.end() && !report.result;) {
    InitializerReport own;
    const bool seen = AddView(std::move(*view++), &*window, &own);
    if (seen && window->views().back().moved) own = TryAgreed(&*window);
    if (seen && may_contend && MayHideSeveralMotions(own.wait)) {
      may_contend = false;
      last_contest_ns_ = frame.stamp_ns;
      own = TryContest(&*window);
    }
    if (!seen && window->AgeAt(frame) <= options_.references.max_brief_age_s) lost_soon_ns_ = frame.stamp_ns;
    report = Farther(std::move(report), std::move(own));
    window = seen ? std::next(window) : windows_.erase(window);
  }
  return report;
}

void Initializer::Impl::KeepRecent(const InitializerFrame& frame) {
  recent_.push_back(frame);
  while (SecondsBetween(recent_.front(), frame) > options_.past.seconds) recent_.pop_front();
}

void Initializer::Impl::DropOld(const InitializerFrame& frame) {
  std::erase_if(windows_, [&](const ReferenceWindow& window) {
    const ReferenceOptions& most = options_.references;
    if (window.brief) return window.AgeAt(frame) > most.max_brief_age_s;
    return window.AgeAt(frame) > (window.promising ? most.max_promising_age_s : most.max_age_s);
  });
}

/// Between the reference frames that are kept there are brief ones, where reference frames last no longer.
void Initializer::Impl::BeginWindowIfDue(const InitializerFrame& frame) {
  const auto age = [&](const auto& last) { return last == windows_.rend() ? 1e9 : last->AgeAt(frame); };
  const auto newest = windows_.rbegin();
  const auto newest_kept =
      std::find_if(newest, windows_.rend(), [](const ReferenceWindow& window) { return !window.brief; });
  if (age(newest_kept) >= options_.references.step_s && MakeRoom()) {
    BeginWindow(frame);
  } else if (BriefOnesHelp(frame) && age(newest) >= options_.references.brief_step_s) {
    BeginWindow(frame);
    windows_.back().brief = true;
  }
}

/// What a reference frame showed was lost sight of soon, a moment ago. Elsewhere they would cost time and
/// find nothing that the others do not find.
bool Initializer::Impl::BriefOnesHelp(const InitializerFrame& frame) const {
  return lost_soon_ns_ && SecondsSince(*lost_soon_ns_, frame) <= options_.references.max_age_s;
}

/// Frames that are farther apart say more; where the room shows in moments there is no time for that.
double Initializer::Impl::PairStepAt(const InitializerFrame& frame) const {
  return BriefOnesHelp(frame) ? options_.references.brief_pair_step_s : options_.min_pair_step_s;
}

/// False where there is none. The oldest window that is neither promising nor leads a contest goes.
bool Initializer::Impl::MakeRoom() {
  const auto kept = [](const ReferenceWindow& window) { return !window.brief; };
  while (std::count_if(windows_.begin(), windows_.end(), kept) >= options_.references.most) {
    const auto idle = std::find_if(windows_.begin(), windows_.end(), [&](const ReferenceWindow& window) {
      return kept(window) && !window.promising && !window.lead;
    });
    if (idle == windows_.end()) return false;
    windows_.erase(idle);
  }
  return true;
}

void Initializer::Impl::BeginWindow(const InitializerFrame& frame) {
  std::vector<InitializerFrame> before, past;
  for (const InitializerFrame& each : recent_) {
    if (SecondsBetween(each, frame) <= options_.past.seconds && each.index != frame.index)
      before.push_back(each);
  }
  const size_t asked = std::min(before.size(), static_cast<size_t>(std::max(0, options_.past.views)));
  for (size_t k = 0; k < asked; ++k) past.push_back(before[k * before.size() / asked]);
  windows_.emplace_back(frame, std::move(past));
  last_looked_ns_ = frame.stamp_ns;
}

ReferenceView Initializer::Impl::MakeView(const ReferenceWindow& window,
                                          const InitializerFrame& frame) const {
  FeatureMatcher matcher;
  const FrameFeatures& features0 = *window.reference().features;
  ReferenceView view;
  view.frame = frame;
  view.since_reference_s = SecondsBetween(window.reference(), frame);
  const Eigen::Quaterniond R_k_0 = window.TurnAt(view.since_reference_s);
  view.pair.matches = MatchFrames(features0, *frame.features, camera_, options_.matching, &matcher,
                                  Turned(features0.uv_px, camera_, R_k_0));
  view.R_k_0 = FitTurn(view.pair.matches, camera_, R_k_0);
  view.moved = MedianDisplacement(view.pair.matches) >= options_.min_displacement_rad * FocalPx(camera_);
  return view;
}

/// What each reference frame sees of the frame, and which of it the selector calls static: most of the
/// search's time, and none of it depends on another window.
std::vector<ReferenceView> Initializer::Impl::MakeViews(const InitializerFrame& frame) const {
  std::vector<ReferenceView> views(windows_.size());
  ForEachInParallel(views.size(), options_.threads, [&](size_t k) {
    ReferenceView& view = views[k];
    view = MakeView(windows_[k], frame);
    if (!view.moved || !ShowsEnough(view)) return;
    const uint64_t frames = (uint64_t{windows_[k].reference().index} << 32) | frame.index;
    view.pair.selection =
        selector_->Select(view.pair.matches, camera_, DeriveSeed(seed_, frames, "initializer"));
  });
  return views;
}

bool Initializer::Impl::ShowsEnough(const ReferenceView& view) const {
  return static_cast<int>(view.pair.matches.size()) >= options_.min_matches;
}

/// False: the frame shows too little of what the reference frame showed.
bool Initializer::Impl::AddView(ReferenceView view, ReferenceWindow* window,
                                InitializerReport* report) const {
  if (!ShowsEnough(view)) {
    *report = Wait(WaitReason::kTooFewMatches,
                   std::to_string(view.pair.matches.size()) + " with the reference frame");
    return false;
  }
  *report = Wait(WaitReason::kTooLittleMotion, "");
  window->AddView(std::move(view));
  return true;
}

/// The map of what several pairs call static.
InitializerReport Initializer::Impl::TryAgreed(ReferenceWindow* window) {
  const double step_s = PairStepAt(window->views().back().frame);
  const std::vector<const ReferenceView*> views = window->PairsToAgree(options_.num_pairs, step_s);
  if (views.empty()) return Wait(WaitReason::kTooFewFrames, "too few pairs yet");
  std::vector<const PairView*> pairs;
  for (const ReferenceView* view : views) pairs.push_back(&view->pair);
  AgreementOptions asked = options_.agreement;
  if (views.back()->since_reference_s < options_.sure_age_s) asked.dominance.reset();
  const Agreement agreement = Agree(pairs, camera_, asked);
  InitializerReport report;
  Refused refused;
  if (!agreement.IsUsable()) {
    report = Wait(FromAgreement(agreement.refusal), agreement.explanation);
  } else if (auto candidate = Reconstruct(window, agreement.is_static, &refused);
             candidate && Finish(window, &*candidate, &refused)) {
    report.wait = WaitReason::kNone;
    report.reason = "first map";
    report.result = builder_.MakeMap(window->reference(), *candidate, agreement.is_static);
    report.parallax_rad = report.result->median_parallax_rad;
  } else {
    report = Wait(refused);
  }
  if (report.wait == WaitReason::kNoReconstruction) {
    window->found.reset();
    window->doubtful = true;
  }
  window->promising = report.wait == WaitReason::kParallaxTooSmall ||
                      report.wait == WaitReason::kNoReconstruction || report.wait == WaitReason::kOnTrial;
  report.num_matches = static_cast<int>(pairs.back()->matches.size());
  report.num_static = agreement.num_static;
  report.distribution_px = agreement.distribution_px;
  report.agreement = agreement.agreement;
  return report;
}

/// The map of the motion that wins over all others.
InitializerReport Initializer::Impl::TryContest(ReferenceWindow* window) {
  const ReferenceView& last = window->views().back();
  std::vector<Contender> contenders;
  Refused refused;
  for (const std::vector<uint8_t>& motion : MotionsOf(window->reference(), last)) {
    std::optional<CandidateMap> candidate = WinnerOf(RunRace(*window, motion, &refused), &refused);
    if (!candidate) continue;
    const std::vector<uint8_t> all(last.pair.matches.size(), 1);
    builder_.AddMissing(all, &*candidate);
    if (candidate->NumPoints() < options_.contest.min_support) continue;
    std::vector<uint8_t> support = candidate->use;
    contenders.push_back({std::move(*candidate), std::move(support)});
  }
  ContestResult result = DecideContest(std::move(contenders), options_.contest, DiagonalPx(camera_));
  if (!result.winner) {
    window->lead.reset();
    return Wait(result.refused);
  }
  CandidateMap& candidate = result.winner->candidate;
  window->hypotheses = {candidate};
  if (!Leads(last.frame, *result.winner, window)) {
    return Wait(WaitReason::kOnTrial, "the widest motion must win for some more frames");
  }
  if (!Finish(window, &candidate, &refused)) return Wait(refused);
  InitializerReport report;
  report.wait = WaitReason::kNone;
  report.reason = "first map of the widest motion";
  report.result = builder_.MakeMap(window->reference(), candidate, result.winner->support);
  report.parallax_rad = report.result->median_parallax_rad;
  report.num_matches = static_cast<int>(last.pair.matches.size());
  report.num_static = candidate.NumPoints();
  return report;
}

/// Whether the winner has won for long enough, with much the same features.
bool Initializer::Impl::Leads(const InitializerFrame& now, const Contender& winner,
                              ReferenceWindow* window) const {
  std::vector<uint32_t> features, common;
  const std::vector<Match>& matches = winner.candidate.last().pair.matches;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (winner.support[k]) features.push_back(matches[k].index0);
  }
  const bool led = window->lead.has_value();
  const std::vector<uint32_t> before = led ? window->lead->features : std::vector<uint32_t>();
  std::set_intersection(before.begin(), before.end(), features.begin(), features.end(),
                        std::back_inserter(common));
  const double smaller = static_cast<double>(std::min(before.size(), features.size()));
  const bool same = led && static_cast<double>(common.size()) >= options_.contest.min_overlap * smaller;
  const int64_t since_ns = same ? window->lead->since_ns : now.stamp_ns;
  window->lead = ReferenceWindow::Lead{since_ns, std::move(features)};
  return SecondsSince(since_ns, now) >= options_.contest.lead_s;
}

/// Sets of matches that may move together: the selector's, and what RANSAC finds in the rest, again and
/// again.
std::vector<std::vector<uint8_t>> Initializer::Impl::MotionsOf(const InitializerFrame& reference,
                                                               const ReferenceView& view) const {
  const std::vector<Match>& matches = view.pair.matches;
  std::vector<std::vector<uint8_t>> motions;
  std::vector<uint8_t> taken(matches.size(), 0);
  if (view.pair.selection.IsUsable()) {
    taken = view.pair.selection.is_static;
    motions.push_back(taken);
  }
  while (static_cast<int>(motions.size()) < options_.contest.max_motions) {
    std::vector<Match> rest;
    std::vector<size_t> index;
    for (size_t k = 0; k < matches.size(); ++k) {
      if (taken[k]) continue;
      rest.push_back(matches[k]);
      index.push_back(k);
    }
    const uint64_t frames = (uint64_t{reference.index} << 32) | view.frame.index;
    const StaticSelection found =
        rest_selector_.Select(rest, camera_, DeriveSeed(seed_, frames + motions.size(), "contest"));
    if (!found.IsUsable()) break;
    std::vector<uint8_t> motion(matches.size(), 0);
    for (size_t i = 0; i < rest.size(); ++i) {
      if (found.is_static[i]) motion[index[i]] = taken[index[i]] = 1;
    }
    motions.push_back(std::move(motion));
  }
  return motions;
}

/// Every minimum of the pair's epipolar cost that is about as low as the lowest is carried through all views,
/// and so is what this and older reference frames found before; what the views say decides.
MotionRace Initializer::Impl::RunRace(const ReferenceWindow& window, std::span<const uint8_t> is_static,
                                      Refused* refused) const {
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
  std::ranges::for_each(MotionsToTry(builder_, windows_, window, options_.testimony), enter_new);
  if (race.best && race.runner_up) race.best->rival_ratio = race.runner_up->cost / race.best->cost;
  return race;
}

bool Initializer::Impl::IsAlone(const CandidateMap& candidate) const {
  return candidate.rival_ratio >= options_.motion.alone_runner_up_cost;
}

/// Two different motions that explain the views about equally well: none.
std::optional<CandidateMap> Initializer::Impl::WinnerOf(const MotionRace& race, Refused* refused) const {
  const std::optional<CandidateMap>& best = race.best;
  if (!best) return std::nullopt;
  if (best->rival_ratio < options_.motion.min_runner_up_cost) {
    *refused = {WaitReason::kNoReconstruction, "two motions explain the views about equally well"};
    return std::nullopt;
  }
  if (best->cost > (IsAlone(*best) ? options_.motion.max_cost_alone : options_.motion.max_cost)) {
    *refused = {WaitReason::kInconsistent, "no motion explains all views well"};
    return std::nullopt;
  }
  return best;
}

/// The winner, if it may become a map; what was found is remembered in any case.
std::optional<CandidateMap> Initializer::Impl::Reconstruct(ReferenceWindow* window,
                                                           std::span<const uint8_t> is_static,
                                                           Refused* refused) const {
  const MotionRace race = RunRace(*window, is_static, refused);
  if (!race.best) return std::nullopt;
  const CandidateMap& best = *race.best;
  window->hypotheses = {best};
  if (race.runner_up) window->hypotheses.push_back(*race.runner_up);
  if (best.rival_ratio >= options_.testimony.min_rival_ratio && best.cost <= options_.motion.max_cost_alone &&
      builder_.DirectionSigma(best) <= options_.geometry.max_direction_sigma_rad) {
    window->claims.push_back({&best.last(), best.T_last_0()});
  }
  return WinnerOf(race, refused);
}

bool Initializer::Impl::Passes(const CandidateMap& candidate, const ReferenceWindow& window,
                               Refused* refused) const {
  const int points = candidate.NumPoints();
  if (points < options_.geometry.min_points) {
    *refused = {WaitReason::kTooFewStatic, std::to_string(points) + " points are seen consistently"};
    return false;
  }
  return HasParallax(candidate, window, refused);
}

/// Less of it is asked where waiting brings no more.
bool Initializer::Impl::HasParallax(const CandidateMap& candidate, const ReferenceWindow& window,
                                    Refused* refused) const {
  const GeometryOptions& asked = options_.geometry;
  const double parallax = builder_.Parallax(candidate), sigma = builder_.DirectionSigma(candidate);
  if (parallax >= asked.min_parallax_rad && sigma <= asked.max_direction_sigma_rad) return true;
  const auto left = static_cast<double>(candidate.last().pair.matches.size());
  const auto shown = static_cast<double>(window.views().front().pair.matches.size());
  if (left <= asked.losing_share * shown && parallax >= asked.losing_parallax_rad &&
      sigma <= asked.clear_direction_sigma_rad) {
    return true;
  }
  *refused = {WaitReason::kParallaxTooSmall,
              "median " + Degrees(parallax) + ", direction known to " + Degrees(sigma), parallax};
  return false;
}

/// The last adjustment, with all points, and the gates.
bool Initializer::Impl::Finish(ReferenceWindow* window, CandidateMap* candidate, Refused* refused) {
  if (!Passes(*candidate, *window, refused)) return false;
  if (!builder_.Adjust(candidate)) {
    *refused = {WaitReason::kInconsistent, "the adjustment failed"};
    return false;
  }
  builder_.KeepConsistent(candidate);
  if (!AgreesWithPast(window, candidate, refused) || !Passes(*candidate, *window, refused)) return false;
  return IsBelieved(*candidate, window, refused);
}

/// Other reference frames decide. Where none has a say, the motion must be a clear one, or be found again.
bool Initializer::Impl::IsBelieved(const CandidateMap& candidate, ReferenceWindow* window,
                                   Refused* refused) const {
  const bool again = FoundAgain(candidate, window);
  switch (Hear(builder_, windows_, *window, candidate, options_.testimony)) {
    case Verdict::kConfirmed:
      return true;
    case Verdict::kContradicted:
      *refused = {WaitReason::kInconsistent, "other reference frames say another motion"};
      return false;
    case Verdict::kUnheard:
      break;
  }
  if (IsSure(candidate, *window) || (again && IsAlone(candidate))) return true;
  *refused = {WaitReason::kOnTrial, "another view or reference frame must find the same motion"};
  return false;
}

/// True unless motions were hard to tell apart before, the views are near each other in time, or another
/// motion explains them nearly as well and the direction is hardly known.
bool Initializer::Impl::IsSure(const CandidateMap& candidate, const ReferenceWindow& window) const {
  const bool clear =
      IsAlone(candidate) || builder_.DirectionSigma(candidate) <= options_.geometry.clear_direction_sigma_rad;
  return !window.doubtful && clear && candidate.last().since_reference_s >= options_.sure_age_s;
}

/// Whether the map found last says the same of the camera's motion. What holds for one view by chance seldom
/// holds for the next.
bool Initializer::Impl::FoundAgain(const CandidateMap& candidate, ReferenceWindow* window) const {
  const auto before = window->found;
  window->found = ReferenceWindow::Found{&candidate.last(), candidate.T_last_0()};
  if (!before) return false;
  CandidateMap longer = candidate;
  builder_.PlaceView(*before->view, &longer);
  const CandidateMap::Placed& placed = longer.placed.back();
  return placed.view == before->view && CandidateBuilder::SameMotion(placed.T_k_0, before->T_view_0);
}

/// Drops points that frames just before the reference frame see elsewhere. If there are many, somebody has
/// just stopped, and what is his cannot be told from the rest: what these frames do not show is not dropped.
bool Initializer::Impl::AgreesWithPast(ReferenceWindow* window, CandidateMap* candidate, Refused* refused) {
  CandidateMap longer = *candidate;
  const auto match = [&](const InitializerFrame& frame) { return MakeView(*window, frame); };
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

Initializer::Initializer(const InitializerOptions& options, const Camera& camera, uint64_t seed,
                         AdjustFunction adjust)
    : impl_(std::make_unique<Impl>(options, camera, seed, std::move(adjust))) {}
Initializer::~Initializer() = default;

InitializerReport Initializer::AddFrame(const InitializerFrame& frame) { return impl_->AddFrame(frame); }

}  // namespace dmslam
