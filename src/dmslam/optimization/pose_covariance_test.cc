#include "dmslam/optimization/pose_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kTrials = 400;
constexpr double kNoisePx = 0.8;

Eigen::Vector3d Normal3(Random& random) {
  const double x = random.Gaussian(), y = random.Gaussian(), z = random.Gaussian();
  return {x, y, z};
}

/// Of e^T covariance^-1 e over its dimension: the mean is 1 where the covariance is right.
double Nees(const Vector6d& error, const Matrix6d& covariance) {
  return error.dot(Eigen::LDLT<Matrix6d>(covariance).solve(error)) / 6.0;
}

Vector6d ErrorOf(const Rigid3d& estimate, const Rigid3d& truth) {
  const Rigid3d difference = estimate * truth.Inverse();
  Vector6d error;
  error << LogSo3(difference.rotation), difference.translation;
  return error;
}

/// What is wrong in a trial, and what is believed to be.
struct Errors {
  double landmark_depth = 0;  ///< standard deviation in their keyframe, as a share of the depth
  double neighbour_correlation = 0;
  double noise_px = kNoisePx;
};

/// A camera and a cloud of landmarks before it, whose errors are drawn anew in each trial.
class Scene {
 public:
  explicit Scene(uint64_t seed) : random_(seed) {
    SyntheticSceneOptions options;
    options.seed = seed;
    options.num_points = 150;
    options.step = 0.05;
    scene_ = MakeSyntheticScene(options);
  }

  const Rigid3d& T(size_t camera) const { return scene_.T_cam_world[camera]; }

  std::vector<PoseSight> Sights(size_t camera, const Errors& errors) const {
    std::vector<PoseSight> sights;
    for (const SyntheticObservation& seen : scene_.observations) {
      if (seen.camera != static_cast<int>(camera)) continue;
      PoseSight sight;
      sight.landmark = LandmarkId::Make(1, static_cast<uint64_t>(seen.point) + 1);
      sight.p_world = scene_.points[static_cast<size_t>(seen.point)];
      const Eigen::Vector3d ray = Ray(sight.p_world);
      const double sigma = errors.landmark_depth * ray.norm();
      sight.landmark_root = sigma * ray.normalized() * ray.normalized().transpose();
      sight.variance_px = errors.noise_px * errors.noise_px;
      // By the first camera's cells, so that those of a point are the same in all.
      const Eigen::Vector2d uv = scene_.camera.Project(scene_.T_cam_world[0] * sight.p_world);
      sight.cell = std::clamp(static_cast<int>(uv.x() / 160), 0, 3) +
                   4 * std::clamp(static_cast<int>(uv.y() / 160), 0, 2);
      sights.push_back(sight);
    }
    return sights;
  }

  /// Standard normal numbers of which those of one cell have the correlation.
  std::vector<Eigen::Vector3d> Draw(const std::vector<PoseSight>& sights, double correlation) {
    std::vector<Eigen::Vector3d> of_cell(12);
    for (Eigen::Vector3d& common : of_cell) common = Normal3(random_);
    std::vector<Eigen::Vector3d> drawn;
    for (const PoseSight& sight : sights) {
      const Eigen::Vector3d own = Normal3(random_);
      drawn.push_back(std::sqrt(correlation) * of_cell[static_cast<size_t>(sight.cell)] +
                      std::sqrt(1 - correlation) * own);
    }
    return drawn;
  }

  /// Where every landmark of the world is believed to be in this trial.
  std::vector<Eigen::Vector3d> MoveLandmarks(const Errors& errors) {
    std::vector<Eigen::Vector3d> moved = scene_.points;
    const std::vector<PoseSight> sights = Sights(0, errors);
    const std::vector<Eigen::Vector3d> drawn = Draw(sights, errors.neighbour_correlation);
    for (size_t i = 0; i < sights.size(); ++i) {
      const size_t point = static_cast<size_t>((sights[i].landmark.value & 0xffffffffffff) - 1);
      moved[point] += errors.landmark_depth * drawn[i].x() * Ray(sights[i].p_world);
    }
    return moved;
  }

  PoseOptimizationReport Locate(size_t camera, const std::vector<PoseSight>& sights,
                                const std::vector<Eigen::Vector3d>& moved, const Errors& errors) {
    const std::vector<Eigen::Vector3d> drawn = Draw(sights, errors.neighbour_correlation);
    std::vector<PoseObservation> observations;
    for (size_t i = 0; i < sights.size(); ++i) {
      const size_t point = static_cast<size_t>((sights[i].landmark.value & 0xffffffffffff) - 1);
      const Eigen::Vector2d uv =
          scene_.camera.Project(T(camera) * sights[i].p_world) + errors.noise_px * drawn[i].head<2>();
      observations.push_back({moved[point], uv, 1.0 / sights[i].variance_px, 1.0});
    }
    PoseOptimizationOptions options;
    options.max_chi2 = 1e9;
    return OptimizePose(scene_.camera, T(camera), observations, options);
  }

  PoseUncertainty Uncertainty(size_t camera, const std::vector<PoseSight>& sights,
                              const PoseOptimizationReport& report, double correlation) const {
    PoseErrorModel model;
    model.neighbour_correlation = correlation;
    return *EstimatePoseUncertainty(scene_.camera, T(camera), sights, report.information, 1.0, model);
  }

  /// From the keyframe that has seen the landmarks, beside the cameras: their depths in it are uncertain.
  Eigen::Vector3d Ray(const Eigen::Vector3d& p_world) const {
    return p_world - (T(0).Center() + Eigen::Vector3d(1.0, 0.3, 0));
  }
  const Pinhole& camera() const { return scene_.camera; }
  Random& random() { return random_; }

 private:
  SyntheticScene scene_;
  Random random_;
};

/// Mean normalised error squared of poses, where `errors` are made and `believed` are told.
double MeanNees(const Errors& errors, const Errors& believed) {
  Scene scene(5);
  const std::vector<PoseSight> sights = scene.Sights(0, believed);
  double sum = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto report = scene.Locate(0, sights, scene.MoveLandmarks(errors), errors);
    const PoseUncertainty known = scene.Uncertainty(0, sights, report, believed.neighbour_correlation);
    sum += Nees(ErrorOf(report.T_cam_world, scene.T(0)), known.Sum());
  }
  return sum / kTrials;
}

TEST(IsCovariance, NotWithAVarianceBelowZeroNorWithAnInfiniteOne) {
  Matrix6d covariance = 1e-4 * Matrix6d::Identity();
  EXPECT_TRUE(IsCovariance(covariance));
  covariance(4, 4) = -1e-12;
  EXPECT_FALSE(IsCovariance(covariance));
  covariance(4, 4) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(IsCovariance(covariance));
}

TEST(PoseCovarianceTest, NoiseOfThePixels) {
  EXPECT_NEAR(MeanNees({}, {}), 1.0, 0.12);
  EXPECT_GT(MeanNees({.noise_px = 2 * kNoisePx}, {}), 3.0);
}

TEST(PoseCovarianceTest, UncertainLandmarks) {
  const Errors errors{.landmark_depth = 0.01};
  EXPECT_NEAR(MeanNees(errors, errors), 1.0, 0.12);
  EXPECT_GT(MeanNees(errors, {}), 2.0) << "they would make no difference";
}

TEST(PoseCovarianceTest, NeighboursThatErrAlike) {
  const Errors errors{.landmark_depth = 0.01, .neighbour_correlation = 0.4};
  EXPECT_NEAR(MeanNees(errors, errors), 1.0, 0.15);
  EXPECT_GT(MeanNees(errors, {.landmark_depth = 0.01}), 1.5) << "they would make no difference";
}

TEST(PoseCovarianceTest, ThePriorIsAsGoodAsItSays) {
  Scene scene(5);
  const std::vector<PoseSight> sights = scene.Sights(0, {});
  const auto moved = scene.MoveLandmarks({});
  const PoseOptimizationReport report = scene.Locate(0, sights, moved, {});
  Matrix6d prior = Matrix6d::Zero();
  prior.diagonal().setConstant(1e10);
  const auto known =
      EstimatePoseUncertainty(scene.camera(), scene.T(0), sights, report.information + prior, 1.0, {});
  ASSERT_TRUE(known);
  EXPECT_NEAR(known->noise(0, 0) * 1e10, 1.0, 0.1);
  EXPECT_FALSE(EstimatePoseUncertainty(scene.camera(), scene.T(0), {}, Matrix6d::Zero(), 1.0, {}));
}

TEST(PoseCovarianceTest, LandmarksErrorsCancelInAStep) {
  const Errors errors{.landmark_depth = 0.01, .neighbour_correlation = 0.2};
  Scene scene(7);
  const std::vector<PoseSight> before = scene.Sights(0, errors), after = scene.Sights(1, errors);
  const Rigid3d T_step = scene.T(1) * scene.T(0).Inverse();
  PoseErrorModel model;
  model.neighbour_correlation = errors.neighbour_correlation;
  double by_step = 0, as_if_apart = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto moved = scene.MoveLandmarks(errors);
    const auto a = scene.Locate(0, before, moved, errors), b = scene.Locate(1, after, moved, errors);
    PoseUncertainty known_a = scene.Uncertainty(0, before, a, errors.neighbour_correlation);
    const PoseUncertainty known_b = scene.Uncertainty(1, after, b, errors.neighbour_correlation);
    const Vector6d error = ErrorOf(b.T_cam_world * a.T_cam_world.Inverse(), T_step);
    by_step +=
        Nees(error, StepUncertainty({scene.T(0), before, &known_a}, {scene.T(1), after, &known_b}, model));
    std::vector<PoseSight> others = before;  // the same, as if nothing of it were seen again
    for (PoseSight& sight : others) sight.landmark.value += uint64_t{1} << 40;
    as_if_apart +=
        Nees(error, StepUncertainty({scene.T(0), others, &known_a}, {scene.T(1), after, &known_b}, model));
  }
  EXPECT_NEAR(by_step / kTrials, 1.0, 0.2);
  EXPECT_LT(as_if_apart / kTrials, 0.8);
}

TEST(LandmarkCovarianceTest, TheDepthIsKnownByTheBaseline) {
  const Pinhole camera{525, 525, 320, 240};
  const Eigen::Vector3d p(0.1, 0, 4);
  const auto depth_sigma = [&](double baseline) {
    const std::vector<LandmarkRay> views = {{Rigid3d(), 1.0},
                                            {Rigid3d({1, 0, 0, 0}, {-baseline, 0, 0}), 1.0}};
    return std::sqrt(LandmarkCovariance(camera, p, views)(2, 2));
  };
  // sigma_z = z^2 / (f b) sqrt(2) sigma_px
  EXPECT_NEAR(depth_sigma(0.5), 16 / (525 * 0.5) * std::sqrt(2), 0.005);
  EXPECT_NEAR(depth_sigma(0.1), 16 / (525 * 0.1) * std::sqrt(2), 0.05);
  EXPECT_NEAR(depth_sigma(0.0), 4.0, 0.1) << "as much as its depth, seen from one place";
}

TEST(UncertainPoseTest, ToldInItsReferencesFrame) {
  Random random(3);
  const Rigid3d T = RandomPose(random, 0.8, 2.0);
  Matrix6d root = 1e-4 * Matrix6d::Identity();
  root.topLeftCorner<3, 3>() *= 3;
  root(0, 4) = root(5, 1) = 2e-4;
  Matrix6d measured = Matrix6d::Zero();
  constexpr int kMany = 20000;
  for (int k = 0; k < kMany; ++k) {
    Vector6d normal;
    normal << Normal3(random), Normal3(random);
    const Rigid3d T_reference_cam = StepPose(T, root * normal).Inverse();
    Vector6d error;
    error << T_reference_cam.translation - T.Inverse().translation,
        LogSo3(T_reference_cam.rotation * T.rotation);
    measured += error * error.transpose() / kMany;
  }
  const Matrix6d told = ToPoseInReference(root * root.transpose(), T);
  EXPECT_LT((FromPoseInReference(told, T) - root * root.transpose()).norm(), 1e-9);
  EXPECT_LT((told - measured).norm(), 0.05 * measured.norm());
  EXPECT_EQ(FromUpperTriangle(UpperTriangle(told)), told);
}

TEST(UncertainPoseTest, RelativePoses) {
  Random random(4);
  UncertainPose a, b;
  a.T_world_cam = RandomPose(random, 0.8, 2.0);
  b.T_world_cam = RandomPose(random, 0.8, 2.0);
  a.covariance.diagonal() << 1e-6, 4e-6, 1e-6, 2e-6, 1e-6, 3e-6;
  b.covariance.diagonal() << 3e-6, 1e-6, 2e-6, 1e-6, 5e-7, 2e-6;
  const Rigid3d T_a_b = a.T_world_cam.Inverse() * b.T_world_cam;
  const auto wrong = [&random](const UncertainPose& pose) {
    Vector6d e;
    e << Normal3(random), Normal3(random);
    e = pose.covariance.diagonal().cwiseSqrt().cwiseProduct(e);
    return Rigid3d(ExpSo3(e.tail<3>()) * pose.T_world_cam.rotation,
                   pose.T_world_cam.translation + e.head<3>());
  };
  const Matrix6d covariance = RelativeCovariance(a, b, {}, 3.0);
  double sum = 0;
  for (int k = 0; k < kTrials * 10; ++k) {
    const Rigid3d T = wrong(a).Inverse() * wrong(b);
    Vector6d error;
    error << T.translation - T_a_b.translation, LogSo3(T.rotation * T_a_b.rotation.conjugate());
    sum += Nees(error, covariance);
  }
  EXPECT_NEAR(sum / (kTrials * 10), 1.0, 0.05);
  const Matrix6d drifting = RelativeCovariance(a, b, {1.0, 1.5}, 3.0) - covariance;
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(drifting).eigenvalues().minCoeff(), 0.0);
  const Matrix6d of_scale = RelativeCovariance(a, b, {0, 0, 2.0}, 3.0) - covariance;
  const Eigen::Vector3d along = T_a_b.translation.normalized();
  EXPECT_NEAR(along.dot(of_scale.topLeftCorner<3, 3>() * along),
              2.0 * std::pow(PoseErrorModel().drift, 2) * T_a_b.translation.squaredNorm(), 1e-12);
  EXPECT_NEAR(of_scale.trace(), along.dot(of_scale.topLeftCorner<3, 3>() * along), 1e-12);
}

/// A camera goes on, view after view, through what is mapped from where it is: each view errs as the pose
/// from which it was entered, on top of the one before. Both ends see their own view without an error.
TEST(UncertainPoseTest, ViewsErrAsThePosesFromWhichTheyWereEntered) {
  constexpr int kViews = 8;
  constexpr double kTurn = 0.01, kWay = 1.0, kDepth = 1.0;  // [rad] of each pose; between views; of the scene
  Random random(6);
  const UncertainPose a, b{Rigid3d({1, 0, 0, 0}, {kViews * kWay, 0, 0}), Matrix6d::Zero()};
  const auto told = [&](double entered) {
    return RelativeCovariance(a, b, {kViews * kWay / kDepth, kViews * kWay / kDepth, 0, entered}, kDepth);
  };
  const Matrix6d covariance = told(kViews * kTurn * kTurn), without = told(0);
  double position = 0, rotation = 0, rotation_without = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Rigid3d T;  // of the last view in the first one's frame, as it was mapped
    for (int view = 0; view < kViews; ++view) T = T * Rigid3d(ExpSo3(kTurn * Normal3(random)), {kWay, 0, 0});
    const Eigen::Vector3d shift = T.translation - b.T_world_cam.translation, turn = LogSo3(T.rotation);
    position += shift.dot(covariance.topLeftCorner<3, 3>().ldlt().solve(shift)) / 3 / kTrials;
    rotation += turn.dot(covariance.bottomRightCorner<3, 3>().ldlt().solve(turn)) / 3 / kTrials;
    rotation_without += turn.dot(without.bottomRightCorner<3, 3>().ldlt().solve(turn)) / 3 / kTrials;
  }
  EXPECT_NEAR(rotation, 1.0, 0.15);
  EXPECT_GT(rotation_without, 10.0) << "they would make no difference";
  EXPECT_LT(position, 1.2) << "the lever is shorter than the whole way: too careful rather than too sure";
  EXPECT_GT(position, 0.1);
}

TEST(UncertainPoseTest, SharedErrorsGrowWithWhatIsNewInTheView) {
  const PoseErrorModel model;
  const Matrix6d near = SharedErrors(model, {0.1, 0.1}, 2.0), far = SharedErrors(model, {3.0, 3.0}, 2.0);
  EXPECT_GT(far(0, 0), near(0, 0));
  EXPECT_GT(SharedErrors(model, {0.1, 1.0}, 2.0)(0, 0), near(0, 0)) << "gone and come back";
  EXPECT_DOUBLE_EQ(far(3, 3), 4 * far(0, 0)) << "positions, by the depth";
  EXPECT_NEAR(ViewChange(Rigid3d({1, 0, 0, 0}, {1, 0, 0}), 2.0), 0.5, 1e-12);
  EXPECT_NEAR(ViewChange(Rigid3d(ExpSo3({0, 0.5, 0}), {0, 0, 0}), 2.0), 0.5, 0.01);
  const Eigen::Vector3d middle(0, 0, 2);
  const Eigen::Quaterniond turn = ExpSo3({0, 0.8, 0});
  EXPECT_NEAR(ViewChange(Rigid3d(turn, middle - turn * middle), 2.0), 0, 1e-9) << "around what it looks at";
}

}  // namespace
}  // namespace dmslam
