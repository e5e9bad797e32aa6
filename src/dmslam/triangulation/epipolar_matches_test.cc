#include "dmslam/triangulation/epipolar_matches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/features/hamming.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kFeatures = 1500;
using Matches = std::vector<std::pair<uint16_t, uint16_t>>;

/// Two keyframes with features all over their images, of a few kinds that look much alike.
class EpipolarMatches : public testing::TestWithParam<Eigen::Vector3d> {
 protected:
  EpipolarMatches() : map_(TestCamera(), Pyramid()) {
    Rigid3d T_b_world;
    T_b_world.rotation = ExpSo3({0.02, -0.03, 0.05});
    T_b_world.translation = -(T_b_world.rotation * GetParam());
    a_ = Add(0, Rigid3d());
    b_ = Add(1, T_b_world);
    use_.assign(kFeatures, 1);
    for (size_t i = 0; i < use_.size(); i += 7) use_[i] = 0;
  }

  KeyframeId Add(uint32_t index, const Rigid3d& T_cam_world) {
    FeatureSet features;
    for (int i = 0; i < kFeatures; ++i) {
      Keypoint keypoint;
      keypoint.x_q4 = static_cast<uint16_t>(16 * random_.Uniform(5, 635));
      keypoint.y_q4 = static_cast<uint16_t>(16 * random_.Uniform(5, 475));
      keypoint.octave = static_cast<uint8_t>(random_.Uniform(0, 7.99));
      Descriptor descriptor{};
      descriptor.words[0] = static_cast<uint64_t>(random_.Uniform(0, 65535.99));
      features.keypoints.push_back(keypoint);
      features.descriptors.push_back(descriptor);
    }
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, index);
    keyframe.map_id = 1;
    keyframe.T_cam_world = T_cam_world;
    keyframe.features = MakeFrameFeatures(features, map_.camera(), map_.pyramid());
    keyframe.landmarks.resize(keyframe.features->size());
    map_.AddKeyframe(std::move(keyframe));
    return KeyframeId::Make(1, index);
  }

  /// A feature's plane through both centres, and its ray in that.
  struct Ray {
    double plane, across, along, tolerance;
    int octave;
  };
  Ray RayOf(const Keyframe& keyframe, size_t feature) const {
    const Eigen::Vector3d axis = GetParam().normalized();
    const Eigen::Vector3d helper =
        std::abs(axis.y()) < 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
    const Eigen::Vector3d u = axis.cross(helper).normalized(), v = axis.cross(u);
    const Eigen::Vector3d ray =
        (keyframe.T_cam_world.rotation.conjugate() * map_.camera().Ray(keyframe.features->uv_px[feature]))
            .normalized();
    const int octave = keyframe.features->set.keypoints[feature].octave;
    const double across = std::hypot(ray.dot(u), ray.dot(v));
    return {std::atan2(ray.dot(v), ray.dot(u)), across, ray.dot(axis),
            map_.pyramid().Sigma(octave) / (map_.camera().fx_px * across), octave};
  }
  bool Fit(const Ray& a, const Ray& b, const EpipolarMatchOptions& options) const {
    const double apart = std::abs(std::remainder(a.plane - b.plane, 2 * std::numbers::pi));
    return a.across >= 0.02 && b.across >= 0.02 && std::abs(a.octave - b.octave) <= 3 &&
           apart <= 6 * a.tolerance + 0.02 &&
           apart <= std::sqrt(options.sigmas_squared) * std::hypot(a.tolerance, b.tolerance) &&
           std::atan2(b.across, b.along) > std::atan2(a.across, a.along);
  }
  std::vector<Ray> RaysOf(const Keyframe& keyframe) const {
    std::vector<Ray> rays;
    rays.reserve(kFeatures);
    for (size_t i = 0; i < kFeatures; ++i) rays.push_back(RayOf(keyframe, i));
    return rays;
  }
  /// Each feature compared with each.
  Matches Compared(const EpipolarMatchOptions& options) const {
    const Keyframe &a = map_.At(a_), &b = map_.At(b_);
    const std::vector<Ray> rays_a = RaysOf(a), rays_b = RaysOf(b);
    std::map<uint16_t, std::pair<int, uint16_t>> partners;  // of features of b: the nearest of a
    for (uint16_t i = 0; i < kFeatures; ++i) {
      if (use_[i] == 0) continue;
      int best = kNoDistance, second = kNoDistance;
      uint16_t partner = 0;
      for (uint16_t k = 0; k < kFeatures; ++k) {
        if (use_[k] == 0 || !Fit(rays_a[i], rays_b[k], options)) continue;
        const int distance = HammingDistance(a.features->set.descriptors[i], b.features->set.descriptors[k]);
        if (distance < best) {
          second = std::exchange(best, distance);
          partner = k;
        } else if (distance < second) {
          second = distance;
        }
      }
      if (best > options.max_descriptor_distance || best >= options.descriptor_ratio * second) continue;
      const auto [at, is_new] = partners.try_emplace(partner, best, i);
      if (!is_new && best < at->second.first) at->second = {best, i};
    }
    Matches matches;
    for (const auto& [of_b, of_a] : partners) matches.emplace_back(of_a.second, of_b);
    std::sort(matches.begin(), matches.end());
    return matches;
  }

  Random random_{5};
  MapEditor map_;
  KeyframeId a_, b_;
  std::vector<uint8_t> use_;
};

TEST_P(EpipolarMatches, AreThoseOfEachFeatureWithEach) {
  const EpipolarMatchOptions options;
  const Matches matches = MatchAlongEpipolarPlanes(map_.At(a_), use_, map_.At(b_), use_, map_, options);
  EXPECT_GT(matches.size(), 50u);
  EXPECT_EQ(matches, Compared(options));
}

INSTANTIATE_TEST_SUITE_P(Motions, EpipolarMatches,
                         testing::Values(Eigen::Vector3d(0.3, 0, 0),          // planes within a fan
                                         Eigen::Vector3d(-0.1, 0.4, 0.02),    //
                                         Eigen::Vector3d(0.02, 0.01, 0.5)));  // all around, rays along it too

}  // namespace
}  // namespace dmslam
