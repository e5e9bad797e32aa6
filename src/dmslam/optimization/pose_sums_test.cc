#include "dmslam/optimization/pose_sums.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/reprojection.h"

namespace dmslam {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHuberChi2 = 5.99;

/// What a camera sees with noise; some is far off, some lies behind it, and every fifth takes no part.
struct Input {
  Pinhole camera;
  Rigid3d T_cam_world;
  std::vector<PoseObservation> observations;
  std::vector<char> use;

  explicit Input(size_t count) {
    const SyntheticScene scene =
        MakeSyntheticScene({.seed = 5, .num_cameras = 1, .num_points = 300, .noise_px = 1.0});
    Random random(7);
    camera = scene.camera;
    T_cam_world = RandomPose(random, 0.002, 0.005) * scene.T_cam_world[0];
    for (const auto& o : scene.observations) {
      if (observations.size() == count) break;
      const size_t i = observations.size();
      PoseObservation& seen = observations.emplace_back();
      seen.p_world = scene.points[static_cast<size_t>(o.point)];
      seen.uv_px = o.uv_px;
      seen.inv_sigma_squared = 1.0 / static_cast<double>(1 + i % 3);
      seen.weight = 0.3 + 0.1 * static_cast<double>(i % 8);
      if (i % 11 == 3) seen.uv_px.x() += 40.0;
      if (i % 17 == 5) seen.p_world = T_cam_world.Inverse() * Eigen::Vector3d(0.3, -0.2, -1.5);
      use.push_back(i % 5 == 2 ? 0 : 1);
    }
  }
};

/// The formula, observation by observation and element by element.
PoseEquations SumOneByOne(const Input& in, double huber_chi2) {
  PoseEquations sum;
  const Eigen::Matrix3d R = in.T_cam_world.rotation.toRotationMatrix();
  for (size_t i = 0; i < in.observations.size(); ++i) {
    if (!in.use[i]) continue;
    const PoseObservation& o = in.observations[i];
    const Eigen::Vector3d p = R * o.p_world + in.T_cam_world.translation;
    if (!(p.z() > kMinDepth)) {
      sum.cost += o.weight * 1e5;
      continue;
    }
    const double w = 1.0 / p.z(), x = p.x() * w, y = p.y() * w;
    const double fx = in.camera.fx_px, fy = in.camera.fy_px;
    const double error[2] = {fx * x + in.camera.cx_px - o.uv_px.x(), fy * y + in.camera.cy_px - o.uv_px.y()};
    const double rows[2][6] = {{-fx * x * y, fx * (1.0 + x * x), -fx * y, fx * w, 0.0, -fx * x * w},
                               {-fy * (1.0 + y * y), fy * x * y, fy * x, 0.0, fy * w, -fy * y * w}};
    const double chi2 = (error[0] * error[0] + error[1] * error[1]) * o.inv_sigma_squared;
    const double slope = chi2 <= huber_chi2 ? 1.0 : std::sqrt(huber_chi2 / chi2);
    const double loss = chi2 <= huber_chi2 ? chi2 : 2.0 * chi2 * slope - huber_chi2;
    const double weight = o.weight * o.inv_sigma_squared * slope;
    for (int r = 0; r < 2; ++r) {
      for (int a = 0; a < 6; ++a) {
        const double scaled = weight * rows[r][a];
        sum.gradient[a] += scaled * error[r];
        for (int b = a; b < 6; ++b) sum.hessian(a, b) += scaled * rows[r][b];
      }
    }
    sum.cost += o.weight * loss;
  }
  sum.hessian.triangularView<Eigen::StrictlyLower>() = sum.hessian.transpose();
  return sum;
}

TEST(SumPoseEquations, IsTheSumOfItsFormulaToTheLastBitOnEveryPath) {
  for (const size_t count : {0, 1, 3, 64, 65, 131, 300}) {
    const Input in(count);
    for (const double huber_chi2 : {kInfinity, kHuberChi2}) {
      const PoseEquations expected = SumOneByOne(in, huber_chi2);
      for (const VectorPath path : VectorPaths()) {
        const PoseEquations sum =
            SumPoseEquations(in.camera, in.T_cam_world, in.observations, in.use, huber_chi2, path);
        EXPECT_EQ(sum.cost, expected.cost) << count;
        EXPECT_TRUE(sum.gradient == expected.gradient) << count;
        EXPECT_TRUE(sum.hessian == expected.hessian) << count;
      }
    }
  }
}

TEST(SumPoseEquations, GradientAndMatrixAreThoseOfTheJacobian) {
  Input in(120);
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (size_t i = 0; i < in.observations.size(); ++i) {
    const PoseObservation& o = in.observations[i];
    const Eigen::Vector3d p = in.T_cam_world * o.p_world;
    if (!in.use[i] || p.z() <= 0) continue;
    const Matrix26 J = PoseJacobian(in.camera, p);
    const double weight = o.weight * o.inv_sigma_squared;
    hessian += weight * J.transpose() * J;
    gradient += weight * J.transpose() * (in.camera.Project(p) - o.uv_px);
  }
  const PoseEquations sum = SumPoseEquations(in.camera, in.T_cam_world, in.observations, in.use);
  EXPECT_LT((sum.hessian - hessian).norm(), 1e-9 * hessian.norm());
  EXPECT_LT((sum.gradient - gradient).norm(), 1e-9 * gradient.norm());
}

}  // namespace
}  // namespace dmslam
