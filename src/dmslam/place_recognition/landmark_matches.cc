#include "dmslam/place_recognition/landmark_matches.h"

#include "dmslam/features/matcher.h"
#include "dmslam/place_recognition/map_places.h"

namespace dmslam {
namespace {

constexpr MatchOptions kByDescriptor = {.max_ratio = 0.8, .check_orientation = false};

}  // namespace

std::vector<LandmarkMatch> MatchLandmarks(const std::vector<const Landmark*>& landmarks,
                                          const FeatureSet& features) {
  std::vector<Descriptor> descriptors;
  descriptors.reserve(landmarks.size());
  for (const Landmark* landmark : landmarks) descriptors.push_back(landmark->descriptor);
  const std::vector<Keypoint> anywhere(landmarks.size());
  std::vector<FeatureMatch> found;
  FeatureMatcher().MatchAll({anywhere, descriptors}, {features.keypoints, features.descriptors},
                            kByDescriptor, &found);
  std::vector<LandmarkMatch> matches;
  matches.reserve(found.size());
  for (const FeatureMatch& match : found) {
    matches.push_back({static_cast<uint16_t>(match.index1), landmarks[match.index0]});
  }
  return matches;
}

RansacReport<Rigid3d> PoseFromLandmarks(const Map& map, const FrameFeatures& features,
                                        const std::vector<LandmarkMatch>& matches,
                                        const PoseRansacOptions& options) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> inv_sigma_squared;
  for (const LandmarkMatch& match : matches) {
    points.push_back(match.landmark->p_world);
    pixels.push_back(features.uv_px[match.feature]);
    inv_sigma_squared.push_back(1.0 / features.Variance(match.feature, map.pyramid()));
  }
  return PoseFromMatches(map.camera().Ideal(), points, pixels, inv_sigma_squared, options);
}

}  // namespace dmslam
