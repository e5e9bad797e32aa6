#include "dmslam/optimization/dense_equations.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cstring>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/bundle_solver.h"
#include "dmslam/optimization/reprojection.h"

namespace dmslam {
namespace {

constexpr double kDamping = 1e-3;

/// Five cameras, of which the first is held, before points of which two are held; some sights do not count,
/// and one point lies behind a camera.
struct Scene {
  Pinhole camera;
  std::vector<Rigid3d> T_cam_world;
  std::vector<Eigen::Matrix3d> rotations;
  std::vector<Eigen::Vector3d> points;
  std::vector<char> point_held;
  BundleSights sights;

  Scene() {
    const SyntheticScene truth =
        MakeSyntheticScene({.seed = 4, .num_cameras = 5, .num_points = 60, .noise_px = 3, .step = 0.25});
    camera = truth.camera;
    T_cam_world = truth.T_cam_world;
    for (const Rigid3d& T : T_cam_world) rotations.push_back(T.rotation.toRotationMatrix());
    points = truth.points;
    points[7] = T_cam_world[2].Center() - Eigen::Vector3d(0, 0, 0.5);
    point_held.assign(points.size(), 0);
    point_held[3] = point_held[20] = 1;
    sights.first.push_back(0);
    for (size_t i = 0; i < points.size(); ++i) {
      for (const SyntheticObservation& o : truth.observations) {
        if (static_cast<size_t>(o.point) != i) continue;
        const size_t k = sights.all.size();
        const auto camera_number = static_cast<size_t>(o.camera);
        const auto free_pose = camera_number > 0 ? std::optional(camera_number - 1) : std::nullopt;
        sights.all.push_back(
            {k, camera_number, free_pose, o.uv_px, 0.5 + 0.1 * static_cast<double>(k % 7), k % 9 != 0});
      }
      sights.first.push_back(sights.all.size());
    }
  }
  BundlePlace Place() const { return {T_cam_world, rotations, points, point_held}; }
};

constexpr BundleRobustLoss kHuber{.huber_delta = 1.5}, kCauchy{.cauchy = true, .cauchy_width = 2};

template <typename T>
bool SameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST(DenseEquations, AreTheSameHoweverWideTheVectors) {
  const Scene scene;
  for (const BundleRobustLoss& loss : {kHuber, kCauchy}) {
    DenseEquations expected(4, scene.sights);
    SetEquations(scene.camera, loss, scene.sights, scene.Place(), &expected, VectorPath::kBaseline);
    EliminatePoints(scene.sights, kDamping, &expected, VectorPath::kBaseline);
    const double cost = CostOf(scene.camera, loss, scene.sights, scene.Place(), VectorPath::kBaseline);
    for (const VectorPath path : VectorPaths()) {
      DenseEquations equations(4, scene.sights);
      SetEquations(scene.camera, loss, scene.sights, scene.Place(), &equations, path);
      EliminatePoints(scene.sights, kDamping, &equations, path);
      EXPECT_TRUE(SameBytes(equations.poses, expected.poses));
      EXPECT_TRUE(SameBytes(equations.gradient, expected.gradient));
      EXPECT_TRUE(SameBytes(equations.reduced, expected.reduced));
      EXPECT_TRUE(SameBytes(equations.couplings, expected.couplings));
      EXPECT_TRUE(SameBytes(equations.points, expected.points));
      EXPECT_TRUE(SameBytes(equations.point_inverses, expected.point_inverses));
      EXPECT_TRUE(SameBytes(equations.point_gradients, expected.point_gradients));
      EXPECT_EQ(CostOf(scene.camera, loss, scene.sights, scene.Place(), path), cost);
    }
  }
}

/// The whole system at once, written down sight by sight.
struct WholeSystem {
  Eigen::MatrixXd A;
  Eigen::VectorXd gradient;
  double cost = 0;

  WholeSystem(const Scene& scene, const BundleRobustLoss& loss) {
    const auto size = static_cast<Eigen::Index>(4 * 6 + 3 * scene.points.size());
    A.setZero(size, size);
    gradient.setZero(size);
    for (size_t i = 0; i < scene.points.size(); ++i) {
      for (size_t k = scene.sights.first[i]; k < scene.sights.first[i + 1]; ++k)
        Add(scene, loss, i, scene.sights.all[k]);
    }
  }

  void Add(const Scene& scene, const BundleRobustLoss& loss, size_t i, const BundleSight& sight) {
    if (!sight.counts) return;
    const Eigen::Vector3d p = scene.T_cam_world[sight.pose] * scene.points[i];
    if (p.z() <= 0) {
      cost += 0.5 * loss.Of(kErrorBehind * kErrorBehind);
      return;
    }
    const Eigen::Vector2d error = sight.inv_sigma * (scene.camera.Project(p) - sight.uv_px);
    cost += 0.5 * loss.Of(error.squaredNorm());
    Eigen::Matrix<double, 2, Eigen::Dynamic> J = Eigen::Matrix<double, 2, Eigen::Dynamic>::Zero(2, A.cols());
    if (sight.free_pose)
      J.middleCols<6>(static_cast<Eigen::Index>(6 * *sight.free_pose)) =
          sight.inv_sigma * PoseJacobian(scene.camera, p);
    if (!scene.point_held[i]) {
      J.middleCols<3>(static_cast<Eigen::Index>(24 + 3 * i)) =
          sight.inv_sigma * ProjectionJacobian(scene.camera, p) * scene.rotations[sight.pose];
    }
    A += loss.Slope(error.squaredNorm()) * J.transpose() * J;
    gradient += loss.Slope(error.squaredNorm()) * J.transpose() * error;
  }
};

TEST(DenseEquations, GiveThePosesTheStepOfTheWholeSystem) {
  const Scene scene;
  for (const BundleRobustLoss& loss : {kHuber, kCauchy}) {
    WholeSystem whole(scene, loss);
    EXPECT_NEAR(CostOf(scene.camera, loss, scene.sights, scene.Place()), whole.cost, 1e-9 * whole.cost);
    DenseEquations equations(4, scene.sights);
    SetEquations(scene.camera, loss, scene.sights, scene.Place(), &equations);
    for (size_t k = 0; k < 4; ++k)
      for (size_t c = 0; c < 6; ++c) equations.Pose(k, k)[c].row[c] *= 1 + kDamping;
    EliminatePoints(scene.sights, kDamping, &equations);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(24, 24);
    Eigen::VectorXd gradient(24);
    for (size_t k = 0; k < 4; ++k) {
      const auto row = static_cast<Eigen::Index>(6 * k);
      gradient.segment<6>(row) = equations.reduced[k].Numbers();
      for (size_t l = 0; l <= k; ++l) {
        for (size_t c = 0; c < 6; ++c)
          A.block<6, 1>(row, static_cast<Eigen::Index>(6 * l + c)) = equations.Pose(k, l)[c].Numbers();
      }
    }
    const Eigen::VectorXd step = A.selfadjointView<Eigen::Lower>().ldlt().solve(gradient);
    for (Eigen::Index row = 0; row < whole.A.rows(); ++row) {
      whole.A(row, row) *= 1 + kDamping;
      if (whole.A(row, row) == 0) whole.A(row, row) = 1;  // a point that is held
    }
    const Eigen::VectorXd expected = whole.A.fullPivLu().solve(whole.gradient).head<24>();
    EXPECT_LT((step - expected).norm(), 1e-6 * expected.norm());
  }
}

}  // namespace
}  // namespace dmslam
