#include "dmslam/refinement/final_poses.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/optimization/reprojection.h"
#include "dmslam/refinement/leaps.h"
#include "dmslam/util/check.h"
#include "dmslam/util/chi_squared.h"
#include "dmslam/util/parallel.h"

namespace dmslam {
namespace {

constexpr int kMaxRounds = 20;
constexpr double kStill = 0.06;  // a round that moves the poses by less is the last [standard deviations]
constexpr double kMinInlierShare = 0.7;
constexpr double kMaxLeverage = 1.0 / 3.0;  // of one sight: half of what all others say
constexpr int kMinFrames = 5;               // that see a landmark, to place it by them
constexpr int kLandmarkSteps = 2;           // of Gauss and Newton
// Landmarks go beyond where the frames want them: turns are slow where both must move (over-relaxation).
constexpr double kOverstep = 1.7;
constexpr size_t kSharedFrames = 10;  // since another saw a landmark: more, and their errors are their own
constexpr double kMaxMove = 0.3;      // of a landmark, as a share of its distance: more is a slip
constexpr size_t kFramesAtOnce = 256, kLandmarksAtOnce = 2048;  // some milliseconds' work for two threads

PoseObservation Observe(const PyramidTable& pyramid, const Sight& sight, const Eigen::Vector3d& p_world) {
  return {p_world, sight.uv_px.cast<double>(), 1.0 / pyramid.SigmaSquared(sight.octave), 1.0};
}

/// Of a landmark's place.
struct LandmarkEquations {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();

  /// Seen at `uv_px` by a camera turned by R, before which it lies at `p_cam`.
  void Add(const Pinhole& camera, const Eigen::Matrix3d& R, const Eigen::Vector3d& p_cam,
           const Eigen::Vector2d& uv_px, double inv_sigma_squared) {
    if (p_cam.z() <= 0.0) return;
    const Eigen::Vector2d error = camera.Project(p_cam) - uv_px;
    const double chi2 = error.squaredNorm() * inv_sigma_squared;
    const double weight =
        inv_sigma_squared * (chi2 > kChiSquared2Dof ? std::sqrt(kChiSquared2Dof / chi2) : 1.0);
    const Matrix23 J = ProjectionJacobian(camera, p_cam) * R;
    information += weight * J.transpose() * J;
    gradient += weight * J.transpose() * error;
  }
};

/// The share of what is known of the pose that this observation alone says, along the direction where that is
/// most: 0 to 1 (the greatest eigenvalue of its part of the hat matrix).
double Leverage(const Pinhole& camera, const Rigid3d& T_cam_world, const Matrix6d& covariance,
                const PoseObservation& observation) {
  const Matrix26 J = PoseJacobian(camera, T_cam_world * observation.p_world);
  const Eigen::Matrix2d hat = observation.inv_sigma_squared * J * covariance * J.transpose();
  const double mean = 0.5 * hat.trace();
  return mean + std::sqrt(std::max(0.0, mean * mean - hat.determinant()));
}

/// Drops what the pose rests on without others that would contradict it, were it wrong: as a rule a mismatch
/// near the epipole, which makes a landmark just before the lens. Whether there were any; never half of all.
bool DropUnchecked(const Pinhole& camera, const PoseOptimizationReport& report, std::vector<Sight>* sights,
                   std::vector<PoseObservation>* observations) {
  if (!report.usable) return false;
  const Matrix6d covariance = SolveSymmetric<6, 6>(report.information, Matrix6d::Identity());
  std::vector<size_t> checked;
  for (size_t i = 0; i < sights->size(); ++i) {
    const bool alone = report.inliers[i] != 0 &&
                       Leverage(camera, report.T_cam_world, covariance, (*observations)[i]) > kMaxLeverage;
    if (!alone) checked.push_back(i);
  }
  if (checked.size() == sights->size() || 2 * checked.size() < sights->size()) return false;
  for (size_t k = 0; k < checked.size(); ++k) {
    (*sights)[k] = (*sights)[checked[k]];
    (*observations)[k] = (*observations)[checked[k]];
  }
  sights->resize(checked.size());
  observations->resize(checked.size());
  return true;
}

std::vector<PoseObservation> ObserveAll(const Map& map, const std::vector<Sight>& sights) {
  std::vector<PoseObservation> observations;
  observations.reserve(sights.size());
  for (const Sight& sight : sights) {
    observations.push_back(Observe(map.pyramid_table(), sight, map.At(sight.landmark).p_world));
  }
  return observations;
}

void SetMeasured(const PoseOptimizationReport& report, const std::vector<Sight>& sights, FinalPose* pose) {
  pose->measured = report.T_cam_world;
  pose->information = report.information;
  pose->sights.clear();
  pose->sights.reserve(static_cast<size_t>(report.num_inliers));
  for (size_t i = 0; i < sights.size(); ++i) {
    if (report.inliers[i] != 0) pose->sights.push_back(sights[i]);
  }
}

/// Standard deviation of the rotation [rad] and of the position over the depth, whichever is more.
std::optional<double> SpreadOf(const Matrix6d& information, double depth) {
  const std::optional<Matrix6d> covariance = InverseOfPositive(information);
  if (!covariance) return std::nullopt;
  return std::sqrt(std::max(covariance->topLeftCorner<3, 3>().trace(),
                            covariance->bottomRightCorner<3, 3>().trace() / (depth * depth)));
}

/// How sure its keyframes are of a landmark's place.
Eigen::Matrix3d InformationOf(const Map& map, const Landmark& landmark) {
  LandmarkEquations equations;
  for (const auto& [keyframe_id, feature] : landmark.observations) {
    const Keyframe* keyframe = map.FindKeyframe(keyframe_id);
    if (keyframe == nullptr) continue;
    const uint8_t octave = keyframe->features->set.keypoints[feature].octave;
    equations.Add(map.camera().Ideal(), keyframe->T_cam_world.rotation.toRotationMatrix(),
                  keyframe->T_cam_world * landmark.p_world, keyframe->features->uv_px[feature],
                  1.0 / map.pyramid_table().SigmaSquared(octave));
  }
  return equations.information;
}

}  // namespace

std::vector<Sight> SightsOf(const TrackedFrame& frame) {
  std::vector<Sight> sights;
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].valid() || frame.classes[i] != FeatureClass::kUsed) continue;
    sights.push_back({frame.landmarks[i], frame.features->uv_px[i].cast<float>(), static_cast<uint16_t>(i),
                      static_cast<uint8_t>(frame.features->set.keypoints[i].octave)});
  }
  return sights;
}

void FinalPose::SetPose(const Rigid3d& T_cam_world) {
  pose.T_cam_reference = T_cam_world * T_reference_world.Inverse();
  pose.T_cam_world = T_cam_world;
}

void FinalPose::SetPose(const Keyframe& reference, const Rigid3d& T_cam_world) {
  pose.map_id = reference.map_id;
  pose.reference = reference.id;
  pose.reference_scale = reference.scale;
  T_reference_world = reference.T_cam_world;
  SetPose(T_cam_world);
}

bool Agrees(const PoseOptimizationReport& report) {
  return report.usable && report.num_inliers >= kMinInlierShare * static_cast<double>(report.inliers.size());
}

PoseOptimizationReport MeasurePose(const Map& map, const Rigid3d& T_cam_world,
                                   const std::vector<Sight>& sights, FinalPose* pose) {
  PoseOptimizationReport report = OptimizePose(map.camera().Ideal(), T_cam_world, ObserveAll(map, sights));
  SetMeasured(report, sights, pose);
  return report;
}

PoseOptimizationReport MeasureCheckedPose(const Map& map, const Rigid3d& T_cam_world,
                                          const std::vector<Sight>& sights, FinalPose* pose) {
  const Pinhole camera = map.camera().Ideal();
  std::vector<Sight> checked = sights;
  std::vector<PoseObservation> observations = ObserveAll(map, checked);
  PoseOptimizationReport report = OptimizePose(camera, T_cam_world, observations);
  while (DropUnchecked(camera, report, &checked, &observations)) {
    report = OptimizePose(camera, report.T_cam_world, observations);
  }
  SetMeasured(report, checked, pose);
  return report;
}

void FinalPoses::Add(const Map& map, FinalPose pose) {
  for (const Sight& sight : pose.sights) {
    const bool is_new = index_.try_emplace(sight.landmark, static_cast<uint32_t>(placed_.size())).second;
    if (!is_new) continue;
    const Landmark& landmark = map.At(sight.landmark);
    placed_.push_back({landmark.p_world, landmark.p_world, InformationOf(map, landmark)});
  }
  poses_.push_back(std::move(pose));
  views_.clear();
  rounds_ = 0;
  GoTo(Step::kBetweenRounds);
}

/// Whether keyframes of the poses are elsewhere than they were.
bool FinalPoses::HasMoved(const Map& map) const {
  return std::any_of(poses_.begin(), poses_.end(), [&map](const FinalPose& p) {
    const Keyframe* reference = map.FindKeyframe(*p.pose.reference);
    return reference == nullptr || reference->map_id != p.pose.map_id ||
           reference->T_cam_world.translation != p.T_reference_world.translation ||
           reference->T_cam_world.rotation.coeffs() != p.T_reference_world.rotation.coeffs();
  });
}

void FinalPoses::BeginRound(const Map& map) {
  map_has_moved_ = map_has_moved_ || HasMoved(map);
  if (map_has_moved_) return;
  std::sort(poses_.begin(), poses_.end(), [](const FinalPose& a, const FinalPose& b) {
    return std::tie(a.pose.map_id, a.pose.stamp_ns) < std::tie(b.pose.map_id, b.pose.stamp_ns);
  });
  if (views_.empty()) ListSights(map);
  moves_ = {};
  GoTo(rounds_++ > 0 ? Step::kLandmarks : Step::kSmoothing);
}

void FinalPoses::GoTo(Step step) {
  step_ = step;
  next_ = 0;
}

void FinalPoses::Improve(const Map& map) {
  switch (step_) {
    case Step::kBetweenRounds:
      BeginRound(map);
      break;
    case Step::kLandmarks:
      PlaceSomeLandmarks(map);
      if (next_ >= views_.size()) GoTo(Step::kFrames);
      break;
    case Step::kFrames:
      PlaceSomeFrames(map);
      if (next_ >= poses_.size()) GoTo(Step::kSmoothing);
      break;
    case Step::kSmoothing:
      SmoothNextMap(map);
      if (next_ >= poses_.size()) GoTo(Step::kBetweenRounds);
  }
}

bool FinalPoses::IsSettled() const {
  return !IsMidRound() && (poses_.empty() || map_has_moved_ || rounds_ >= kMaxRounds || IsStill());
}

bool FinalPoses::IsStill() const {
  return rounds_ > 1 && moves_.sum_squared <= kStill * kStill * moves_.count;
}

void FinalPoses::Drop(std::span<const uint8_t> drop) {
  size_t kept = 0;
  for (size_t i = 0; i < poses_.size(); ++i) {
    if (drop[i] != 0) continue;
    if (kept != i) poses_[kept] = std::move(poses_[i]);
    ++kept;
  }
  poses_.resize(kept);
  views_.clear();
}

std::vector<FramePose> FinalPoses::Take() {
  std::vector<FramePose> told;
  for (FinalPose& last : poses_) told.push_back(std::move(last.pose));
  *this = FinalPoses(threads_, motion_);
  return told;
}

/// The part of what is measured of a frame that frames shortly before say too.
Matrix6d FinalPoses::SharedInformation(const Map& map, size_t frame) const {
  const Pinhole camera = map.camera().Ideal();
  const FinalPose& pose = poses_[frame];
  const Eigen::Matrix3d R = pose.measured.rotation.toRotationMatrix();
  Matrix6d shared = Matrix6d::Zero();
  for (size_t i = 0; i < pose.sights.size(); ++i) {
    if (!seen_[frame][i].seen_before) continue;
    const Sight& sight = pose.sights[i];
    const Eigen::Vector3d p_cam = R * placed_[seen_[frame][i].landmark].p_world + pose.measured.translation;
    if (p_cam.z() <= 0.0) continue;
    const double variance = map.pyramid_table().SigmaSquared(sight.octave);
    const Eigen::Vector2d error = camera.Project(p_cam) - sight.uv_px.cast<double>();
    if (error.squaredNorm() > kChiSquared2Dof * variance) continue;  // the pose was told without it
    const Matrix26 J = PoseJacobian(camera, p_cam);
    shared += J.transpose() * J / variance;
  }
  return shared;
}

/// Of those of one map, by what they saw.
std::vector<uint8_t> FinalPoses::Leaps(const Map& map, size_t begin, size_t end) const {
  std::map<KeyframeId, double> depths;
  std::vector<SeenFrom> frames;
  for (size_t i = begin; i < end; ++i) {
    const FinalPose& frame = poses_[i];
    const auto [depth, is_new] = depths.try_emplace(*frame.pose.reference, 1.0);
    const Keyframe* reference = is_new ? map.FindKeyframe(*frame.pose.reference) : nullptr;
    if (reference != nullptr) depth->second = map.MedianDepth(*reference).value_or(1.0);
    frames.push_back(
        {frame.pose.stamp_ns, frame.measured, depth->second, SpreadOf(frame.information, depth->second)});
  }
  return FindLeaps(frames, motion_);
}

std::vector<PoseEstimate> FinalPoses::Estimates(const Map& map, size_t begin, size_t end) const {
  std::vector<PoseEstimate> estimates(end - begin);
  const std::vector<uint8_t> leaps = Leaps(map, begin, end);
  ForEachInParallel(estimates.size(), threads_, [&](size_t k) {
    const FinalPose& frame = poses_[begin + k];
    const double time_s = 1e-9 * static_cast<double>(frame.pose.stamp_ns - poses_[begin].pose.stamp_ns);
    estimates[k] = {time_s, frame.measured, frame.information, shared_[begin + k], leaps[k] != 0};
  });
  return estimates;
}

void FinalPoses::SmoothNextMap(const Map& map) {
  const auto begin = poses_.begin() + static_cast<ptrdiff_t>(next_);
  const auto end = std::find_if(begin, poses_.end(),
                                [begin](const FinalPose& p) { return p.pose.map_id != begin->pose.map_id; });
  DMSLAM_CHECK(begin->pose.map_id.has_value(), "a final pose without a map");
  const MapId map_id = *begin->pose.map_id;
  SmoothingOptions options;
  options.threads = threads_;
  const auto known = noise_.find(map_id);
  if (known != noise_.end()) options.noise = known->second;
  const size_t next = static_cast<size_t>(end - poses_.begin());
  const SmoothedTrajectory smoothed = SmoothTrajectory(Estimates(map, next_, next), options);
  if (smoothed.noise) noise_.emplace(map_id, *smoothed.noise);
  for (auto it = begin; it != end; ++it) Move(smoothed.T_cam_world[static_cast<size_t>(it - begin)], &*it);
  next_ = next;
}

void FinalPoses::Move(const Rigid3d& T_cam_world, FinalPose* pose) {
  const Rigid3d move = T_cam_world * pose->pose.T_cam_world.Inverse();
  Vector6d step;
  step << LogSo3(move.rotation), move.translation;
  moves_.sum_squared += step.dot(pose->information * step) / static_cast<double>(step.size());
  moves_.count += pose->information.isZero(0.0) ? 0 : 1;
  pose->SetPose(T_cam_world);
}

bool FinalPoses::IsInFront(std::span<const View> views, const Eigen::Vector3d& p_world) const {
  return std::all_of(views.begin(), views.end(), [&](const View& view) {
    const RotatedPose& camera = cameras_[view.frame];
    return camera.R.row(2).dot(p_world) + camera.t.z() > 0.0;
  });
}

/// Least reprojection errors (Huber's loss) over the landmark's place, the poses as they are. What the
/// keyframes say holds it too: else few frames, close to each other, would carry their landmarks along.
/// (Those frames that became keyframes speak twice.)
Eigen::Vector3d FinalPoses::FromViews(const Map& map, std::span<const View> views,
                                      const Placed& landmark) const {
  const Pinhole ideal = map.camera().Ideal();
  Eigen::Vector3d p_world = landmark.p_world;
  for (int step = 0; step < kLandmarkSteps; ++step) {
    LandmarkEquations equations{landmark.information, landmark.information * (p_world - landmark.p_map)};
    for (const View& view : views) {
      const RotatedPose& camera = cameras_[view.frame];
      const Sight& sight = poses_[view.frame].sights[view.sight];
      equations.Add(ideal, camera.R, camera.R * p_world + camera.t, sight.uv_px.cast<double>(),
                    1.0 / map.pyramid_table().SigmaSquared(sight.octave));
    }
    const Eigen::Vector3d move = -SolveSymmetric(equations.information, equations.gradient);
    if (!move.allFinite()) return p_world;
    p_world += move;
  }
  return p_world;
}

void FinalPoses::PlaceLandmark(const Map& map, std::span<const View> views) {
  Placed& landmark = placed_[views.front().landmark];
  const Eigen::Vector3d wanted = FromViews(map, views, landmark);
  const Eigen::Vector3d beyond = landmark.p_world + kOverstep * (wanted - landmark.p_world);
  const double distance = (poses_[views.front().frame].pose.T_cam_world * landmark.p_map).norm();
  for (const Eigen::Vector3d& p_world : {beyond, wanted}) {
    if ((p_world - landmark.p_map).norm() > kMaxMove * distance || !IsInFront(views, p_world)) continue;
    landmark.p_world = p_world;
    return;
  }
}

void FinalPoses::ListSights(const Map& map) {
  seen_.assign(poses_.size(), {});
  for (size_t k = 0; k < poses_.size(); ++k) {
    for (const Sight& sight : poses_[k].sights) seen_[k].push_back({index_.at(sight.landmark), false});
  }
  SortViews();
  NoteWhoSawBefore();
  shared_.resize(poses_.size());
  ForEachInParallel(poses_.size(), threads_, [&](size_t k) { shared_[k] = SharedInformation(map, k); });
}

void FinalPoses::SortViews() {
  for (uint32_t frame = 0; frame < seen_.size(); ++frame) {
    for (uint32_t sight = 0; sight < seen_[frame].size(); ++sight) {
      views_.push_back({seen_[frame][sight].landmark, frame, sight});
    }
  }
  std::sort(views_.begin(), views_.end(), [](const View& a, const View& b) {
    return std::tie(a.landmark, a.frame, a.sight) < std::tie(b.landmark, b.frame, b.sight);
  });
}

void FinalPoses::NoteWhoSawBefore() {
  for (size_t i = 1; i < views_.size(); ++i) {
    const View &before = views_[i - 1], &view = views_[i];
    const bool same = before.landmark == view.landmark && before.frame != view.frame &&
                      poses_[before.frame].pose.map_id == poses_[view.frame].pose.map_id;
    seen_[view.frame][view.sight].seen_before = same && view.frame - before.frame <= kSharedFrames;
  }
}

void FinalPoses::PlaceSomeLandmarks(const Map& map) {
  if (next_ == 0) {
    cameras_.clear();
    for (const FinalPose& frame : poses_) {
      const Rigid3d& T_cam_world = frame.pose.T_cam_world;
      cameras_.push_back({T_cam_world.rotation.toRotationMatrix(), T_cam_world.translation});
    }
  }
  std::vector<std::span<const View>> landmarks;
  auto begin = views_.cbegin() + static_cast<ptrdiff_t>(next_);
  for (size_t n = 0; n < kLandmarksAtOnce && begin != views_.cend(); ++n) {
    const auto end =
        std::find_if(begin, views_.cend(), [begin](const View& v) { return v.landmark != begin->landmark; });
    if (end - begin >= kMinFrames) landmarks.emplace_back(begin, end);
    begin = end;
  }
  ForEachInParallel(landmarks.size(), threads_, [&](size_t i) { PlaceLandmark(map, landmarks[i]); });
  next_ = static_cast<size_t>(begin - views_.cbegin());
}

void FinalPoses::PlaceFrame(const Map& map, size_t index) {
  FinalPose* const frame = &poses_[index];
  PoseOptimizationOptions a_few_steps;  // the landmarks move again before the next
  a_few_steps.rounds = 2;
  a_few_steps.robust_rounds = 1;
  a_few_steps.iterations = 2;
  std::vector<PoseObservation> observations;
  observations.reserve(frame->sights.size());
  for (size_t i = 0; i < frame->sights.size(); ++i) {
    const Placed& landmark = placed_[seen_[index][i].landmark];
    observations.push_back(Observe(map.pyramid_table(), frame->sights[i], landmark.p_world));
  }
  const PoseOptimizationReport report =
      OptimizePose(map.camera().Ideal(), frame->pose.T_cam_world, observations, a_few_steps);
  if (!Agrees(report)) return;
  frame->measured = report.T_cam_world;
  frame->information = report.information;
}

void FinalPoses::PlaceSomeFrames(const Map& map) {
  const size_t count = std::min(kFramesAtOnce, poses_.size() - next_);
  ForEachInParallel(count, threads_, [&](size_t i) { PlaceFrame(map, next_ + i); });
  next_ += count;
}

}  // namespace dmslam
