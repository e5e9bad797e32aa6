#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>
#include <vector>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/geometry/two_view.h"
#include "dmslam/robust/pose_from_matches.h"
#include "dmslam/robust/ransac.h"
#include "dmslam/robust/two_view_ransac.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {
namespace {

const Pinhole kCamera = SyntheticScene().camera;

struct OutlierPair {
  SyntheticViews pair;
  std::vector<char> is_outlier;
};

/// Every third match leads to a random place.
OutlierPair PairWithOutliers(uint64_t seed) {
  OutlierPair data;
  data.pair =
      MakeSyntheticViews(MakeSyntheticScene({.seed = seed, .num_points = 240, .noise_px = 0.5, .step = 0.5}));
  Random random(seed + 1000);
  for (size_t i = 0; i < data.pair.x2_px.size(); ++i) {
    data.is_outlier.push_back(i % 3 == 0);
    if (i % 3 == 0) data.pair.x2_px[i] = {random.Uniform(0, 640), random.Uniform(0, 480)};
  }
  return data;
}

double ShareFound(const OutlierPair& data, const std::vector<char>& inliers) {
  double good = 0, found = 0;
  for (size_t i = 0; i < inliers.size(); ++i) {
    if (data.is_outlier[i]) continue;
    ++good;
    found += inliers[i];
  }
  return found / good;
}

TEST(RansacLoop, IterationsFollowTheFormula) {
  EXPECT_EQ(RansacIterations(0.5, 8, 0.99, 100000),
            static_cast<int>(std::ceil(std::log(0.01) / std::log(1 - 1.0 / 256))));
  EXPECT_EQ(RansacIterations(1.0, 8, 0.99, 500), 1);
  EXPECT_EQ(RansacIterations(0.0, 8, 0.99, 500), 500);
}

TEST(RansacLoop, SamplesHoldDifferentNumbersInRange) {
  Random random(1);
  std::set<int> seen;
  for (int k = 0; k < 500; ++k) {
    std::array<int, 5> sample;
    DrawSample<5>(random, 7, sample);
    EXPECT_EQ(std::set<int>(sample.begin(), sample.end()).size(), 5u);
    seen.insert(sample.begin(), sample.end());
  }
  EXPECT_EQ(*seen.begin(), 0);
  EXPECT_EQ(*seen.rbegin(), 6);
}

TEST(RansacLoop, TooFewDataIsNoSuccess) {
  const std::vector<Eigen::Vector2d> x(4, Eigen::Vector2d(1, 1));
  EXPECT_FALSE(EssentialFromMatches(kCamera, x, x, {}, {}).success);
  EXPECT_FALSE(PoseFromMatches(kCamera, {}, {}, {}, {}).success);
}

TEST(TwoViewRansac, EssentialFindsInliersAndPose) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const OutlierPair data = PairWithOutliers(seed);
    const auto report =
        EssentialFromMatches(kCamera, data.pair.x1_px, data.pair.x2_px, {}, {.ransac = {.seed = seed}});
    ASSERT_TRUE(report.success);
    EXPECT_GT(ShareFound(data, report.inliers), 0.95);
    std::vector<int> inliers;
    for (size_t i = 0; i < report.inliers.size(); ++i) {
      if (report.inliers[i]) inliers.push_back(static_cast<int>(i));
    }
    Rigid3d T;
    PoseFromEssential(report.model, data.pair.rays1, data.pair.rays2, inliers, T);
    EXPECT_LT(AngleBetween(T.rotation, data.pair.T_cam2_cam1.rotation), 0.02);
  }
}

TEST(TwoViewRansac, SigmaWidensTheBound) {
  const OutlierPair data = PairWithOutliers(4);
  const std::vector<double> large(data.pair.x1_px.size(), 1e8);
  const auto report =
      EssentialFromMatches(kCamera, data.pair.x1_px, data.pair.x2_px, large, {.ransac = {.seed = 3}});
  EXPECT_EQ(report.num_inliers, static_cast<int>(data.pair.x1_px.size()));
}

struct PnpData {
  Rigid3d T_cam_world;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> uv_px;
};

PnpData PnpWithOutliers(uint64_t seed) {
  const SyntheticScene scene =
      MakeSyntheticScene({.seed = seed, .num_cameras = 1, .num_points = 150, .noise_px = 0.7});
  PnpData data{scene.T_cam_world[0], {}, {}};
  Random random(seed + 77);
  for (const auto& o : scene.observations) {
    data.points.push_back(scene.points[static_cast<size_t>(o.point)]);
    data.uv_px.push_back(o.point % 2 ? Eigen::Vector2d(random.Uniform(0, 640), random.Uniform(0, 480))
                                     : o.uv_px);
  }
  return data;
}

TEST(PoseFromMatches, SurvivesHalfOutliers) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const PnpData data = PnpWithOutliers(seed);
    const auto report = PoseFromMatches(kCamera, data.points, data.uv_px, {}, {.seed = seed});
    ASSERT_TRUE(report.success);
    EXPECT_LT(AngleBetween(report.model.rotation, data.T_cam_world.rotation), 0.01);
    EXPECT_LT((report.model.Center() - data.T_cam_world.Center()).norm(), 0.05);
    EXPECT_LT(report.iterations, 150);
  }
}

TEST(PoseFromMatches, SameSeedSameBytes) {
  const PnpData data = PnpWithOutliers(9);
  const auto a = PoseFromMatches(kCamera, data.points, data.uv_px, {}, {.seed = 5});
  const auto b = PoseFromMatches(kCamera, data.points, data.uv_px, {}, {.seed = 5});
  EXPECT_EQ(std::memcmp(&a.model, &b.model, sizeof(double) * 7), 0);
  EXPECT_EQ(a.inliers, b.inliers);
}

TEST(PoseFromMatches, OnlyNoiseIsNoSuccess) {
  Random random(3);
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> uv;
  for (int i = 0; i < 60; ++i) {
    points.push_back(RandomVector(random, 3.0));
    uv.emplace_back(random.Uniform(0, 640), random.Uniform(0, 480));
  }
  EXPECT_FALSE(PoseFromMatches(kCamera, points, uv, {}, {.min_inliers = 10}).success);
}

}  // namespace
}  // namespace dmslam
