#include "dmslam/triangulation/keyframe_points.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "dmslam/geometry/triangulation.h"
#include "dmslam/map/projection.h"
#include "dmslam/triangulation/epipolar_matches.h"

namespace dmslam {
namespace {

struct PairGeometry {
  const Keyframe& a;
  const Keyframe& b;
  const Map& map;
  const TriangulationOptions& options;
  double max_parallax_cos = 1;
};

/// Tests one candidate: parallax, depth, reprojection and scale (paper 2.2; ORB-SLAM2's constants).
std::optional<Eigen::Vector3d> Triangulate(const PairGeometry& pair, uint16_t feature_a, uint16_t feature_b,
                                           TriangulationCounts* counts) {
  const Camera& camera = pair.map.camera();
  const Pyramid& pyramid = pair.map.pyramid();
  const Eigen::Vector3d ray_a = camera.Ray(pair.a.features->uv_px[feature_a]);
  const Eigen::Vector3d ray_b = camera.Ray(pair.b.features->uv_px[feature_b]);
  const Eigen::Vector3d world_a = pair.a.T_cam_world.rotation.conjugate() * ray_a;
  const Eigen::Vector3d world_b = pair.b.T_cam_world.rotation.conjugate() * ray_b;
  const double parallax_cos = world_a.dot(world_b) / (world_a.norm() * world_b.norm());
  if (!(parallax_cos > 0 && parallax_cos < pair.max_parallax_cos)) {
    ++counts->refused_parallax;
    return std::nullopt;
  }
  std::optional<Eigen::Vector3d> point =
      TriangulatePoint(pair.a.T_cam_world, pair.b.T_cam_world, ray_a, ray_b);
  const auto uv_a = point ? camera.Project(pair.a.T_cam_world * *point) : std::nullopt;
  const auto uv_b = point ? camera.Project(pair.b.T_cam_world * *point) : std::nullopt;
  if (!uv_a || !uv_b) {
    ++counts->refused_depth;
    return std::nullopt;
  }
  if (NormalizedErrorSquared(*pair.a.features, feature_a, *uv_a, pyramid) >
          pair.options.reprojection_sigmas_squared ||
      NormalizedErrorSquared(*pair.b.features, feature_b, *uv_b, pyramid) >
          pair.options.reprojection_sigmas_squared) {
    ++counts->refused_reprojection;
    return std::nullopt;
  }
  const double distance_ratio =
      (*point - pair.b.T_cam_world.Center()).norm() / (*point - pair.a.T_cam_world.Center()).norm();
  const double octave_ratio = pyramid.Scale(pair.a.features->set.keypoints[feature_a].octave) /
                              pyramid.Scale(pair.b.features->set.keypoints[feature_b].octave);
  const double slack = pair.options.scale_ratio_slack * pyramid.scale_factor;
  if (distance_ratio * slack < octave_ratio || distance_ratio > octave_ratio * slack) {
    ++counts->refused_scale;
    return std::nullopt;
  }
  return point;
}

/// A feature of the keyframe matched with one of a neighbour, and the point they make.
struct PairCandidate {
  NeighbourFeature seen_by;
  Eigen::Vector3d p_world;
  double parallax_cos;
};

/// A camera that turns more than it moves sees nothing under a large angle for long, and is lost where
/// people hide what it knows: a point whose depth is hardly known still holds its rotation, and the next
/// keyframes mend it. Where the map grows into the past nothing hurries.
double MinParallaxRad(const Map& map, const Keyframe& keyframe, const TriangulationOptions& options) {
  const bool newest = map.NewestKeyframeOf(keyframe.id.camera()) == &keyframe;
  return newest ? options.min_parallax_rad : options.min_past_parallax_rad;
}

/// All pairs of every free feature of a keyframe, by feature.
std::vector<std::vector<PairCandidate>> MatchNeighbours(const Map& map, const Keyframe& keyframe,
                                                        const std::vector<uint8_t>& use,
                                                        const TriangulationOptions& options,
                                                        TriangulationCounts* counts) {
  const double max_parallax_cos = std::cos(MinParallaxRad(map, keyframe, options));
  std::vector<std::vector<PairCandidate>> pairs(keyframe.features->size());
  for (const Keyframe* neighbour : map.BestCovisible(keyframe, options.neighbours, 1)) {
    const double baseline = (keyframe.T_cam_world.Center() - neighbour->T_cam_world.Center()).norm();
    const std::optional<double> depth = map.MedianDepth(*neighbour);
    if (!depth || baseline < options.min_baseline_over_depth * *depth) continue;
    const PairGeometry pair{keyframe, *neighbour, map, options, max_parallax_cos};
    for (const auto& [feature, other] : MatchAlongEpipolarPlanes(
             keyframe, use, *neighbour, FreeFeatures(*neighbour), map, options.matches)) {
      ++counts->matched;
      const std::optional<Eigen::Vector3d> point = Triangulate(pair, feature, other, counts);
      if (!point) continue;
      const Eigen::Vector3d a = *point - keyframe.T_cam_world.Center(),
                            b = *point - neighbour->T_cam_world.Center();
      pairs[feature].push_back({{neighbour, other}, *point, a.dot(b) / (a.norm() * b.norm())});
    }
  }
  return pairs;
}

/// The point of the pair with the widest parallax, with all pairs of the feature that see it where they
/// should.
KeyframePoint CombinePairs(const Map& map, const Keyframe& keyframe, uint16_t feature,
                           const std::vector<PairCandidate>& pairs, const TriangulationOptions& options) {
  const auto widest = std::min_element(
      pairs.begin(), pairs.end(),
      [](const PairCandidate& a, const PairCandidate& b) { return a.parallax_cos < b.parallax_cos; });
  KeyframePoint point{feature, {widest->seen_by}, widest->p_world};
  int64_t first_ns = keyframe.stamp_ns, last_ns = first_ns;
  for (auto pair = pairs.begin(); pair != pairs.end(); ++pair) {
    const Keyframe& neighbour = *pair->seen_by.keyframe;
    const auto uv_px = map.camera().Project(neighbour.T_cam_world * widest->p_world);
    const bool agrees = uv_px && NormalizedErrorSquared(*neighbour.features, pair->seen_by.feature, *uv_px,
                                                        map.pyramid()) <= options.reprojection_sigmas_squared;
    if (pair != widest && !agrees) continue;
    if (pair != widest) point.seen_by.push_back(pair->seen_by);
    first_ns = std::min(first_ns, neighbour.stamp_ns);
    last_ns = std::max(last_ns, neighbour.stamp_ns);
  }
  point.span_ns = last_ns - first_ns;
  return point;
}

}  // namespace

std::vector<uint8_t> FreeFeatures(const Keyframe& keyframe) {
  std::vector<uint8_t> use(keyframe.features->size(), 1);
  for (size_t i = 0; i < use.size(); ++i) {
    if (keyframe.landmarks[i].valid()) use[i] = 0;
  }
  return use;
}

std::vector<KeyframePoint> TriangulateKeyframe(const Map& map, const Keyframe& keyframe,
                                               const std::vector<uint8_t>& use,
                                               const TriangulationOptions& options,
                                               TriangulationCounts* counts) {
  std::vector<KeyframePoint> points;
  const auto pairs = MatchNeighbours(map, keyframe, use, options, counts);
  for (size_t feature = 0; feature < pairs.size(); ++feature) {
    if (pairs[feature].empty()) continue;
    points.push_back(CombinePairs(map, keyframe, static_cast<uint16_t>(feature), pairs[feature], options));
  }
  return points;
}

}  // namespace dmslam
