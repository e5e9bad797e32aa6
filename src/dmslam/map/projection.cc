#include "dmslam/map/projection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "dmslam/features/hamming.h"

namespace dmslam {

std::optional<LandmarkView> PredictView(const Map& map, const Landmark& landmark, const Viewpoint& from,
                                        const ViewLimits& limits) {
  const Camera& camera = map.camera();
  const Eigen::Vector3d p_cam = from.T_cam_world * landmark.p_world;
  const std::optional<Eigen::Vector2d> uv = camera.Project(p_cam);
  if (!uv || uv->x() < -limits.border_px || uv->y() < -limits.border_px ||
      uv->x() >= camera.width_px + limits.border_px || uv->y() >= camera.height_px + limits.border_px) {
    return std::nullopt;
  }
  const ViewingRange viewing = map.Viewing(landmark);
  const Eigen::Vector3d ray = landmark.p_world - from.center;
  const double distance = ray.norm();
  if (distance < viewing.min_distance / limits.distance_slack ||
      distance > viewing.max_distance * limits.distance_slack) {
    return std::nullopt;
  }
  const double view_cos = ray.dot(viewing.mean_direction) / distance;
  if (view_cos < limits.min_view_cos) return std::nullopt;
  const double octave = std::ceil(map.LevelOf(viewing.max_distance / distance));
  return LandmarkView{*uv, p_cam.z(), view_cos,
                      static_cast<int>(std::clamp(octave, 0.0, map.pyramid().NumLevels() - 1.0))};
}

namespace {

/// The nearest feature and the next best, of those that are offered.
class TwoNearest {
 public:
  void Offer(const FrameFeatures& features, uint32_t feature, int distance) {
    const int index = static_cast<int>(feature);
    if (!hit_) {
      hit_ = FeatureHit{index, distance, features.set.keypoints[feature].octave};
    } else if (distance < hit_->distance || (distance == hit_->distance && index < hit_->feature)) {
      hit_ =
          FeatureHit{index, distance, features.set.keypoints[feature].octave, hit_->distance, hit_->octave};
    } else if (distance < hit_->second_distance) {
      hit_->second_distance = distance;
      hit_->second_octave = features.set.keypoints[feature].octave;
    }
  }
  const std::optional<FeatureHit>& hit() const { return hit_; }

 private:
  std::optional<FeatureHit> hit_;
};

}  // namespace

std::optional<FeatureHit> FindFeature(const FrameFeatures& features, const Eigen::Vector2d& uv_px,
                                      double radius_px, int min_octave, int max_octave,
                                      const Descriptor& descriptor, const std::vector<uint8_t>& taken,
                                      int max_distance) {
  const HammingKeepNear keep_near = BestHammingKernels().keep_near;
  TwoNearest nearest;
  std::array<uint16_t, FeatureGrid::kBatch> distances;
  const auto compare = [&](std::span<uint32_t> batch) {
    const int near = keep_near(descriptor, features.set.descriptors.data(), batch.data(),
                               static_cast<int>(batch.size()), max_distance, distances.data());
    for (size_t k = 0; k < static_cast<size_t>(near); ++k) {
      if (taken.empty() || taken[batch[k]] == 0) nearest.Offer(features, batch[k], distances[k]);
    }
  };
  features.grid.ForEachBatchInRadius(uv_px, radius_px, min_octave, max_octave, compare);
  return nearest.hit();
}

}  // namespace dmslam
