#include "dmslam/tracking/pose_solver.h"

#include <algorithm>
#include <iterator>
#include <span>

namespace dmslam {

namespace {

double Chi2(const Pinhole& camera, const Rigid3d& T_cam_world, const PoseObservation& o) {
  return ReprojectionErrorSquared(camera, T_cam_world, o.p_world, o.uv_px) * o.inv_sigma_squared;
}

/// How a pose explains observations.
struct Explained {
  int agreeing = 0;
  double cost = 0;  ///< sum of the squared errors, each of them bounded: the lower, the more is explained
};

Explained Explain(const Pinhole& camera, const Rigid3d& T_cam_world,
                  std::span<const PoseObservation> observations, double max_chi2) {
  Explained explained;
  for (const PoseObservation& o : observations) {
    const double chi2 = Chi2(camera, T_cam_world, o);
    explained.agreeing += chi2 <= max_chi2 ? 1 : 0;
    explained.cost += std::min(chi2, max_chi2);
  }
  return explained;
}

}  // namespace

void PoseSolver::Matches::Add(const Map& map, const TrackedFrame& frame, uint16_t feature,
                              const Landmark& landmark, double age_s, double weight) {
  matches.push_back({feature, &landmark});
  ages_s.push_back(age_s);
  observations.push_back({landmark.p_world, frame.features->uv_px[feature],
                          1.0 / frame.features->Variance(feature, map.pyramid_table()), weight});
}

void PoseSolver::Matches::Move(size_t from, size_t to) {
  matches[to] = matches[from];
  ages_s[to] = ages_s[from];
  observations[to] = observations[from];
}

void PoseSolver::Matches::Resize(size_t count) {
  matches.resize(count);
  ages_s.resize(count);
  observations.resize(count);
}

PoseOptimizationOptions PoseSolver::Options(const std::optional<PosePrior>& prior) const {
  PoseOptimizationOptions options;
  options.max_chi2 = max_chi2_;
  options.prior = prior;
  return options;
}

void PoseSolver::Observe(const Map& map, const LandmarkVotes& votes, const TrackedFrame& frame) {
  all_.Resize(0);
  LandmarkAges ages(map, frame.stamp_ns);
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].valid()) continue;
    const Landmark* landmark = map.FindLandmark(frame.landmarks[i]);
    if (landmark == nullptr) continue;
    const double age_s = ages.Of(*landmark);
    all_.Add(map, frame, static_cast<uint16_t>(i), *landmark, age_s, votes.Trust(age_s));
  }
}

/// Since all start as inliers, the eldest may agree on a compromise between the room and somebody who has
/// just begun to move. Then those that agree with the pose of all matches are asked, too.
std::optional<Rigid3d> PoseSolver::PoseOfEldest(const Pinhole& camera, const Rigid3d& T_cam_world,
                                                const PoseOptimizationOptions& options) {
  OptimizePose(camera, T_cam_world, eldest_, options, optimized_);
  if (!optimized_.usable) return std::nullopt;
  const Rigid3d T_eldest = optimized_.T_cam_world;
  const double mean_chi2 = optimized_.mean_chi2;
  if (!Elders::AreTorn(mean_chi2)) return T_eldest;
  OptimizePose(camera, T_cam_world, current_.observations, options, optimized_);
  if (!optimized_.usable) return T_eldest;
  const Rigid3d T_all = optimized_.T_cam_world;
  agreeing_.clear();
  std::ranges::copy_if(eldest_, std::back_inserter(agreeing_),
                       [&](const PoseObservation& o) { return Chi2(camera, T_all, o) <= options.max_chi2; });
  OptimizePose(camera, T_all, agreeing_, options, optimized_);
  if (!optimized_.usable) return T_eldest;
  const Rigid3d T_again = optimized_.T_cam_world;
  const auto cost = [&](const Rigid3d& T) { return Explain(camera, T, eldest_, options.max_chi2).cost; };
  const ElderFit first{mean_chi2, cost(T_eldest)}, again{optimized_.mean_chi2, cost(T_again)};
  return Elders::SecondPoseCounts(first, again) ? T_again : T_eldest;
}

/// Takes out the younger matches that contradict the elders, and weighs the others down. False: there are
/// none who are old enough to be trusted, or none who are younger, or the elders do not agree.
bool PoseSolver::LetEldersDecide(const Pinhole& camera, const Rigid3d& T_cam_world,
                                 const PoseOptimizationOptions& options, Elders* elders) {
  const std::optional<double> elder_age_s = elders->FromAge(current_.ages_s);
  if (!elder_age_s) return false;
  eldest_.clear();
  for (size_t i = 0; i < current_.matches.size(); ++i) {
    if (current_.ages_s[i] >= *elder_age_s) eldest_.push_back(current_.observations[i]);
  }
  if (eldest_.size() == current_.observations.size()) return false;
  const std::optional<Rigid3d> pose = PoseOfEldest(camera, T_cam_world, options);
  if (!pose) return false;
  const int agreeing = Explain(camera, *pose, eldest_, options.max_chi2).agreeing;
  if (!elders->Decide(agreeing, eldest_.size())) return false;
  KeepWhatAgrees(camera, *pose, *elder_age_s, agreeing, *elders);
  return elders->AreTrusted(*elder_age_s);
}

void PoseSolver::KeepWhatAgrees(const Pinhole& camera, const Rigid3d& T_cam_world, double elder_age_s,
                                int agreeing, const Elders& elders) {
  size_t kept = 0;
  int young = 0;
  for (size_t i = 0; i < current_.matches.size(); ++i) {
    const PoseObservation& o = current_.observations[i];
    if (current_.ages_s[i] < elder_age_s) {
      const double chi2 = Chi2(camera, T_cam_world, o);
      if (!elders.Admit(chi2)) {
        rejected_.push_back({current_.matches[i].landmark->id, current_.matches[i].feature, chi2});
        continue;
      }
      ++young;
    }
    current_.Move(i, kept++);
  }
  current_.Resize(kept);
  const double factor = elders.YoungFactor(agreeing, young);
  for (size_t i = 0; i < kept; ++i) {
    if (current_.ages_s[i] < elder_age_s) current_.observations[i].weight *= factor;
  }
}

/// What contradicts the pose may have a motion of its own, and that may be the camera's: none where it holds
/// less of the image.
std::optional<Rigid3d> PoseSolver::FindWiderMotion(const Camera& camera, const Rigid3d& T_cam_world,
                                                   const PoseOptimizationOptions& options,
                                                   const RivalMotions& rivals) {
  const Pinhole pinhole = camera.Ideal();
  const auto explains = [&](const Rigid3d& T, const PoseObservation& o) {
    return Chi2(pinhole, T, o) <= options.max_chi2;
  };
  contradicting_.clear();
  for (const PoseObservation& o : all_.observations) {
    if (!explains(T_cam_world, o)) contradicting_.push_back(o);
  }
  const int contradicting = static_cast<int>(contradicting_.size());
  if (!rivals.IsWorthALook(contradicting)) return std::nullopt;
  PoseOptimizationOptions own = options;
  own.prior.reset();  // it speaks of the motion that is contradicted
  OptimizePose(pinhole, T_cam_world, contradicting_, own, rival_);
  if (!rival_.usable) return std::nullopt;
  SupportWidth first, rival;
  for (const PoseObservation& o : all_.observations) {
    const bool by_first = explains(T_cam_world, o), by_rival = explains(rival_.T_cam_world, o);
    if (by_first == by_rival) continue;
    (by_first ? first : rival).Add(o.uv_px, CellOf(camera, o.uv_px));
  }
  return rivals.RivalWins(first, rival, contradicting) ? std::optional(rival_.T_cam_world) : std::nullopt;
}

/// Optimises over those of all matches that the pose explains.
void PoseSolver::GoOnFrom(const Pinhole& camera, const Rigid3d& T_cam_world,
                          const PoseOptimizationOptions& options) {
  rejected_.clear();
  current_ = all_;
  size_t kept = 0;
  for (size_t i = 0; i < current_.size(); ++i) {
    const double chi2 = Chi2(camera, T_cam_world, current_.observations[i]);
    if (chi2 <= options.max_chi2) {
      current_.Move(i, kept++);
    } else {
      rejected_.push_back({current_.matches[i].landmark->id, current_.matches[i].feature, chi2});
    }
  }
  current_.Resize(kept);
  OptimizePose(camera, T_cam_world, current_.observations, options, optimized_);
}

void PoseSolver::SetClasses(TrackedFrame* frame) {
  for (size_t i = 0; i < current_.matches.size(); ++i) {
    if (optimized_.inliers[i] != 0) {
      frame->classes[current_.matches[i].feature] = FeatureClass::kUsed;
    } else {
      rejected_.push_back(
          {current_.matches[i].landmark->id, current_.matches[i].feature, optimized_.chi2[i]});
    }
  }
  for (const RejectedMatch& rejected : rejected_) {
    frame->classes[rejected.feature] = FeatureClass::kRejected;
    frame->landmarks[rejected.feature] = LandmarkId{};
  }
}

PoseFit PoseSolver::Solve(const Map& map, const std::optional<PosePrior>& prior, MotionJudge* judge,
                          TrackedFrame* frame, Elderhood elderhood) {
  rejected_.clear();
  Observe(map, judge->votes(), *frame);
  current_ = all_;
  const PoseOptimizationOptions options = Options(prior);
  const Pinhole camera = map.camera().Ideal();
  const bool by_elders = judge->enabled() && elderhood == Elderhood::kCounts &&
                         LetEldersDecide(camera, frame->T_cam_world, options, &judge->elders());
  OptimizePose(camera, frame->T_cam_world, current_.observations, options, optimized_);
  std::optional<Rigid3d> wider;
  if (judge->enabled() && !by_elders && optimized_.usable)
    wider = FindWiderMotion(map.camera(), optimized_.T_cam_world, options, judge->rivals());
  if (wider) GoOnFrom(camera, *wider, Options(std::nullopt));
  if (!optimized_.usable) return {0, optimized_.mean_chi2, rejected_, by_elders};
  frame->T_cam_world = optimized_.T_cam_world;
  SetClasses(frame);
  return {optimized_.num_inliers, optimized_.mean_chi2, rejected_, by_elders, wider.has_value()};
}

bool PoseSolver::FollowWiderMotion(const Map& map, const std::optional<PosePrior>& prior,
                                   const MotionJudge& judge, TrackedFrame* frame) {
  const size_t elsewhere = judge.moved().size();
  if (!judge.enabled() || !judge.rivals().IsWorthALook(static_cast<int>(elsewhere))) return false;
  Observe(map, judge.votes(), *frame);
  LandmarkAges ages(map, frame->stamp_ns);
  for (size_t k = 0; k < elsewhere; ++k) {
    const Landmark& landmark = map.At(judge.moved()[k]);
    all_.Add(map, *frame, judge.moved_features()[k], landmark, ages.Of(landmark), 1.0);
  }
  const PoseOptimizationOptions options = Options(prior);
  const Pinhole camera = map.camera().Ideal();
  const auto wider = FindWiderMotion(map.camera(), frame->T_cam_world, options, judge.rivals());
  if (!wider) return false;
  GoOnFrom(camera, *wider, Options(std::nullopt));
  frame->ClearMatches();
  for (const LandmarkMatch& match : current_.matches) frame->landmarks[match.feature] = match.landmark->id;
  frame->T_cam_world = *wider;
  return true;
}

}  // namespace dmslam
