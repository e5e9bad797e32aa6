#include "dmslam/map/keyframe.h"

#include <optional>
#include <utility>

namespace dmslam {

namespace {

/// Where keypoints have sigmas of their own, or the lens stretches the image.
void AddSigmas(const Camera& camera, const Pyramid& pyramid, FrameFeatures* features) {
  const FeatureSet& set = features->set;
  if (set.sigmas_px.empty() && !camera.Stretches()) return;
  const Pyramid of_images = pyramid.OfImages(camera.width_px, camera.height_px);
  for (size_t i = 0; i < set.size(); ++i) {
    const double raw_px = set.sigmas_px.empty() ? of_images.Sigma(set.keypoints[i].octave)
                                                : static_cast<double>(set.sigmas_px[i]);
    features->sigmas_px.push_back(static_cast<float>(raw_px * camera.StretchAt(features->uv_px[i])));
  }
}

}  // namespace

std::shared_ptr<const FrameFeatures> MakeFrameFeatures(FeatureSet set, const Camera& camera,
                                                       const Pyramid& pyramid) {
  auto features = std::make_shared<FrameFeatures>();
  const int num_levels = pyramid.OfImages(camera.width_px, camera.height_px).NumLevels();
  FeatureSet kept;
  kept.keypoints.reserve(set.size());
  kept.descriptors.reserve(set.size());
  const auto keep = [](const auto& from, size_t i, auto& to) {
    if (!from.empty()) to.push_back(from[i]);
  };
  features->uv_px.reserve(set.size());
  for (size_t i = 0; i < set.size(); ++i) {
    const Keypoint& keypoint = set.keypoints[i];
    if (keypoint.octave >= num_levels) continue;
    const std::optional<Eigen::Vector2d> uv = camera.Undistort({keypoint.x_px(), keypoint.y_px()});
    if (!uv) continue;
    kept.keypoints.push_back(keypoint);
    kept.descriptors.push_back(set.descriptors[i]);
    keep(set.depths_m, i, kept.depths_m);
    keep(set.depth_sigmas_m, i, kept.depth_sigmas_m);
    keep(set.sigmas_px, i, kept.sigmas_px);
    features->uv_px.push_back(*uv);
  }
  features->set = std::move(kept);
  AddSigmas(camera, pyramid, features.get());
  features->grid.Build(features->uv_px, features->set.keypoints, camera.width_px, camera.height_px);
  return features;
}

}  // namespace dmslam
