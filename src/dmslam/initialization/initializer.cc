#include "dmslam/initialization/initializer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "dmslam/camera/image_scale.h"
#include "dmslam/initialization/map_gates.h"
#include "dmslam/initialization/motion_contest.h"
#include "dmslam/initialization/motion_race.h"
#include "dmslam/initialization/reference_windows.h"
#include "dmslam/motion_segmentation/turn.h"
#include "dmslam/motion_segmentation/two_view_model.h"
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

/// Whether the matches lie so close together that they may be somebody's.
bool IsCompact(std::span<const Match> matches, double distribution_px) {
  std::vector<Eigen::Vector2d> points;
  for (const Match& match : matches) points.push_back(match.uv0_px);
  return Spread(points) < distribution_px;
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

ArsacOptions ArsacOptionsOf(const InitializerOptions& options) {
  ArsacOptions own;
  own.sampling = options.selector.sampling;
  own.input = options.selector.input;
  own.inlier = options.selector.inlier;
  return own;
}

std::unique_ptr<StaticSelector> MakeInitializerSelector(SelectorMethod method,
                                                        const InitializerOptions& options) {
  switch (method) {
    case SelectorMethod::kDlrsac:
      break;
    case SelectorMethod::kArsac:
      return std::make_unique<Arsac>(ArsacOptionsOf(options));
    case SelectorMethod::kRansac:
      return std::make_unique<RansacSelector>(RansacOptionsOf(options));
  }
  return std::make_unique<Dlrsac>(options.selector);
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
  Impl(const InitializerOptions& options, const Camera& camera, uint64_t seed, AdjustFunction adjust,
       SelectorMethod method)
      : options_(options),
        camera_(camera),
        seed_(seed),
        builder_(options, camera, std::move(adjust)),
        motions_(options, camera, seed, builder_),
        gates_(options, builder_),
        selector_(MakeInitializerSelector(method, options)),
        rest_selector_(RestOptions(options)),
        stream_(options) {}

  InitializerReport AddFrame(const InitializerFrame& frame) {
    InitializerReport report = Consider(frame);
    if (report.result) {
      stream_ = Stream(options_);
    } else {
      stream_.last_wait = report;
    }
    return report;
  }

 private:
  InitializerReport Consider(const InitializerFrame& frame);
  bool IsNearlyThere(const InitializerReport& report) const;
  InitializerReport TryWindows(const InitializerFrame& frame);
  ReferenceView MakeView(const ReferenceWindow& window, const InitializerFrame& frame) const;
  std::vector<ReferenceView> MakeViews(const InitializerFrame& frame) const;
  bool ShowsEnough(const ReferenceView& view) const;
  bool AddView(ReferenceView view, ReferenceWindow* window, InitializerReport* report) const;
  InitializerReport TryAgreed(ReferenceWindow* window);
  InitializerReport TryContest(ReferenceWindow* window);
  std::vector<std::vector<uint8_t>> MotionsOf(const InitializerFrame& reference,
                                              const ReferenceView& view) const;
  std::optional<CandidateMap> Reconstruct(ReferenceWindow* window, std::span<const uint8_t> is_static,
                                          Refused* refused) const;
  bool Admit(ReferenceWindow* window, CandidateMap* candidate, Refused* refused) const;
  bool Leads(const InitializerFrame& now, const Contender& winner, ReferenceWindow* window) const;

  /// What is known of the frames since the last map.
  struct Stream {
    explicit Stream(const InitializerOptions& options) : windows(options.references, options.past) {}
    ReferenceWindows windows;
    int only_testified = 0;  ///< frames
    int64_t last_looked_ns = 0;
    std::optional<int64_t> last_contest_ns;
    InitializerReport last_wait;
  };

  InitializerOptions options_;
  Camera camera_;
  uint64_t seed_;
  CandidateBuilder builder_;
  MotionSearch motions_;
  MapGates gates_;
  std::unique_ptr<StaticSelector> selector_;
  RansacSelector rest_selector_;
  Stream stream_;
};

InitializerReport Initializer::Impl::Consider(const InitializerFrame& frame) {
  if (static_cast<int>(frame.features->size()) < options_.min_features) {
    return Wait(WaitReason::kTooFewFeatures,
                std::to_string(frame.features->size()) + " of " + std::to_string(options_.min_features));
  }
  ReferenceWindows& windows = stream_.windows;
  if (stream_.only_testified < options_.past.first) {
    ++stream_.only_testified;
    windows.KeepRecent(frame);
    return Wait(WaitReason::kTooFewFrames, "this one only testifies");
  }
  if (windows.empty()) {
    windows.Begin(frame);
    stream_.last_looked_ns = frame.stamp_ns;
    return Wait(WaitReason::kTooFewFrames, "this is the first");
  }
  if (SecondsFromTo(stream_.last_looked_ns, frame) < options_.frame_step_s &&
      !IsNearlyThere(stream_.last_wait)) {
    return stream_.last_wait;
  }
  stream_.last_looked_ns = frame.stamp_ns;
  windows.DropOld(frame);
  InitializerReport report = TryWindows(frame);
  if (!report.result) windows.BeginIfDue(frame);
  windows.KeepRecent(frame);
  return report;
}

/// The parallax was almost enough, or it was and the direction not known well enough: the next frame may do.
bool Initializer::Impl::IsNearlyThere(const InitializerReport& report) const {
  return report.wait == WaitReason::kParallaxTooSmall &&
         report.parallax_rad >= options_.nearly_parallax_share * options_.geometry.min_parallax_rad;
}

/// What the reference frames make of this one, the oldest first, until one has a map. At most one of them may
/// try a contest with a frame: it is expensive.
InitializerReport Initializer::Impl::TryWindows(const InitializerFrame& frame) {
  InitializerReport report = Wait(WaitReason::kTooFewFrames, "a new reference frame");
  bool may_contend =
      !stream_.last_contest_ns || SecondsFromTo(*stream_.last_contest_ns, frame) >= options_.contest.step_s;
  std::vector<ReferenceView> views = MakeViews(frame);
  auto view = views.begin();
  std::deque<ReferenceWindow>& windows = stream_.windows.all();
  for (auto window = windows.begin(); window != windows.end() && !report.result;) {
    InitializerReport own;
    const bool seen = AddView(std::move(*view++), &*window, &own);
    if (seen && window->views().back().moved) own = TryAgreed(&*window);
    if (seen && may_contend && MayHideSeveralMotions(own.wait)) {
      may_contend = false;
      stream_.last_contest_ns = frame.stamp_ns;
      own = TryContest(&*window);
    }
    report = Farther(std::move(report), std::move(own));
    window = seen ? std::next(window) : stream_.windows.Lose(window, frame);
  }
  return report;
}

ReferenceView Initializer::Impl::MakeView(const ReferenceWindow& window,
                                          const InitializerFrame& frame) const {
  FeatureMatcher matcher;
  const FrameFeatures& features0 = *window.reference().features;
  ReferenceView view;
  view.frame = frame;
  view.since_reference_s = SecondsFromTo(window.reference(), frame);
  const Eigen::Quaterniond R_k_0 = window.TurnAt(view.since_reference_s);
  view.pair.matches = MatchFrames(features0, *frame.features, camera_, options_.matching, &matcher,
                                  Turned(features0.uv_px, camera_, R_k_0));
  // Somebody who has most of the features may lead the turn; then the room is where it was, if anywhere.
  if (IsCompact(view.pair.matches, options_.agreement.min_distribution_share * DiagonalPx(camera_)))
    AddMatchesInPlace(features0, *frame.features, camera_, options_.matching, &matcher, &view.pair.matches);
  // At the rim of a wide lens ideal pixels lie so far out that no selector takes them.
  const InputOptions& input = options_.selector.input;
  std::erase_if(view.pair.matches, [&](const Match& match) {
    return !LiesWithinReach(match.uv0_px, camera_, input) || !LiesWithinReach(match.uv1_px, camera_, input);
  });
  view.R_k_0 = FitTurn(view.pair.matches, camera_, R_k_0);
  view.moved = MedianDisplacement(view.pair.matches) >= options_.min_displacement_rad * FocalPx(camera_);
  return view;
}

/// What each reference frame sees of the frame, and which of it the selector calls static: most of the
/// search's time, and none of it depends on another window.
std::vector<ReferenceView> Initializer::Impl::MakeViews(const InitializerFrame& frame) const {
  const std::deque<ReferenceWindow>& windows = stream_.windows.all();
  std::vector<ReferenceView> views(windows.size());
  ForEachInParallel(views.size(), options_.threads, [&](size_t k) {
    ReferenceView& view = views[k];
    view = MakeView(windows[k], frame);
    if (!view.moved || !ShowsEnough(view)) return;
    const uint64_t frames = (uint64_t{windows[k].reference().index} << 32) | frame.index;
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
  // Frames that are farther apart say more; where the room shows in moments there is no time for that.
  const bool in_moments = stream_.windows.BriefOnesHelp(window->views().back().frame);
  const double step_s = in_moments ? options_.references.brief_pair_step_s : options_.min_pair_step_s;
  const std::vector<const ReferenceView*> views = window->PairsToAgree(options_.num_pairs, step_s);
  if (views.empty()) return Wait(WaitReason::kTooFewFrames, "too few pairs yet");
  std::vector<const PairView*> pairs;
  pairs.reserve(views.size());
  for (const ReferenceView* view : views) pairs.push_back(&view->pair);
  AgreementOptions asked = options_.agreement;
  if (views.back()->since_reference_s < options_.sure_age_s) asked.dominance.reset();
  const Agreement agreement = Agree(pairs, camera_, asked);
  InitializerReport report;
  Refused refused;
  if (!agreement.IsUsable()) {
    report = Wait(FromAgreement(agreement.refusal), agreement.explanation);
  } else if (auto candidate = Reconstruct(window, agreement.is_static, &refused);
             candidate && Admit(window, &*candidate, &refused)) {
    report.wait = WaitReason::kNone;
    report.reason = "first map";
    report.result = builder_.MakeMap(window->reference(), *candidate, agreement.is_static);
    report.parallax_rad = report.result->median_parallax_rad;
  } else {
    report = Wait(refused);
  }
  window->OnTried(report.wait);
  report.num_matches = static_cast<int>(pairs.back()->matches.size());
  return report;
}

/// The map of the motion that wins over all others.
InitializerReport Initializer::Impl::TryContest(ReferenceWindow* window) {
  const ReferenceView& last = window->views().back();
  std::vector<Contender> contenders;
  Refused refused;
  for (const std::vector<uint8_t>& motion : MotionsOf(window->reference(), last)) {
    std::optional<CandidateMap> candidate =
        motions_.WinnerOf(motions_.Run(stream_.windows.all(), *window, motion, &refused), &refused);
    if (!candidate) continue;
    const std::vector<uint8_t> all(last.pair.matches.size(), 1);
    builder_.AddMissing(all, &*candidate);
    if (candidate->NumPoints() < options_.contest.min_support) continue;
    std::vector<uint8_t> support = candidate->use;
    contenders.push_back({std::move(*candidate), std::move(support)});
  }
  ContestResult result = DecideContest(std::move(contenders), options_.contest, DiagonalPx(camera_));
  if (!result.winner) {
    window->OnContestUndecided();
    return Wait(result.refused);
  }
  CandidateMap& candidate = result.winner->candidate;
  window->OnExplained(candidate);
  if (!Leads(last.frame, *result.winner, window)) {
    return Wait(WaitReason::kOnTrial, "the widest motion must win for some more frames");
  }
  if (!Admit(window, &candidate, &refused)) return Wait(refused);
  InitializerReport report;
  report.wait = WaitReason::kNone;
  report.reason = "first map of the widest motion";
  report.result = builder_.MakeMap(window->reference(), candidate, result.winner->support);
  report.parallax_rad = report.result->median_parallax_rad;
  report.num_matches = static_cast<int>(last.pair.matches.size());
  return report;
}

/// Whether the winner has won for long enough, with much the same features.
bool Initializer::Impl::Leads(const InitializerFrame& now, const Contender& winner,
                              ReferenceWindow* window) const {
  std::vector<uint32_t> features;
  const std::vector<Match>& matches = winner.candidate.last().pair.matches;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (winner.support[k]) features.push_back(matches[k].index0);
  }
  const int64_t since_ns =
      window->OnContestWon(now.stamp_ns, std::move(features), options_.contest.min_overlap);
  return SecondsFromTo(since_ns, now) >= options_.contest.lead_s;
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

/// The winner, if it may become a map; what was found is remembered in any case.
std::optional<CandidateMap> Initializer::Impl::Reconstruct(ReferenceWindow* window,
                                                           std::span<const uint8_t> is_static,
                                                           Refused* refused) const {
  const MotionRace race = motions_.Run(stream_.windows.all(), *window, is_static, refused);
  if (!race.best) return std::nullopt;
  const CandidateMap& best = *race.best;
  window->OnExplained(best, race.runner_up);
  if (!best.HasRivalBelow(options_.testimony.min_rival_ratio) &&
      best.cost <= options_.motion.max_cost_alone &&
      builder_.DirectionSigma(best) <= options_.geometry.max_direction_sigma_rad) {
    window->OnClaimed({&best.last(), best.T_last_0()});
  }
  return motions_.WinnerOf(race, refused);
}

bool Initializer::Impl::Admit(ReferenceWindow* window, CandidateMap* candidate, Refused* refused) const {
  const auto match = [&](const InitializerFrame& frame) { return MakeView(*window, frame); };
  return gates_.Admit(stream_.windows.all(), match, window, candidate, refused);
}

namespace {

InitializerOptions ForImages(InitializerOptions options, const Camera& camera) {
  for (Pyramid* pyramid : {&options.selector.inlier.pyramid, &options.reconstruction.pyramid})
    *pyramid = pyramid->OfImages(camera.width_px, camera.height_px);
  return options;
}

}  // namespace

Initializer::Initializer(const InitializerOptions& options, const Camera& camera, uint64_t seed,
                         AdjustFunction adjust, SelectorMethod method)
    : impl_(std::make_unique<Impl>(ForImages(options, camera), camera, seed, std::move(adjust), method)) {}
Initializer::~Initializer() = default;

InitializerReport Initializer::AddFrame(const InitializerFrame& frame) { return impl_->AddFrame(frame); }

}  // namespace dmslam
