#include "dmslam/map/projection.h"

#include <algorithm>
#include <cmath>

namespace dmslam {

std::optional<LandmarkView> PredictView(const Map& map, const Landmark& landmark, const Rigid3d& T_cam_world,
                                        const ViewLimits& limits) {
  const Camera& camera = map.camera();
  const Eigen::Vector3d p_cam = T_cam_world * landmark.p_world;
  const std::optional<Eigen::Vector2d> uv = camera.Project(p_cam);
  if (!uv || uv->x() < -limits.border_px || uv->y() < -limits.border_px ||
      uv->x() >= camera.width_px + limits.border_px || uv->y() >= camera.height_px + limits.border_px) {
    return std::nullopt;
  }
  const ViewingRange viewing = map.Viewing(landmark);
  const Eigen::Vector3d ray = landmark.p_world - T_cam_world.Center();
  const double distance = ray.norm();
  if (distance < viewing.min_distance / limits.distance_slack ||
      distance > viewing.max_distance * limits.distance_slack) {
    return std::nullopt;
  }
  const double view_cos = ray.dot(viewing.mean_direction) / distance;
  if (view_cos < limits.min_view_cos) return std::nullopt;
  const Pyramid& pyramid = map.pyramid();
  const double octave = std::ceil(std::log(viewing.max_distance / distance) / std::log(pyramid.scale_factor));
  return LandmarkView{*uv, p_cam.z(), view_cos,
                      static_cast<int>(std::clamp(octave, 0.0, pyramid.levels - 1.0))};
}

std::optional<FeatureHit> FindFeature(const FrameFeatures& features, const Eigen::Vector2d& uv_px,
                                      double radius_px, int min_octave, int max_octave,
                                      const Descriptor& descriptor, const std::vector<uint8_t>& taken) {
  std::optional<FeatureHit> hit;
  features.grid.ForEachInRadius(uv_px, radius_px, min_octave, max_octave, [&](uint32_t i) {
    if (!taken.empty() && taken[i] != 0) return;
    const int distance = HammingDistance(descriptor, features.set.descriptors[i]);
    const FeatureHit found{static_cast<int>(i), distance, features.set.keypoints[i].octave};
    if (!hit) {
      hit = found;
    } else if (distance < hit->distance || (distance == hit->distance && found.feature < hit->feature)) {
      hit = FeatureHit{found.feature, distance, found.octave, hit->distance, hit->octave};
    } else if (distance < hit->second_distance) {
      hit->second_distance = distance;
      hit->second_octave = found.octave;
    }
  });
  return hit;
}

}  // namespace dmslam
