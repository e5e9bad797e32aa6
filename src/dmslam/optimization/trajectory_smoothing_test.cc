#include "dmslam/optimization/trajectory_smoothing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr double kInterval_s = 1.0 / 30.0;

/// A hand-held camera: sways and turns, some decimetres and tenths of a radian about a place.
Rigid3d TruthAt(double t) {
  const Eigen::Vector3d center(0.3 * std::sin(1.3 * t), 0.1 * std::sin(2.1 * t + 1.0),
                               0.2 * std::cos(0.9 * t));
  const Eigen::Vector3d turn(0.2 * std::sin(1.1 * t), 0.5 * std::sin(0.7 * t), 0.1 * std::cos(1.7 * t));
  return Rigid3d(ExpSo3(turn), center).Inverse();
}

Eigen::Vector3d Noise(Random& random, double sigma) {
  const double x = random.Gaussian(), y = random.Gaussian(), z = random.Gaussian();
  return sigma * Eigen::Vector3d(x, y, z);
}

PoseEstimate Estimate(double t, double sigma_rad, double sigma_shift, Random& random) {
  PoseEstimate estimate;
  estimate.time_s = t;
  estimate.T_cam_world = Rigid3d(ExpSo3(Noise(random, sigma_rad)), Noise(random, sigma_shift)) * TruthAt(t);
  estimate.information.diagonal() << Eigen::Vector3d::Constant(std::pow(sigma_rad, -2)),
      Eigen::Vector3d::Constant(std::pow(sigma_shift, -2));
  return estimate;
}

/// `weak` frames in the middle know their poses fifty times worse.
std::vector<PoseEstimate> Track(int count, int weak, uint64_t seed) {
  Random random(seed);
  std::vector<PoseEstimate> estimates;
  for (int k = 0; k < count; ++k) {
    const double factor = std::abs(2 * k - count) < weak ? 50.0 : 1.0;
    estimates.push_back(Estimate(kInterval_s * k, factor * 2e-4, factor * 5e-4, random));
  }
  return estimates;
}

double CenterError(const PoseEstimate& estimate, const Rigid3d& T_cam_world) {
  return (T_cam_world.Center() - TruthAt(estimate.time_s).Center()).norm();
}

double RmsCenterError(const std::vector<PoseEstimate>& estimates, const std::vector<Rigid3d>& poses,
                      size_t begin, size_t end) {
  double sum = 0.0;
  for (size_t k = begin; k < end; ++k) sum += std::pow(CenterError(estimates[k], poses[k]), 2);
  return std::sqrt(sum / static_cast<double>(end - begin));
}

std::vector<Rigid3d> Given(const std::vector<PoseEstimate>& estimates) {
  std::vector<Rigid3d> poses;
  for (const PoseEstimate& estimate : estimates) poses.push_back(estimate.T_cam_world);
  return poses;
}

TEST(TrajectorySmoothing, WeakFramesFollowTheirNeighbours) {
  const auto estimates = Track(300, 16, 1);
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  const double before = RmsCenterError(estimates, Given(estimates), 142, 158);
  const double after = RmsCenterError(estimates, smoothed.T_cam_world, 142, 158);
  EXPECT_GT(before, 0.02);
  EXPECT_LT(after, 0.05 * before);
}

/// Frames that know their places ten times worse than others and are all wrong by the same 8 mm, as those are
/// that see the same corner.
std::vector<PoseEstimate> WrongTogether() {
  auto estimates = Track(300, 0, 21);
  for (size_t k = 140; k < 160; ++k) {
    const Rigid3d wrong(Eigen::Quaterniond::Identity(), {0.008, 0.0, 0.0});
    estimates[k].T_cam_world = wrong * TruthAt(estimates[k].time_s);
    estimates[k].information *= 0.01;
  }
  return estimates;
}

TEST(TrajectorySmoothing, FramesThatAreWrongTogetherHaveTheSayOfOne) {
  auto estimates = WrongTogether();
  const double apart = RmsCenterError(estimates, SmoothTrajectory(estimates).T_cam_world, 140, 160);
  for (size_t k = 141; k < 160; ++k) estimates[k].shared = estimates[k].information;
  const double together = RmsCenterError(estimates, SmoothTrajectory(estimates).T_cam_world, 140, 160);
  EXPECT_LT(together, 0.5 * apart);
}

TEST(TrajectorySmoothing, WhatAllFramesShareCostsLittleWhereTheirErrorsAreTheirOwn) {
  auto estimates = Track(300, 0, 22);
  const double apart = RmsCenterError(estimates, SmoothTrajectory(estimates).T_cam_world, 0, 300);
  for (size_t k = 1; k < 300; ++k) estimates[k].shared = 0.9 * estimates[k].information;
  const double together = RmsCenterError(estimates, SmoothTrajectory(estimates).T_cam_world, 0, 300);
  EXPECT_LT(together, 1.1 * apart);
}

TEST(TrajectorySmoothing, EqualFramesGetBetterToo) {
  const auto estimates = Track(300, 0, 2);
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  EXPECT_LT(RmsCenterError(estimates, smoothed.T_cam_world, 0, 300),
            0.7 * RmsCenterError(estimates, Given(estimates), 0, 300));
  EXPECT_NEAR(smoothed.noise->variance, 1.0, 0.35);
}

TEST(TrajectorySmoothing, AJerkyCameraIsNotSmoothed) {
  auto estimates = Track(300, 0, 3);
  Random random(4);
  std::vector<Rigid3d> truth;
  for (PoseEstimate& estimate : estimates) {  // 5 mm from frame to frame, known to half a millimetre
    const Rigid3d shake(ExpSo3(Noise(random, 0.003)), Noise(random, 0.005));
    truth.push_back(shake * TruthAt(estimate.time_s));
    estimate.T_cam_world = shake * estimate.T_cam_world;
  }
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  double before = 0.0, after = 0.0;
  for (size_t k = 0; k < truth.size(); ++k) {
    before += (estimates[k].T_cam_world.Center() - truth[k].Center()).squaredNorm();
    after += (smoothed.T_cam_world[k].Center() - truth[k].Center()).squaredNorm();
  }
  EXPECT_LT(after, 1.2 * before);
}

TEST(TrajectorySmoothing, InformationHasDirections) {
  auto estimates = Track(200, 0, 5);
  Random random(6);
  for (size_t k = 90; k < 110; ++k) {  // turning right looks like stepping left: only their sum is known
    Rigid3d& T = estimates[k].T_cam_world;
    const double slide = 0.05 * random.Gaussian();
    T = Rigid3d(ExpSo3({0.0, -slide / 2.0, 0.0}), {slide, 0.0, 0.0}) * T;
    Vector6d open = Vector6d::Zero();
    open(1) = -0.5, open(3) = 1.0;
    estimates[k].information =
        (estimates[k].information.inverse() + 0.05 * 0.05 * open * open.transpose()).inverse();
  }
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  EXPECT_GT(RmsCenterError(estimates, Given(estimates), 90, 110), 0.03);
  EXPECT_LT(RmsCenterError(estimates, smoothed.T_cam_world, 90, 110), 0.002);
}

TEST(TrajectorySmoothing, APoseThatContradictsItsNeighboursLosesItsSay) {
  auto estimates = Track(200, 0, 7);
  estimates[100].T_cam_world.translation += Eigen::Vector3d(0.05, 0.0, 0.0);  // a hundred times its sigma
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  EXPECT_LT(CenterError(estimates[100], smoothed.T_cam_world[100]), 0.002);
  EXPECT_LT(CenterError(estimates[99], smoothed.T_cam_world[99]), 0.002);
}

TEST(TrajectorySmoothing, AGapPartsTheMotions) {
  auto estimates = Track(200, 0, 8);
  for (size_t k = 100; k < 200; ++k) {  // carried elsewhere meanwhile
    estimates[k].time_s += 10.0;
    estimates[k].T_cam_world.translation += Eigen::Vector3d(5.0, 0.0, 0.0);
  }
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  for (const size_t k : {99, 100}) {
    EXPECT_LT((smoothed.T_cam_world[k].Center() - estimates[k].T_cam_world.Center()).norm(), 0.003);
  }
}

TEST(TrajectorySmoothing, StampsThatNearlyMeetAndAPauseOfMinutes) {
  auto estimates = Track(200, 0, 15);
  PoseEstimate twin = estimates[50];
  twin.time_s += 1e-6;
  estimates.insert(estimates.begin() + 51, twin);
  for (size_t k = 101; k < estimates.size(); ++k) estimates[k].time_s += 600.0;
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  double before = 0.0, after = 0.0;
  for (size_t k = 0; k < estimates.size(); ++k) {
    const PoseEstimate seen{estimates[k].time_s - (k > 100 ? 600.0 : 0.0), estimates[k].T_cam_world, {}};
    before += std::pow(CenterError(seen, seen.T_cam_world), 2);
    after += std::pow(CenterError(seen, smoothed.T_cam_world[k]), 2);
  }
  EXPECT_LT(after, 0.6 * before);
}

TEST(TrajectorySmoothing, WhatCannotBeSolvedComesBack) {
  auto estimates = Track(40, 0, 16);
  for (PoseEstimate& estimate : estimates) estimate.information *= -1.0;
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  EXPECT_LT((smoothed.T_cam_world[7].Center() - estimates[7].T_cam_world.Center()).norm(), 1e-12);
}

TEST(TrajectorySmoothing, NothingKnownOfSomeFramesAndTheyAreInBetween) {
  auto estimates = Track(200, 0, 9);
  for (size_t k = 100; k < 105; ++k) {
    estimates[k].T_cam_world = estimates[99].T_cam_world;
    estimates[k].information.setZero();
  }
  const SmoothedTrajectory smoothed = SmoothTrajectory(estimates);
  EXPECT_LT(RmsCenterError(estimates, smoothed.T_cam_world, 100, 105), 0.002);
}

TEST(TrajectorySmoothing, FewPosesOrNoTimeAreLeftAlone) {
  auto estimates = Track(9, 0, 10);
  EXPECT_EQ(SmoothTrajectory({}).T_cam_world.size(), 0u);
  const SmoothedTrajectory few = SmoothTrajectory(estimates);
  ASSERT_EQ(few.T_cam_world.size(), 9u);
  EXPECT_EQ(few.T_cam_world[4].translation, estimates[4].T_cam_world.translation);
  auto still = Track(30, 0, 11);
  for (PoseEstimate& estimate : still) estimate.time_s = 1.0;
  EXPECT_EQ(SmoothTrajectory(still).T_cam_world[7].translation, still[7].T_cam_world.translation);
}

TEST(TrajectorySmoothing, ACameraThatStands) {
  auto estimates = Track(120, 10, 13);
  Random random(14);
  for (PoseEstimate& estimate : estimates) {
    const Eigen::Vector3d sigmas = estimate.information.diagonal().cwiseInverse().cwiseSqrt().tail<3>();
    estimate.T_cam_world = Rigid3d(Eigen::Quaterniond::Identity(), Noise(random, sigmas.x()));
  }
  for (const Rigid3d& pose : SmoothTrajectory(estimates).T_cam_world) {
    EXPECT_LT(pose.Center().norm(), 0.001);
  }
  for (PoseEstimate& estimate : estimates) estimate.T_cam_world = Rigid3d();
  for (const Rigid3d& pose : SmoothTrajectory(estimates).T_cam_world) {
    EXPECT_LT(pose.Center().norm(), 1e-9);
  }
}

TEST(TrajectorySmoothing, TheSameTwice) {
  const auto estimates = Track(100, 10, 12);
  const auto a = SmoothTrajectory(estimates).T_cam_world, b = SmoothTrajectory(estimates).T_cam_world;
  for (size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].translation, b[k].translation);
    EXPECT_EQ(a[k].rotation.coeffs(), b[k].rotation.coeffs());
  }
}

}  // namespace
}  // namespace dmslam
