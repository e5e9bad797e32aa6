#include "dmslam/tracking/pose_solver.h"

namespace dmslam {

void PoseSolver::Observe(const Map& map, const LandmarkVotes& votes, const TrackedFrame& frame) {
  observations_.clear();
  matches_.clear();
  ages_s_.clear();
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].valid()) continue;
    const Landmark* landmark = map.FindLandmark(frame.landmarks[i]);
    if (landmark == nullptr) continue;
    matches_.push_back({static_cast<uint16_t>(i), landmark->id});
    ages_s_.push_back(static_cast<double>(frame.stamp_ns - landmark->first_ns) * 1e-9);
    observations_.push_back({landmark->p_world, frame.features->uv_px[i],
                             1.0 / map.pyramid().SigmaSquared(frame.features->set.keypoints[i].octave),
                             votes.Trust(*landmark, frame.stamp_ns)});
  }
}

/// Takes out the younger matches that contradict the elders, and weighs the others down.
void PoseSolver::LetEldersDecide(const Pinhole& camera, const Rigid3d& T_cam_world,
                                 const PoseOptimizationOptions& options, Elders* elders) {
  const std::optional<double> elder_age_s = elders->FromAge(ages_s_);
  if (!elder_age_s) return;
  eldest_.clear();
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (ages_s_[i] >= *elder_age_s) eldest_.push_back(observations_[i]);
  }
  if (eldest_.size() == observations_.size()) return;
  OptimizePose(camera, T_cam_world, eldest_, options, optimized_);
  if (!optimized_.usable || !elders->Decide(optimized_.num_inliers, eldest_.size())) return;
  KeepWhatAgrees(camera, optimized_.T_cam_world, *elder_age_s, optimized_.num_inliers, *elders);
}

void PoseSolver::KeepWhatAgrees(const Pinhole& camera, const Rigid3d& T_cam_world, double elder_age_s,
                                int agreeing, const Elders& elders) {
  size_t kept = 0;
  int young = 0;
  for (size_t i = 0; i < matches_.size(); ++i) {
    const PoseObservation& o = observations_[i];
    if (ages_s_[i] < elder_age_s) {
      const double chi2 =
          ReprojectionErrorSquared(camera, T_cam_world, o.p_world, o.uv_px) * o.inv_sigma_squared;
      if (!elders.Admit(chi2)) {
        rejected_.push_back({matches_[i].landmark, matches_[i].feature, chi2});
        continue;
      }
      ++young;
    }
    matches_[kept] = matches_[i];
    ages_s_[kept] = ages_s_[i];
    observations_[kept++] = o;
  }
  matches_.resize(kept);
  ages_s_.resize(kept);
  observations_.resize(kept);
  const double factor = elders.YoungFactor(agreeing, young);
  for (size_t i = 0; i < kept; ++i) {
    if (ages_s_[i] < elder_age_s) observations_[i].weight *= factor;
  }
}

void PoseSolver::SetClasses(TrackedFrame* frame) {
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (optimized_.inliers[i] != 0) {
      frame->classes[matches_[i].feature] = FeatureClass::kUsed;
    } else {
      rejected_.push_back({matches_[i].landmark, matches_[i].feature, optimized_.chi2[i]});
    }
  }
  for (const RejectedMatch& rejected : rejected_) {
    frame->classes[rejected.feature] = FeatureClass::kRejected;
    frame->landmarks[rejected.feature] = LandmarkId{};
  }
}

PoseFit PoseSolver::Solve(const Map& map, const std::optional<PosePrior>& prior, MotionJudge* judge,
                          TrackedFrame* frame) {
  rejected_.clear();
  Observe(map, judge->votes(), *frame);
  PoseOptimizationOptions options;
  options.max_chi2 = max_chi2_;
  options.prior = prior;
  const Pinhole camera = map.camera().Ideal();
  if (judge->enabled()) LetEldersDecide(camera, frame->T_cam_world, options, &judge->elders());
  OptimizePose(camera, frame->T_cam_world, observations_, options, optimized_);
  if (!optimized_.usable) return {0, optimized_.mean_chi2, rejected_};
  frame->T_cam_world = optimized_.T_cam_world;
  SetClasses(frame);
  return {optimized_.num_inliers, optimized_.mean_chi2, rejected_};
}

}  // namespace dmslam
