#include "dmslam/geometry/absolute_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "dmslam/geometry/pose_normal.h"
#include "dmslam/geometry/synthetic_scene.h"

namespace dmslam {
namespace {

double PoseDistance(const Rigid3d& a, const Rigid3d& b) {
  return AngleBetween(a.rotation, b.rotation) + (a.translation - b.translation).norm();
}

struct PnpData {
  Rigid3d T_cam_world;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> uv_px;
};

PnpData DataOf(uint64_t seed, double noise_px) {
  const SyntheticScene scene =
      MakeSyntheticScene({.seed = seed, .num_cameras = 1, .num_points = 80, .noise_px = noise_px});
  PnpData data{scene.T_cam_world[0], {}, {}};
  for (const auto& o : scene.observations) {
    data.points.push_back(scene.points[static_cast<size_t>(o.point)]);
    data.uv_px.push_back(o.uv_px);
  }
  return data;
}

TEST(P3p, OneOfTheSolutionsIsTrueAndAllReproject) {
  Random random(1);
  int missed = 0;
  for (int k = 0; k < 3000; ++k) {
    const Rigid3d truth = RandomPose(random, 1.5, 1.0);
    std::array<Eigen::Vector3d, 3> rays, points;
    for (size_t i = 0; i < 3; ++i) {
      const double z = random.Uniform(1.0, 6.0);
      const Eigen::Vector3d p_cam(z * random.Uniform(-0.6, 0.6), z * random.Uniform(-0.5, 0.5), z);
      points[i] = truth.Inverse() * p_cam;
      rays[i] = p_cam / p_cam.z();
    }
    std::array<Rigid3d, 4> poses;
    const int count = SolveP3p(rays, points, poses);
    double best = 1e9;
    for (int n = 0; n < count; ++n) {
      const Rigid3d& pose = poses[static_cast<size_t>(n)];
      best = std::min(best, PoseDistance(pose, truth));
      for (size_t i = 0; i < 3; ++i) {
        EXPECT_LT(((pose * points[i]).normalized() - rays[i].normalized()).norm(), 1e-6);
      }
    }
    if (best > 1e-6) ++missed;
  }
  EXPECT_LE(missed, 6);
}

TEST(P3p, CollinearPointsGiveNothing) {
  const std::array<Eigen::Vector3d, 3> points{Eigen::Vector3d(0, 0, 4), Eigen::Vector3d(1, 0, 4),
                                              Eigen::Vector3d(2, 0, 4)};
  std::array<Rigid3d, 4> poses;
  EXPECT_EQ(SolveP3p(points, points, poses), 0);
}

/// The sums as they are written down.
PoseNormal PlainNormal(const Pinhole& camera, const PnpData& data, const std::vector<double>& weights) {
  PoseNormal normal;
  const Eigen::Matrix3d R = data.T_cam_world.rotation.toRotationMatrix();
  for (size_t i = 0; i < data.points.size(); ++i) {
    const Eigen::Vector3d p = R * data.points[i] + data.T_cam_world.translation;
    const Eigen::Vector2d error = camera.Project(p) - data.uv_px[i];
    const double u = p.x() / p.z(), v = p.y() / p.z(), inverse_z = 1.0 / p.z();
    const double fx = camera.fx_px, fy = camera.fy_px;
    Eigen::Matrix<double, 2, 6> J;
    J << -fx * u * v, fx * (1 + u * u), -fx * v, fx * inverse_z, 0, -fx * u * inverse_z, -fy * (1 + v * v),
        fy * u * v, fy * u, 0, fy * inverse_z, -fy * v * inverse_z;
    normal.matrix.noalias() += weights[i] * J.transpose() * J;
    normal.gradient.noalias() += weights[i] * J.transpose() * error;
    normal.cost += weights[i] * error.squaredNorm();
  }
  return normal;
}

TEST(PoseNormal, AllPathsGiveTheBitsOfThePlainSums) {
  const Pinhole camera{525, 480, 319.5, 239.5};
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const PnpData data = DataOf(seed, 1.0);
    std::vector<int> all(data.points.size());
    std::iota(all.begin(), all.end(), 0);
    Random random(seed);
    std::vector<double> weights;
    for (size_t i = 0; i < all.size(); ++i) weights.push_back(random.Uniform(0.1, 1.0));
    const PoseNormal plain = PlainNormal(camera, data, weights);
    const Matrix6d lower = plain.matrix.triangularView<Eigen::Lower>();
    for (const VectorPath path : VectorPaths()) {
      const PoseNormal sums =
          SumPoseNormal(camera, data.T_cam_world, data.points, data.uv_px, weights, all, path);
      EXPECT_EQ(sums.matrix, lower);
      EXPECT_EQ(sums.gradient, plain.gradient);
      EXPECT_EQ(sums.cost, plain.cost);
    }
  }
}

TEST(PoseNormal, APointBehindTheCameraCostsInfinitelyMuch) {
  const std::vector<Eigen::Vector3d> points{{0, 0, 2}, {0, 0, -2}};
  const std::vector<Eigen::Vector2d> uv_px(2, Eigen::Vector2d::Zero());
  EXPECT_TRUE(std::isinf(SumPoseNormal({}, {}, points, uv_px, {}, std::vector<int>{0, 1}).cost));
  EXPECT_TRUE(std::isfinite(SumPoseNormal({}, {}, points, uv_px, {}, std::vector<int>{0}).cost));
}

TEST(RefinePose, ReachesTheTruthWithoutNoise) {
  Random random(2);
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const PnpData data = DataOf(seed, 0.0);
    std::vector<int> all(data.points.size());
    std::iota(all.begin(), all.end(), 0);
    const Rigid3d start = RandomPose(random, 0.03, 0.1) * data.T_cam_world;
    const Rigid3d T = RefinePose({525, 525, 319.5, 239.5}, start, data.points, data.uv_px, {}, all, 10);
    EXPECT_LT(PoseDistance(T, data.T_cam_world), 1e-6);
  }
}

}  // namespace
}  // namespace dmslam
