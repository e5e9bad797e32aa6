#include "dmslam/dynamics/moved_landmarks.h"

#include <optional>

#include "dmslam/camera/image_scale.h"

namespace dmslam {

const std::vector<LandmarkId>& MovedLandmarks::Find(const Map& map,
                                                    std::span<const ExpectedLandmark> expected,
                                                    std::span<const RejectedMatch> rejected,
                                                    TrackedFrame* frame) {
  ListMatched(*frame, &used_);
  MarkMatched(*frame, &taken_);
  moved_.clear();
  features_.clear();
  JudgeRejected(map, rejected, frame);
  used_.Finish();
  for (const ExpectedLandmark& landmark : expected) {
    if (!used_.Holds(landmark.id())) LookAround(map, landmark, frame);
  }
  return moved_;
}

/// A match that looks right and lies beside its place.
void MovedLandmarks::JudgeRejected(const Map& map, std::span<const RejectedMatch> rejected,
                                   TrackedFrame* frame) {
  for (const RejectedMatch& match : rejected) {
    const Landmark& landmark = map.At(match.landmark);
    const int distance =
        HammingDistance(landmark.descriptor, frame->features->set.descriptors[match.feature]);
    if (match.chi2 < kNearChi2 || distance > kNearDistance) continue;
    moved_.push_back(match.landmark);
    features_.push_back(match.feature);
    used_.Add(match.landmark);
    taken_[match.feature] = 1;
    frame->classes[match.feature] = FeatureClass::kMoving;
  }
}

/// One that is missed in its place and found in the neighbourhood, where nothing else looks like it.
void MovedLandmarks::LookAround(const Map& map, const ExpectedLandmark& expected, TrackedFrame* frame) {
  const Landmark& landmark = *expected.landmark;
  const std::optional<Eigen::Vector2d> uv = map.camera().Project(frame->T_cam_world * landmark.p_world);
  if (!uv) return;
  const std::optional<FeatureHit> hit = FindFeature(
      *frame->features, *uv, SearchRadiusPx(map.camera(), kRadiusRad), expected.view.octave - 1,
      expected.view.octave + 1, landmark.descriptor, taken_, FarthestSecond(kMaxDistance, kRatio));
  if (!hit || hit->distance > kMaxDistance) return;
  if (hit->distance > kRatio * hit->second_distance) return;
  if (NormalizedErrorSquared(*frame->features, hit->feature, *uv, map.pyramid()) < kChi2) return;
  moved_.push_back(landmark.id);
  features_.push_back(static_cast<uint16_t>(hit->feature));
  frame->classes[static_cast<size_t>(hit->feature)] = FeatureClass::kMoving;
}

}  // namespace dmslam
