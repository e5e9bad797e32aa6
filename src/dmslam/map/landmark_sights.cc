#include "dmslam/map/landmark_sights.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

std::optional<double> ErrorPx(const Map& map, const Keyframe& keyframe, uint16_t feature,
                              const Eigen::Vector3d& p_world) {
  const auto uv_px = map.camera().Project(keyframe.T_cam_world * p_world);
  if (!uv_px) return std::nullopt;
  return (*uv_px - keyframe.features->uv_px[feature]).norm();
}

}  // namespace

std::vector<LandmarkSight> SightsOf(const Map& map, const Landmark& landmark) {
  std::vector<LandmarkSight> sights;
  sights.reserve(landmark.observations.size());
  for (const Observation& o : landmark.observations) {
    const Keyframe& keyframe = map.At(o.keyframe);
    sights.push_back({o.keyframe, keyframe.stamp_ns, o.feature, keyframe.features->set.keypoints[o.feature],
                      ErrorPx(map, keyframe, o.feature, landmark.p_world)});
  }
  return sights;
}

std::optional<WidestAngle> WidestAngleWith(const Map& map, const Landmark& landmark, KeyframeId from) {
  const Keyframe* viewer = map.FindKeyframe(from);
  if (viewer == nullptr) return std::nullopt;
  const Eigen::Vector3d ray = landmark.p_world - viewer->T_cam_world.Center();
  std::optional<WidestAngle> widest;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == from) continue;
    const Eigen::Vector3d other = landmark.p_world - map.At(o.keyframe).T_cam_world.Center();
    const double rad = std::atan2(ray.cross(other).norm(), ray.dot(other));
    if (!widest || rad > widest->rad) widest = WidestAngle{o.keyframe, rad};
  }
  return widest;
}

}  // namespace dmslam
