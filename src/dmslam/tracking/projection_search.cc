#include "dmslam/tracking/projection_search.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>

#include "dmslam/camera/image_scale.h"

namespace dmslam {
namespace {

constexpr int kTurnBins = 30;
constexpr int kMaxKeyframeDistance = 50;    // bits, without a position
constexpr double kMaxKeyframeRatio = 0.75;  // best over second best descriptor distance
constexpr double kFrontalCos = 0.998;
constexpr int kMaxKeyframeSecond = FarthestSecond(kMaxKeyframeDistance, kMaxKeyframeRatio);

}  // namespace

const std::vector<LandmarkMatch>& ProjectionSearch::MatchFrame(const Map& map, const LandmarkVotes& votes,
                                                               const TrackedFrame& last,
                                                               const Rigid3d& T_cam_world, double radius_px,
                                                               const FrameFeatures& features) {
  matches_.clear();
  turns_.clear();
  taken_.assign(features.size(), 0);
  for (size_t i = 0; i < last.landmarks.size(); ++i) {
    if (!last.landmarks[i].valid()) continue;
    const Landmark* landmark = map.Resolve(last.landmarks[i]);
    if (landmark == nullptr || !votes.HasVote(*landmark)) continue;
    const std::optional<Eigen::Vector2d> uv = map.camera().Project(T_cam_world * landmark->p_world);
    if (!uv) continue;
    const Keypoint& seen = last.features->set.keypoints[i];
    const std::optional<FeatureHit> hit = FindFeature(
        features, *uv, radius_px * map.pyramid_table().SearchScale(seen.octave), seen.octave - 1,
        seen.octave + 1, last.features->set.descriptors[i], taken_, options_.max_descriptor_distance);
    if (!hit) continue;
    const size_t feature = static_cast<size_t>(hit->feature);
    taken_[feature] = 1;
    matches_.push_back({static_cast<uint16_t>(feature), landmark});
    turns_.push_back(
        static_cast<float>(static_cast<uint8_t>(features.set.keypoints[feature].angle - seen.angle)));
  }
  KeepConsistentTurns();
  return matches_;
}

/// Keeps the matches whose keypoints turned as most others did (three best of thirty bins, as in ORB-SLAM2).
void ProjectionSearch::KeepConsistentTurns() {
  std::array<int, kTurnBins> counts{};
  const auto bin_of = [](float turn) { return static_cast<size_t>(turn * kTurnBins / 256.0F) % kTurnBins; };
  for (const float turn : turns_) ++counts[bin_of(turn)];
  std::array<int, kTurnBins> sorted = counts;
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  const int least = std::max(sorted[2], sorted[0] / 10);
  size_t kept = 0;
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (counts[bin_of(turns_[i])] >= std::max(1, least)) matches_[kept++] = matches_[i];
  }
  matches_.resize(kept);
}

const std::vector<LandmarkMatch>& ProjectionSearch::MatchKeyframe(const Map& map, const LandmarkVotes& votes,
                                                                  const Keyframe& keyframe,
                                                                  const FrameFeatures& features) {
  const Camera& camera = map.camera();
  const Eigen::Vector2d middle_px(camera.width_px / 2.0, camera.height_px / 2.0);
  matches_.clear();
  taken_.assign(features.size(), 0);
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* landmark =
        keyframe.landmarks[i].valid() ? map.FindLandmark(keyframe.landmarks[i]) : nullptr;
    if (landmark == nullptr || !votes.HasVote(*landmark)) continue;
    const std::optional<FeatureHit> hit =
        FindFeature(features, middle_px, 2.0 * camera.width_px, 0, map.pyramid().NumLevels() - 1,
                    keyframe.features->set.descriptors[i], taken_, kMaxKeyframeSecond);
    if (!hit || hit->distance > kMaxKeyframeDistance) continue;
    if (hit->distance > kMaxKeyframeRatio * hit->second_distance) continue;
    taken_[static_cast<size_t>(hit->feature)] = 1;
    matches_.push_back({static_cast<uint16_t>(hit->feature), landmark});
  }
  return matches_;
}

std::span<const ExpectedLandmark> ProjectionSearch::MatchLandmarks(const Map& map, const LandmarkVotes& votes,
                                                                   std::span<const LandmarkId> landmarks,
                                                                   double wider, TrackedFrame* frame) {
  ListMatched(*frame, &matched_);
  MarkMatched(*frame, &taken_);
  expected_.clear();
  const double oblique_px = wider * SearchRadiusPx(map.camera(), options_.local_radius_rad);
  const double frontal_px = wider * SearchRadiusPx(map.camera(), options_.local_radius_frontal_rad);
  const int farthest = FarthestSecond(options_.max_descriptor_distance, options_.local_ratio);
  const Viewpoint viewpoint(frame->T_cam_world);
  map.ForEachOf(landmarks, [&](const Landmark& landmark) {
    const std::optional<LandmarkView> view = PredictView(map, landmark, viewpoint);
    if (!view) return;
    expected_.push_back({&landmark, *view});
    if (!votes.HasVote(landmark) || matched_.Holds(landmark.id)) return;
    const double radius_px = view->view_cos > kFrontalCos ? frontal_px : oblique_px;
    const std::optional<FeatureHit> hit =
        FindFeature(*frame->features, view->uv_px,
                    radius_px * map.pyramid_table().SearchScale(static_cast<uint8_t>(view->octave)),
                    view->octave - 1, view->octave, landmark.descriptor, taken_, farthest);
    if (!hit || hit->distance > options_.max_descriptor_distance) return;
    if (hit->octave == hit->second_octave && hit->distance > options_.local_ratio * hit->second_distance)
      return;
    frame->landmarks[static_cast<size_t>(hit->feature)] = landmark.id;
    taken_[static_cast<size_t>(hit->feature)] = 1;
  });
  return expected_;
}

}  // namespace dmslam
