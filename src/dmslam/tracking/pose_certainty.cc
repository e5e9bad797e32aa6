#include "dmslam/tracking/pose_certainty.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dmslam/camera/image_cells.h"
#include "dmslam/geometry/symmetric_eigen.h"

namespace dmslam {
namespace {

constexpr double kMaxTurnOfMap = 0.02;  // [rad] the map may have turned under a step to be the same
constexpr size_t kMostKnown = 20'000;   // landmarks whose covariances are kept
constexpr size_t kMaxViews = 8;         // of a landmark, spread over all: what more say changes little
constexpr double kExpectedChi2 = 2.0;   // of a residual in two dimensions, in sigmas
constexpr double kMinNoiseVariance = 0.05;

double MedianDepth(const Rigid3d& T_cam_world, const std::vector<PoseSight>& sights) {
  std::vector<double> depths;
  depths.reserve(sights.size());
  for (const PoseSight& sight : sights) depths.push_back((T_cam_world * sight.p_world).z());
  if (depths.empty()) return 1.0;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

double LargestSigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(0.0, DirectEigenvaluesOfSymmetric(covariance).maxCoeff()));
}

}  // namespace

void PoseCertaintyEstimator::Forget() {
  last_.reset();
  jitter_ = PoseJitter();
  known_.clear();
}

const Eigen::Matrix3d& PoseCertaintyEstimator::RootOf(const Map& map, const Pinhole& camera,
                                                      const Landmark& landmark) {
  if (known_.size() > kMostKnown) known_.clear();
  const auto [it, is_new] = known_.try_emplace(landmark.id);
  Known& known = it->second;
  const size_t observations = landmark.observations.size();
  if (is_new || known.observations != observations || known.p_world != landmark.p_world)
    known = {observations, landmark.p_world, SymmetricRoot(WorkOutCovariance(map, camera, landmark))};
  return known.root;
}

Eigen::Matrix3d PoseCertaintyEstimator::WorkOutCovariance(const Map& map, const Pinhole& camera,
                                                          const Landmark& landmark) {
  views_.clear();
  const size_t count = landmark.observations.size(), used = std::min(count, kMaxViews);
  for (size_t i = 0; i < used; ++i) {
    const Observation& seen = landmark.observations[used == 1 ? 0 : i * (count - 1) / (used - 1)];
    const Keyframe* keyframe = map.FindKeyframe(seen.keyframe);
    if (keyframe == nullptr) continue;
    // The views that are left out say as much as those that are not.
    const double variance = keyframe->features->Variance(seen.feature, map.pyramid_table());
    views_.push_back(
        {keyframe->T_cam_world, variance * static_cast<double>(used) / static_cast<double>(count)});
  }
  return LandmarkCovariance(camera, landmark.p_world, views_);
}

std::vector<PoseSight> PoseCertaintyEstimator::SightsOf(const Map& map, const PoseBasis& basis) {
  const Pinhole camera = map.camera().Ideal();
  order_.clear();
  for (size_t i = 0; i < basis.matches.size(); ++i) {
    if (basis.inliers[i] != 0) order_.emplace_back(basis.matches[i].landmark->id, i);
  }
  std::sort(order_.begin(), order_.end());
  std::vector<PoseSight> sights;
  sights.reserve(order_.size());
  for (const auto& [id, i] : order_) {
    const Landmark& landmark = *basis.matches[i].landmark;
    const PoseObservation& seen = basis.observations[i];
    sights.push_back({id, landmark.p_world, RootOf(map, camera, landmark), 1.0 / seen.inv_sigma_squared,
                      seen.weight, static_cast<int>(CellOf(map.camera(), seen.uv_px))});
  }
  return sights;
}

/// Since the frame before was told, by more than what is worked on from frame to frame.
bool PoseCertaintyEstimator::HasMapMoved(const Map& map) const {
  if (!last_) return false;
  const std::optional<Rigid3d> T_last_world = last_->pose.In(map);
  return !T_last_world || AngleBetween(T_last_world->rotation, last_->T_cam_world.rotation) > kMaxTurnOfMap;
}

/// None where the frames are far apart, or where the map has turned meanwhile.
std::optional<PoseCertainty::Step> PoseCertaintyEstimator::StepTo(const Map& map, const Told& now,
                                                                  double depth) const {
  if (!last_ || now.stamp_ns - last_->stamp_ns > PoseJitter::kLongestStepNs || HasMapMoved(map))
    return std::nullopt;
  const std::optional<Rigid3d> T_last_world = last_->pose.In(map);
  const Rigid3d T_now_last = now.T_cam_world * T_last_world->Inverse();
  Matrix6d covariance = StepUncertainty({*T_last_world, last_->sights, &last_->uncertainty},
                                        {now.T_cam_world, now.sights, &now.uncertainty}, model_);
  const double change = ViewChange(T_now_last, depth);
  covariance += SharedErrors(model_, {change, change}, depth);
  return PoseCertainty::Step{last_->index, ToPoseInReference(covariance, T_now_last)};
}

std::optional<PoseCertainty> PoseCertaintyEstimator::Estimate(const Map& map, const TrackedFrame& frame,
                                                              const PlacedPose& pose, const PoseBasis& basis,
                                                              bool follows) {
  if (!follows) last_.reset();
  const double noise = std::max(basis.mean_chi2 / kExpectedChi2, kMinNoiseVariance);
  Told now{frame.index, frame.stamp_ns, pose, frame.T_cam_world, SightsOf(map, basis), {}};
  std::optional<PoseUncertainty> uncertainty = EstimatePoseUncertainty(
      map.camera().Ideal(), frame.T_cam_world, now.sights, basis.information, noise, model_);
  if (!uncertainty) {
    last_.reset();
    return std::nullopt;
  }
  now.uncertainty = std::move(*uncertainty);
  PoseCertainty result;
  result.depth = MedianDepth(frame.T_cam_world, now.sights);
  const double change = ViewChange(pose.T_cam_reference, result.depth);
  const Matrix6d told = now.uncertainty.Sum() + SharedErrors(model_, {change, change}, result.depth);
  result.covariance = ToPoseInReference(told, pose.T_cam_reference);
  result.position_share = LargestSigma(result.covariance.topLeftCorner<3, 3>()) / result.depth;
  result.rotation_rad = LargestSigma(result.covariance.bottomRightCorner<3, 3>());
  result.step = StepTo(map, now, result.depth);
  if (result.step && !IsCovariance(result.step->covariance)) result.step.reset();
  if (HasMapMoved(map)) jitter_.OnMapMoved();
  jitter_.OnPose(frame.stamp_ns, map.At(pose.reference).map_id, frame.T_cam_world, result.depth);
  result.covariance += ToPoseInReference(jitter_.Beyond(told, result.depth), pose.T_cam_reference);
  if (!IsCovariance(result.covariance)) {
    last_.reset();
    return std::nullopt;
  }
  last_ = std::move(now);
  return result;
}

}  // namespace dmslam
