#include "dmslam/evaluation/rpe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dmslam/evaluation/evaluation_test_util.h"

namespace dmslam {
namespace {

RpeOptions Options(RpeUnit unit, double delta, bool all_pairs = false) {
  RpeOptions options;
  options.unit = unit;
  options.delta = delta;
  options.all_pairs = all_pairs;
  return options;
}

TEST(Rpe, ZeroForTheSamePathInAnotherWorld) {
  const auto ground_truth = CurvedPath(120);
  const auto estimate = Transformed(ground_truth, Sim3d(ExpSo3({1, -2, 0.5}), {1, 2, 3}, 4.2));
  for (const RpeUnit unit : {RpeUnit::kFrames, RpeUnit::kSeconds, RpeUnit::kMetres}) {
    const RpeReport report = EvaluateRpe(ground_truth, estimate, Options(unit, 1));
    ASSERT_TRUE(report.usable()) << report.reason;
    EXPECT_LT(report.translation.max, 1e-10);
    EXPECT_LT(report.rotation_deg.max, 1e-5);
  }
}

TEST(Rpe, ASteadyDriftShowsAtItsRate) {
  // A straight walk at 1 m/s whose estimate turns by 3 degrees per second about the line of sight.
  std::vector<StampedPose> ground_truth, estimate;
  for (int i = 0; i <= 300; ++i) {
    const double t = i / 30.0;
    const Eigen::Vector3d position(std::sin(t), t, std::cos(t));
    const int64_t stamp_ns = i * 33'333'333LL;
    ground_truth.push_back({stamp_ns, Rigid3d(Eigen::Quaterniond::Identity(), position)});
    estimate.push_back({stamp_ns, Rigid3d(ExpSo3({0, 0, 3.0 * t * std::numbers::pi / 180}), position)});
  }
  const RpeReport second = EvaluateRpe(ground_truth, estimate, Options(RpeUnit::kSeconds, 1));
  EXPECT_EQ(second.motions.size(), 271u);
  EXPECT_NEAR(second.rotation_deg.mean, 3.0, 1e-6);
  const RpeReport frame = EvaluateRpe(ground_truth, estimate, Options(RpeUnit::kFrames, 1));
  EXPECT_EQ(frame.motions.size(), 300u);
  EXPECT_NEAR(frame.rotation_deg.mean, 0.1, 1e-6);
}

TEST(Rpe, SecondsSkipGaps) {
  auto path = CurvedPath(90);
  auto with_gap = path;
  with_gap.erase(with_gap.begin() + 30, with_gap.begin() + 60);
  const RpeReport report = EvaluateRpe(path, with_gap, Options(RpeUnit::kSeconds, 1));
  EXPECT_FALSE(report.usable());  // every pose's counterpart one second later is missing
  EXPECT_EQ(EvaluateRpe(path, with_gap, Options(RpeUnit::kSeconds, 0.5)).motions.size(), 30u);
}

TEST(Rpe, PosesThatShareAGroundTruthPoseHideNoMotion) {
  // Ground truth at 100 Hz with a tenth of a second missing, beside which poses at 30 Hz share one.
  const auto path = [](int poses, double rate_hz) {
    std::vector<StampedPose> poses_at_rate;
    for (int i = 0; i < poses; ++i) {
      const double t = i / rate_hz;
      poses_at_rate.push_back(
          {std::llround(t * 1e9), Rigid3d(Eigen::Quaterniond::Identity(), {std::sin(t), std::cos(t), t})});
    }
    return poses_at_rate;
  };
  auto ground_truth = path(400, 100);
  const auto estimate = path(120, 30);
  ground_truth.erase(ground_truth.begin() + 101, ground_truth.begin() + 110);
  auto options = Options(RpeUnit::kSeconds, 1);
  options.max_difference_ns = 40'000'000;
  const RpeReport report = EvaluateRpe(ground_truth, estimate, options);
  ASSERT_EQ(report.pairs.size(), 120u);
  EXPECT_EQ(report.pairs[30].ground_truth, report.pairs[31].ground_truth);
  // The last 29 poses have no counterpart; all others do, those before the gap among them.
  EXPECT_EQ(report.motions.size(), 91u);
  for (const MotionPair& motion : report.motions) {
    EXPECT_NEAR(static_cast<double>(motion.to - motion.from), 30.0, 1.0);
  }
}

TEST(Rpe, MetresAreMeasuredAlongTheGroundTruth) {
  std::vector<StampedPose> path;
  for (int i = 0; i < 50; ++i) {
    path.push_back(
        {i * 33'333'333LL, Rigid3d(Eigen::Quaterniond::Identity(), {0.25 * i, i % 2 ? 0.0 : 1e-9, 0})});
  }
  auto options = Options(RpeUnit::kMetres, 0.9);
  options.alignment = Alignment::kNone;
  const RpeReport end_to_end = EvaluateRpe(path, path, options);
  ASSERT_FALSE(end_to_end.motions.empty());
  for (const MotionPair& motion : end_to_end.motions) EXPECT_EQ(motion.to - motion.from, 4u);
  options.all_pairs = true;
  EXPECT_EQ(EvaluateRpe(path, path, options).motions.size(), 46u);
}

TEST(Rpe, EndToEndAndAllPairsInFrames) {
  const auto path = CurvedPath(101);
  EXPECT_EQ(EvaluateRpe(path, path, Options(RpeUnit::kFrames, 10)).motions.size(), 10u);
  EXPECT_EQ(EvaluateRpe(path, path, Options(RpeUnit::kFrames, 10, true)).motions.size(), 91u);
}

TEST(Rpe, BadOptionsAreNamed) {
  const auto path = CurvedPath(30);
  EXPECT_NE(EvaluateRpe(path, path, Options(RpeUnit::kFrames, 0)).reason.find("positive"), std::string::npos);
  EXPECT_NE(EvaluateRpe(path, path, Options(RpeUnit::kFrames, 1.5)).reason.find("whole"), std::string::npos);
  EXPECT_NE(EvaluateRpe(path, path, Options(RpeUnit::kFrames, 1e30)).reason.find("1e9"), std::string::npos);
  EXPECT_NE(EvaluateRpe(path, path, Options(RpeUnit::kSeconds, 99)).reason.find("apart"), std::string::npos);
}

}  // namespace
}  // namespace dmslam
