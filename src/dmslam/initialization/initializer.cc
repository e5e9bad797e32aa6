#include "dmslam/initialization/initializer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <utility>

#include "dmslam/geometry/absolute_pose.h"
#include "dmslam/geometry/triangulation.h"
#include "dmslam/motion_segmentation/two_view_model.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

double MedianDisplacement(std::span<const Match> matches) {
  std::vector<double> squared;
  for (const Match& match : matches) squared.push_back((match.uv1_px - match.uv0_px).squaredNorm());
  const auto middle = squared.begin() + static_cast<ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return squared.empty() ? 0.0 : std::sqrt(*middle);
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
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
  }
  return "unknown";
}

namespace {

std::unique_ptr<StaticSelector> MakeInitializerSelector(const InitializerOptions& options) {
  const auto share = [&](auto own) {
    own.sampling = options.selector.sampling;
    own.input = options.selector.input;
    own.inlier = options.selector.inlier;
    return own;
  };
  if (options.method == "dlrsac") return std::make_unique<Dlrsac>(options.selector);
  if (options.method == "arsac") return std::make_unique<Arsac>(share(ArsacOptions()));
  if (options.method == "ransac") return std::make_unique<RansacSelector>(share(RansacSelectorOptions()));
  throw InputError("unknown method '" + options.method + "': use dlrsac, arsac or ransac");
}

}  // namespace

/// The work of one stream of frames.
class Initializer::Impl {
 public:
  Impl(const InitializerOptions& options, const Camera& camera, uint64_t seed, AdjustFunction adjust)
      : options_(options),
        camera_(camera),
        seed_(seed),
        adjust_(std::move(adjust)),
        selector_(MakeInitializerSelector(options)) {}

  InitializerReport AddFrame(const InitializerFrame& frame) {
    InitializerReport report = Consider(frame);
    if (report.result) {
      StartOver();
    } else {
      last_wait_ = report;
    }
    return report;
  }

 private:
  /// A frame with its matches to the reference frame.
  struct View {
    InitializerFrame frame;
    PairView pair;
    bool moved = false;  ///< far enough for the selector to be asked
  };
  /// A view's place in the map to be.
  struct Placed {
    const View* view = nullptr;
    Rigid3d T_k_0;
    double consistent_share = 1;
  };
  struct Candidate {
    std::vector<Eigen::Vector3d> points;  ///< parallel to the last view's matches
    std::vector<uint8_t> use;             ///< points that stand
    std::vector<Placed> placed;           ///< the last view first
    double cost = 1;                      ///< mean truncated squared error over all views
  };

  /// Calls visit(k, match) for every feature of the pair's `matches` that the view matched too.
  template <typename Visit>
  static void ForEachSeen(const Placed& placed, std::span<const Match> matches, Visit visit) {
    const auto& seen = placed.view->pair.matches;
    for (size_t k = 0, i = 0; k < matches.size(); ++k) {
      while (i < seen.size() && seen[i].index0 < matches[k].index0) ++i;
      if (i == seen.size()) break;
      if (seen[i].index0 == matches[k].index0) visit(k, seen[i]);
    }
  }

  void StartOver() {
    reference_.reset();
    promising_ = false;
    views_.clear();
    pending_.clear();
    past_.clear();
  }
  InitializerReport Wait(WaitReason reason, std::string text) const {
    InitializerReport report;
    report.wait = reason;
    report.reason = std::string(ToString(reason)) + (text.empty() ? "" : ": " + text);
    return report;
  }

  InitializerReport Consider(const InitializerFrame& frame);
  void TakeNewerReference(const InitializerFrame& frame);
  int64_t OldestPast() const { return reference_->stamp_ns - static_cast<int64_t>(options_.past_s * 1e9); }
  std::vector<const InitializerFrame*> ChoosePast() const;
  bool AgreesWithPast(Candidate* candidate, InitializerReport* report);
  View MakeView(const InitializerFrame& frame);
  std::vector<const View*> ChooseViews() const;
  std::vector<const View*> ViewsBetween(const View& last) const;
  InitializerReport TryMap();
  std::optional<Candidate> Reconstruct(const View& last, const Agreement& agreement,
                                       InitializerReport* report);
  std::optional<Candidate> BuildCandidate(const View& last, const Agreement& agreement,
                                          const TwoViewModel& model, InitializerReport* report) const;
  bool SameMotion(const Candidate& a, const Candidate& b) const;
  bool Passes(const Candidate& candidate, InitializerReport* report) const;
  double CandidateCost(const Candidate& candidate, std::span<const uint8_t> is_static) const;
  void PlaceView(const View& view, double fraction, Candidate* candidate) const;
  void KeepConsistent(Candidate* candidate) const;
  static void KeepEvery(int most, Candidate* candidate);
  void AddMissing(std::span<const uint8_t> is_static, Candidate* candidate) const;
  bool AdjustAll(Candidate* candidate) const;
  double CandidateDirectionSigma(const Candidate& candidate) const;
  double CandidateParallax(const Candidate& candidate) const;
  FirstMap MakeMap(const Candidate& candidate, const Agreement& agreement) const;
  bool Sees(const Rigid3d& T_k_0, const Eigen::Vector3d& point, const Match& match) const;

  InitializerOptions options_;
  Camera camera_;
  uint64_t seed_;
  AdjustFunction adjust_;
  std::unique_ptr<StaticSelector> selector_;
  FeatureMatcher matcher_;
  std::optional<InitializerFrame> reference_;
  std::deque<View> views_;  ///< in order of index
  std::deque<InitializerFrame>
      pending_;                        ///< frames older than the newest, not matched with the reference yet
  std::deque<InitializerFrame> past_;  ///< some of the frames before the reference frame
  bool promising_ = false;  ///< the pairs agreed the last time; only their parallax did not suffice
  uint32_t last_looked_ = 0;
  InitializerReport last_wait_;
};

InitializerReport Initializer::Impl::Consider(const InitializerFrame& frame) {
  if (static_cast<int>(frame.features->size()) < options_.min_features) {
    return Wait(WaitReason::kTooFewFeatures,
                std::to_string(frame.features->size()) + " of " + std::to_string(options_.min_features));
  }
  if (!reference_ && static_cast<int>(past_.size()) < options_.past_first) {
    past_.push_back(frame);
    return Wait(WaitReason::kTooFewFrames, "this one only testifies");
  }
  if (!reference_) {
    reference_ = frame;
    last_looked_ = frame.index;
    return Wait(WaitReason::kTooFewFrames, "this is the first");
  }
  if (frame.index - last_looked_ < static_cast<uint32_t>(options_.frame_step)) {
    // A frame between: time for what was left over.
    if (!pending_.empty()) {
      View view = MakeView(pending_.back());
      pending_.pop_back();
      const auto place = std::find_if(views_.begin(), views_.end(), [&](const View& other) {
        return other.frame.index > view.frame.index;
      });
      views_.insert(place, std::move(view));
    }
    return last_wait_;
  }
  last_looked_ = frame.index;
  const double age_s = static_cast<double>(frame.stamp_ns - reference_->stamp_ns) * 1e-9;
  if (age_s > (promising_ ? options_.max_promising_age_s : options_.max_age_s)) TakeNewerReference(frame);
  if (reference_->index == frame.index) return Wait(WaitReason::kTooFewFrames, "a new reference frame");
  View view = MakeView(frame);
  if (static_cast<int>(view.pair.matches.size()) < options_.min_matches) {
    const std::string found = std::to_string(view.pair.matches.size()) + " with the reference frame";
    TakeNewerReference(frame);
    return Wait(WaitReason::kTooFewMatches, found);
  }
  const bool moved = view.moved;
  views_.push_back(std::move(view));
  if (!moved) return Wait(WaitReason::kTooLittleMotion, "");
  InitializerReport report = TryMap();
  promising_ = report.wait == WaitReason::kParallaxTooSmall || report.wait == WaitReason::kNoReconstruction;
  return report;
}

/// The frame in the middle of the window becomes the reference; those after it are matched again, one by one.
void Initializer::Impl::TakeNewerReference(const InitializerFrame& frame) {
  std::deque<View> old = std::exchange(views_, {});
  pending_.clear();
  promising_ = false;
  past_.push_back(*reference_);
  const size_t middle = old.size() / 2;
  for (size_t k = 0; k < middle; ++k) past_.push_back(old[k].frame);
  reference_ = old.empty() ? frame : old[middle].frame;
  while (!past_.empty() && past_.front().stamp_ns < OldestPast()) past_.pop_front();
  for (size_t k = middle + 1; k < old.size(); ++k) pending_.push_back(old[k].frame);
}

Initializer::Impl::View Initializer::Impl::MakeView(const InitializerFrame& frame) {
  View view;
  view.frame = frame;
  view.pair.matches = MatchFrames(*reference_->features, *frame.features, options_.matching, &matcher_);
  view.moved = MedianDisplacement(view.pair.matches) >= options_.min_displacement_px;
  if (view.moved) {
    const uint64_t seed = DeriveSeed(seed_, (uint64_t{reference_->index} << 32) | frame.index, "initializer");
    view.pair.selection = selector_->Select(view.pair.matches, camera_, seed);
  }
  return view;
}

/// The newest view last, and as many before it as there must be, spread evenly over those that moved.
std::vector<const Initializer::Impl::View*> Initializer::Impl::ChooseViews() const {
  std::vector<const View*> moved;
  for (const View& view : views_) {
    if (view.moved) moved.push_back(&view);
  }
  const auto asked = static_cast<size_t>(options_.num_pairs);
  std::vector<const View*> chosen;
  if (asked < 1 || moved.size() < asked) return chosen;
  const uint32_t span = moved.back()->frame.index - moved.front()->frame.index;
  if (span < static_cast<uint32_t>(options_.min_pair_step) * (asked - 1)) return chosen;
  if (asked == 1) return {moved.back()};
  for (size_t k = 0; k < asked; ++k) chosen.push_back(moved[k * (moved.size() - 1) / (asked - 1)]);
  return chosen;
}

/// An even choice of the frames before the reference frame, the oldest among them.
std::vector<const InitializerFrame*> Initializer::Impl::ChoosePast() const {
  std::vector<const InitializerFrame*> all, chosen;
  for (const InitializerFrame& frame : past_) {
    if (frame.stamp_ns >= OldestPast()) all.push_back(&frame);
  }
  const size_t asked = std::min(all.size(), static_cast<size_t>(std::max(0, options_.past_views)));
  for (size_t k = 0; k < asked; ++k) chosen.push_back(all[k * all.size() / asked]);
  return chosen;
}

/// The views that a map is made of besides `last`: of more than there may be an even choice.
std::vector<const Initializer::Impl::View*> Initializer::Impl::ViewsBetween(const View& last) const {
  std::vector<const View*> all;
  for (const View& view : views_) {
    if (&view != &last && !view.pair.matches.empty()) all.push_back(&view);
  }
  const auto most = static_cast<size_t>(std::max(0, options_.max_views - 1));
  if (all.size() <= most) return all;
  std::vector<const View*> chosen;
  for (size_t k = 0; k < most; ++k) chosen.push_back(all[k * all.size() / most]);
  return chosen;
}

InitializerReport Initializer::Impl::TryMap() {
  const std::vector<const View*> views = ChooseViews();
  if (views.empty()) return Wait(WaitReason::kTooFewFrames, "too few pairs yet");
  std::vector<const PairView*> pairs;
  for (const View* view : views) pairs.push_back(&view->pair);
  const Agreement agreement = Agree(pairs, options_.agreement);
  InitializerReport report;
  if (!agreement.IsUsable()) {
    report = Wait(FromAgreement(agreement.refusal), agreement.explanation);
  } else if (const auto candidate = Reconstruct(*views.back(), agreement, &report)) {
    report.wait = WaitReason::kNone;
    report.reason = "first map";
    report.result = MakeMap(*candidate, agreement);
    report.parallax_rad = report.result->median_parallax_rad;
  }
  report.num_matches = static_cast<int>(pairs.back()->matches.size());
  report.num_static = agreement.num_static;
  report.distribution_px = agreement.distribution_px;
  report.agreement = agreement.agreement;
  return report;
}

bool Initializer::Impl::Sees(const Rigid3d& T_k_0, const Eigen::Vector3d& point, const Match& match) const {
  const double variance = options_.selector.inlier.pyramid.SigmaSquared(match.octave1);
  return ReprojectionErrorSquared(camera_.Ideal(), T_k_0, point, match.uv1_px) <=
         options_.max_view_chi2 * variance;
}

/// Every minimum of the pair's epipolar cost that is about as low as the lowest is carried through all views;
/// what they say decides. Two different motions that explain them about equally well: wait.
std::optional<Initializer::Impl::Candidate> Initializer::Impl::Reconstruct(const View& last,
                                                                           const Agreement& agreement,
                                                                           InitializerReport* report) {
  std::vector<uint32_t> order(last.pair.matches.size());
  std::iota(order.begin(), order.end(), 0U);
  const MatchArrays arrays = MakeArrays(last.pair.matches, order, camera_, options_.selector.inlier);
  const std::vector<EssentialMinimum> minima = FindEssentialMinima(
      arrays, agreement.is_static, options_.minima, DeriveSeed(seed_, last.frame.index, "minima"));
  std::optional<Candidate> best;
  double runner_up = 1e9;
  *report = Wait(WaitReason::kNoReconstruction, "the static matches determine no motion");
  for (const EssentialMinimum& minimum : minima) {
    if (minimum.cost > options_.minima_slack * minima.front().cost) break;
    std::optional<Candidate> candidate =
        BuildCandidate(last, agreement, minimum.model, best ? nullptr : report);
    if (!candidate) continue;
    if (best && SameMotion(*best, *candidate)) {
      if (candidate->cost < best->cost) best = std::move(candidate);
      continue;
    }
    runner_up = std::min(runner_up, best ? std::max(best->cost, candidate->cost) : 1e9);
    if (!best || candidate->cost < best->cost) best = std::move(candidate);
  }
  if (!best) return std::nullopt;
  if (runner_up < options_.min_runner_up_cost * best->cost) {
    *report = Wait(WaitReason::kNoReconstruction, "two motions explain the views about equally well");
    return std::nullopt;
  }
  if (!Passes(*best, report)) return std::nullopt;
  if (adjust_ && !AdjustAll(&*best)) {
    *report = Wait(WaitReason::kInconsistent, "the adjustment failed");
    return std::nullopt;
  }
  KeepConsistent(&*best);
  if (!AgreesWithPast(&*best, report) || !Passes(*best, report)) return std::nullopt;
  return best;
}

/// Drops points that frames just before the reference frame see elsewhere. If there are many, somebody has
/// just stopped, and what is his cannot be told from the rest: what these frames do not show is not dropped.
bool Initializer::Impl::AgreesWithPast(Candidate* candidate, InitializerReport* report) {
  const std::vector<const InitializerFrame*> frames = ChoosePast();
  std::vector<View> past(frames.size());
  Candidate longer = *candidate;
  const double length = candidate->placed.front().view->frame.index - reference_->index;
  for (size_t k = 0; k < frames.size(); ++k) {
    past[k].frame = *frames[k];
    past[k].pair.matches =
        MatchFrames(*reference_->features, *frames[k]->features, options_.matching, &matcher_);
    const double before = reference_->index - frames[k]->index;
    PlaceView(past[k], -before / length, &longer);
  }
  KeepConsistent(&longer);
  const auto points = std::accumulate(candidate->use.begin(), candidate->use.end(), 0);
  const auto left = std::accumulate(longer.use.begin(), longer.use.end(), 0);
  if (points - left > options_.max_past_conflict * points) {
    *report =
        Wait(WaitReason::kInconsistent, std::to_string(points - left) + " of " + std::to_string(points) +
                                            " points were elsewhere just before");
    return false;
  }
  candidate->use = longer.use;
  return true;
}

bool Initializer::Impl::SameMotion(const Candidate& a, const Candidate& b) const {
  const Rigid3d &T_a = a.placed.front().T_k_0, &T_b = b.placed.front().T_k_0;
  return AngleBetween(T_a.rotation, T_b.rotation) < 0.01 &&
         T_a.translation.normalized().dot(T_b.translation.normalized()) > std::cos(0.1);
}

/// The map under one motion of the pair: points, poses of the views between, adjusted.
std::optional<Initializer::Impl::Candidate> Initializer::Impl::BuildCandidate(
    const View& last, const Agreement& agreement, const TwoViewModel& model,
    InitializerReport* report) const {
  StaticSelection selection = last.pair.selection;
  selection.is_static = agreement.is_static;
  selection.kind = ModelKind::kEssential;
  selection.E = model.M;
  const auto refuse = [&](WaitReason reason, const std::string& text) {
    if (report) *report = Wait(reason, text);
    return std::nullopt;
  };
  // Little parallax refuses the winner only (Passes): the right motion may have less of it than its wrong
  // rivals.
  ReconstructionOptions reconstruction = options_.reconstruction;
  reconstruction.min_parallax_rad = 0;
  reconstruction.max_runner_up = 1;
  const TwoViewReconstruction pair =
      ReconstructFromStatic(last.pair.matches, selection, camera_, reconstruction);
  if (!pair.IsUsable()) return refuse(WaitReason::kNoReconstruction, pair.explanation);
  Candidate candidate;
  candidate.points = pair.points_cam0;
  candidate.use = pair.has_point;
  candidate.placed.push_back({&last, pair.T_1_0, 1.0});
  const double length = static_cast<double>(last.frame.index - reference_->index);
  for (const View* view : ViewsBetween(last)) {
    PlaceView(*view, static_cast<double>(view->frame.index - reference_->index) / length, &candidate);
  }
  for (const Placed& placed : candidate.placed) {
    if (placed.consistent_share >= options_.min_consistent_share) continue;
    return refuse(WaitReason::kInconsistent, "frame " + std::to_string(placed.view->frame.index) + " sees " +
                                                 std::to_string(placed.consistent_share) +
                                                 " of the points where they should be");
  }
  KeepConsistent(&candidate);
  // Twice: what had no point under the first poses has a say, too. A motion half way to its minimum would
  // lose unfairly.
  for (int round = 0; round < 2; ++round) {
    KeepEvery(options_.max_adjusted, &candidate);
    if (adjust_ && !AdjustAll(&candidate)) return refuse(WaitReason::kInconsistent, "the adjustment failed");
    AddMissing(agreement.is_static, &candidate);
  }
  candidate.cost = CandidateCost(candidate, agreement.is_static);
  return candidate;
}

bool Initializer::Impl::Passes(const Candidate& candidate, InitializerReport* report) const {
  const auto points = std::accumulate(candidate.use.begin(), candidate.use.end(), 0);
  if (points < options_.min_points) {
    *report = Wait(WaitReason::kTooFewStatic, std::to_string(points) + " points are seen consistently");
    return false;
  }
  const double parallax = CandidateParallax(candidate), sigma = CandidateDirectionSigma(candidate);
  if (parallax < options_.min_parallax_rad || sigma > options_.max_direction_sigma_rad) {
    *report = Wait(WaitReason::kParallaxTooSmall,
                   "median " + Degrees(parallax) + ", direction known to " + Degrees(sigma));
    return false;
  }
  return true;
}

/// Mean over the static matches of the squared errors in all views that see them, truncated at the bound and
/// in units of it; a match without a point counts as the bound.
double Initializer::Impl::CandidateCost(const Candidate& candidate,
                                        std::span<const uint8_t> is_static) const {
  const auto& matches = candidate.placed.front().view->pair.matches;
  std::vector<double> sum(matches.size(), 0.0), count(matches.size(), 0.0);
  for (const Placed& placed : candidate.placed) {
    ForEachSeen(placed, matches, [&](size_t k, const Match& seen) {
      if (!candidate.use[k]) return;
      const double variance = options_.selector.inlier.pyramid.SigmaSquared(seen.octave1);
      const double error =
          ReprojectionErrorSquared(camera_.Ideal(), placed.T_k_0, candidate.points[k], seen.uv1_px);
      sum[k] += std::min(1.0, error / (variance * options_.max_view_chi2));
      count[k] += 1.0;
    });
  }
  double total = 0, asked = 0;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (!is_static[k]) continue;
    total += count[k] > 0 ? sum[k] / count[k] : 1.0;
    asked += 1.0;
  }
  return asked > 0 ? total / asked : 1.0;
}

/// Finds the pose of a view between from the points of the pair, and how many it sees where they should be.
void Initializer::Impl::PlaceView(const View& view, double fraction, Candidate* candidate) const {
  const View& last = *candidate->placed.front().view;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> uv;
  std::vector<double> information;
  std::vector<int> all;
  const Placed placed_view{&view, Rigid3d(), 1.0};
  ForEachSeen(placed_view, last.pair.matches, [&](size_t k, const Match& seen) {
    if (!candidate->use[k]) return;
    all.push_back(static_cast<int>(points.size()));
    points.push_back(candidate->points[k]);
    uv.push_back(seen.uv1_px);
    information.push_back(1.0 / options_.selector.inlier.pyramid.SigmaSquared(seen.octave1));
  });
  if (points.size() < 20) return;  // says nothing
  const Rigid3d& T_last = candidate->placed.front().T_k_0;
  Rigid3d T(Eigen::Quaterniond::Identity().slerp(fraction, T_last.rotation), fraction * T_last.translation);
  T = RefinePose(camera_.Ideal(), T, points, uv, information, all, 5);
  std::vector<int> inliers;
  for (int round = 0; round < 3; ++round) {
    inliers.clear();
    const double slack = round == 0 ? 3.0 : 1.0;  // the first fit is pulled by what does not belong
    for (const int i : all) {
      const auto k = static_cast<size_t>(i);
      if (ReprojectionErrorSquared(camera_.Ideal(), T, points[k], uv[k]) * information[k] <=
          slack * options_.max_view_chi2) {
        inliers.push_back(i);
      }
    }
    if (inliers.size() < 10) break;
    if (round < 2) T = RefinePose(camera_.Ideal(), T, points, uv, information, inliers, 5);
  }
  candidate->placed.push_back(
      {&view, T, static_cast<double>(inliers.size()) / static_cast<double>(all.size())});
}

/// Drops points that some view does not see where they should be.
void Initializer::Impl::KeepConsistent(Candidate* candidate) const {
  const auto& matches = candidate->placed.front().view->pair.matches;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (candidate->use[k] && !(candidate->points[k].z() > 0 && candidate->points[k].allFinite())) {
      candidate->use[k] = 0;
    }
  }
  for (const Placed& placed : candidate->placed) {
    ForEachSeen(placed, matches, [&](size_t k, const Match& seen) {
      if (candidate->use[k] && !Sees(placed.T_k_0, candidate->points[k], seen)) candidate->use[k] = 0;
    });
  }
}

/// Of more than `most` points keeps an even choice.
void Initializer::Impl::KeepEvery(int most, Candidate* candidate) {
  const auto have = std::accumulate(candidate->use.begin(), candidate->use.end(), 0);
  if (have <= most) return;
  int seen = 0;
  for (uint8_t& use : candidate->use) {
    if (!use) continue;
    use = (seen + 1) * most / have > seen * most / have ? 1 : 0;
    ++seen;
  }
}

/// Static matches that had no point under the poses before they were adjusted may have one under them now.
void Initializer::Impl::AddMissing(std::span<const uint8_t> is_static, Candidate* candidate) const {
  const Rigid3d& T_last = candidate->placed.front().T_k_0;
  const auto& matches = candidate->placed.front().view->pair.matches;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (!is_static[k] || candidate->use[k]) continue;
    const auto point =
        TriangulatePointInFirst(T_last, camera_.Ray(matches[k].uv0_px), camera_.Ray(matches[k].uv1_px));
    if (!point) continue;
    candidate->points[k] = *point;
    candidate->use[k] = 1;
  }
  KeepConsistent(candidate);
}

bool Initializer::Impl::AdjustAll(Candidate* candidate) const {
  const auto& matches = candidate->placed.front().view->pair.matches;
  std::vector<Rigid3d> poses{Rigid3d()};
  std::vector<Eigen::Vector3d> points;
  std::vector<int> point_of(matches.size(), -1);
  std::vector<InitialObservation> observations;
  const Pyramid& pyramid = options_.selector.inlier.pyramid;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (!candidate->use[k]) continue;
    point_of[k] = static_cast<int>(points.size());
    points.push_back(candidate->points[k]);
    observations.push_back(
        {0, point_of[k], matches[k].uv0_px, 1.0 / pyramid.SigmaSquared(matches[k].octave0)});
  }
  for (const Placed& placed : candidate->placed) {
    const int pose = static_cast<int>(poses.size());
    poses.push_back(placed.T_k_0);
    ForEachSeen(placed, matches, [&](size_t k, const Match& seen) {
      if (point_of[k] < 0) return;
      observations.push_back({pose, point_of[k], seen.uv1_px, 1.0 / pyramid.SigmaSquared(seen.octave1)});
    });
  }
  if (!adjust_(&poses, &points, observations)) return false;
  for (size_t p = 0; p < candidate->placed.size(); ++p) candidate->placed[p].T_k_0 = poses[p + 1];
  for (size_t k = 0; k < matches.size(); ++k) {
    if (point_of[k] >= 0) candidate->points[k] = points[static_cast<size_t>(point_of[k])];
  }
  return true;
}

double Initializer::Impl::CandidateParallax(const Candidate& candidate) const {
  const Eigen::Vector3d center = candidate.placed.front().T_k_0.Center();
  std::vector<double> parallax;
  for (size_t k = 0; k < candidate.use.size(); ++k) {
    if (candidate.use[k])
      parallax.push_back(ParallaxAngle(Eigen::Vector3d::Zero(), center, candidate.points[k]));
  }
  return Median(std::move(parallax));
}

double Initializer::Impl::CandidateDirectionSigma(const Candidate& candidate) const {
  const auto& matches = candidate.placed.front().view->pair.matches;
  std::vector<uint32_t> order(matches.size());
  std::iota(order.begin(), order.end(), 0U);
  const MatchArrays arrays = MakeArrays(matches, order, camera_, options_.selector.inlier);
  TwoViewModel model;
  model.R = candidate.placed.front().T_k_0.rotation.toRotationMatrix();
  model.t = candidate.placed.front().T_k_0.translation.normalized();
  return DirectionSigma(arrays, candidate.use, options_.selector.inlier.chi2, model);
}

FirstMap Initializer::Impl::MakeMap(const Candidate& candidate, const Agreement& agreement) const {
  const View& last = *candidate.placed.front().view;
  FirstMap map;
  map.frame0 = *reference_;
  map.frame1 = last.frame;
  map.matches = last.pair.matches;
  map.is_static = agreement.is_static;
  map.num_views = static_cast<int>(candidate.placed.size()) + 1;
  map.median_parallax_rad = CandidateParallax(candidate);
  std::vector<double> depths;
  for (size_t k = 0; k < candidate.use.size(); ++k) {
    if (candidate.use[k]) depths.push_back(candidate.points[k].z());
  }
  const double unit = Median(std::move(depths));
  map.T_1_0 = candidate.placed.front().T_k_0;
  map.T_1_0.translation /= unit;
  for (size_t k = 0; k < candidate.use.size(); ++k) {
    if (!candidate.use[k]) continue;
    const Match& match = last.pair.matches[k];
    map.points.push_back({match.index0, match.index1, candidate.points[k] / unit});
  }
  return map;
}

Initializer::Initializer(const InitializerOptions& options, const Camera& camera, uint64_t seed,
                         AdjustFunction adjust)
    : impl_(std::make_unique<Impl>(options, camera, seed, std::move(adjust))) {}
Initializer::~Initializer() = default;

InitializerReport Initializer::AddFrame(const InitializerFrame& frame) { return impl_->AddFrame(frame); }

}  // namespace dmslam
