#include "dmslam/evaluation/nees.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int64_t kFrameNs = 33'333'333;
constexpr double kUnits = 2.0;  // of the map in a metre

Eigen::Vector3d Normal3(Random& random) {
  const double x = random.Gaussian(), y = random.Gaussian(), z = random.Gaussian();
  return {x, y, z};
}

StampedPose TruthAt(uint32_t frame) {
  const double t = frame / 30.0;
  return {frame * kFrameNs, Rigid3d(ExpSo3({0.1 * std::sin(t), 0.3 * std::cos(0.7 * t), 0}),
                                    {std::sin(t), 0.4 * std::cos(1.3 * t), 0.5 * std::sin(0.6 * t)})};
}

/// A pose whose error is `times` what is told of it.
ToldPose Tell(uint32_t frame, double times, Random& random) {
  const Vector6d sigma = (Vector6d() << 0.002, 0.004, 0.003, 0.001, 0.002, 0.001).finished();
  const StampedPose truth = TruthAt(frame);
  ToldPose told;
  told.frame = frame;
  told.state = 3;
  told.map = 1;
  told.T_cam_reference.rotation = truth.T_world_cam.rotation.conjugate();  // its reference stands upright
  told.covariance = Matrix6d(sigma.cwiseAbs2().asDiagonal());
  const Eigen::Vector3d shift = times * sigma.head<3>().cwiseProduct(Normal3(random));
  const Eigen::Vector3d turn = times * sigma.tail<3>().cwiseProduct(Normal3(random));
  told.pose = {truth.stamp_ns, Rigid3d(ExpSo3(turn) * truth.T_world_cam.rotation,
                                       kUnits * truth.T_world_cam.translation + shift)};
  return told;
}

struct Told {
  std::vector<StampedPose> truth;
  std::vector<ToldPose> poses;
};

Told TellAll(double times) {
  Random random(2);
  Told all;
  for (uint32_t frame = 0; frame < 900; ++frame) {
    all.truth.push_back(TruthAt(frame));
    all.poses.push_back(Tell(frame, times, random));
  }
  return all;
}

NeesOptions WithoutDrift() {
  NeesOptions options;
  options.model.model_error = options.model.drift = options.model.inherited = 0;
  options.gauge_s = 30;
  return options;
}

TEST(NeesTest, IsOneWhereWhatIsToldIsTrue) {
  const Told told = TellAll(1.0);
  const auto pairs = ComputeNees(told.truth, told.poses, {}, 1.0, WithoutDrift());
  ASSERT_EQ(pairs.size(), 870u);
  const NeesSummary summary = Summarize(pairs);
  EXPECT_NEAR(summary.position, 1.0, 0.15);
  EXPECT_NEAR(summary.rotation, 1.0, 0.15);
  EXPECT_LT(summary.position_beyond, 0.01);
  EXPECT_EQ(summary.outside, 0.0);
}

TEST(NeesTest, GrowsWithErrorsThatAreNotTold) {
  const Told told = TellAll(2.0);
  const NeesSummary summary = Summarize(ComputeNees(told.truth, told.poses, {}, 1.0, WithoutDrift()));
  EXPECT_NEAR(summary.position, 4.0, 0.6);
  EXPECT_NEAR(summary.rotation, 4.0, 0.6);
  EXPECT_GT(summary.position_beyond, 0.05);
  NeesOptions drifting;
  drifting.gauge_s = 30;
  drifting.model.model_error = 0.01;
  EXPECT_LT(Summarize(ComputeNees(told.truth, told.poses, {}, 1.0, drifting)).position, summary.position);
}

TEST(NeesTest, WhatIsNotKnownIsNotJudged) {
  Told told = TellAll(1.0);
  for (ToldPose& pose : told.poses) {
    if (pose.frame >= 300 && pose.frame < 330) pose.covariance.reset();
    if (pose.frame >= 600) pose.map = 2;
  }
  EXPECT_EQ(ComputeNees(told.truth, told.poses, {}, 1.0, WithoutDrift()).size(), 870u - 60u - 30u);
}

TEST(NeesTest, ThirdsByCoverage) {
  Told told = TellAll(1.0);
  std::vector<double> coverage(900);
  for (size_t i = 0; i < coverage.size(); ++i) coverage[i] = i < 450 ? 0.5 : 0.1;
  const auto pairs = ComputeNees(told.truth, told.poses, coverage, 1.0, WithoutDrift());
  EXPECT_NEAR(ThirdByCoverage(pairs, 0).front().coverage, 0.1, 1e-12);
  EXPECT_NEAR(ThirdByCoverage(pairs, 2).back().coverage, 0.5, 1e-12);
}

class ToldPosesTest : public ::testing::Test {
 protected:
  ~ToldPosesTest() override { std::filesystem::remove(path_); }
  const std::string path_ = ::testing::TempDir() + "told_poses_test.csv";
};

TEST_F(ToldPosesTest, ReadAsTheyWereWritten) {
  Random random(5);
  std::vector<ToldPose> told = {Tell(3, 1, random), Tell(4, 1, random)};
  told[0].covariance.reset();
  told[1].step_from = 3;
  told[1].step_covariance = 0.5 * *told[1].covariance;
  WriteToldPoses(path_, told);
  const std::vector<ToldPose> read = ReadToldPoses(path_);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_FALSE(read[0].covariance || read[0].step_from || read[0].step_covariance);
  EXPECT_EQ(read[1].pose.stamp_ns, told[1].pose.stamp_ns);
  EXPECT_EQ(read[1].step_from, 3u);
  EXPECT_LT((*read[1].covariance - *told[1].covariance).norm(), 1e-12);
  EXPECT_LT((*read[1].step_covariance - *told[1].step_covariance).norm(), 1e-12);
  EXPECT_LT((read[1].pose.T_world_cam.translation - told[1].pose.T_world_cam.translation).norm(), 1e-8);
}

TEST_F(ToldPosesTest, WhatIsNoSuchFileIsRefusedByItsLine) {
  std::ofstream(path_) << "# stamp\n1.0,2,3\n";
  try {
    ReadToldPoses(path_);
    FAIL() << "it was read";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(":2: has 3 columns"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace dmslam
