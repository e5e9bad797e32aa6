#include "dmslam/evaluation/ate.h"

#include <gtest/gtest.h>

#include "dmslam/evaluation/evaluation_test_util.h"

namespace dmslam {
namespace {

const Sim3d kOtherWorld(ExpSo3({0.4, -1.2, 2.0}), {3, -2, 5}, 0.37);

TEST(Ate, ZeroForTheSamePathInAnotherWorld) {
  const auto ground_truth = CurvedPath(120);
  const AteReport report = EvaluateAte(ground_truth, Transformed(ground_truth, kOtherWorld));
  ASSERT_TRUE(report.usable()) << report.reason;
  EXPECT_LT(report.statistics.max, 1e-12);
  EXPECT_NEAR(report.scale(), 1 / kOtherWorld.scale, 1e-10);
  EXPECT_EQ(report.pairs.size(), 120u);
}

TEST(Ate, EachAlignmentRemovesWhatItMayAndNoMore) {
  const auto ground_truth = CurvedPath(120);
  const Sim3d moved(kOtherWorld.rotation, kOtherWorld.translation, 1.0);
  const Sim3d scaled(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), 0.37);
  const auto rmse = [&](const Sim3d& world, Alignment alignment) {
    return EvaluateAte(ground_truth, Transformed(ground_truth, world), {alignment, 20'000'000}).rmse();
  };
  EXPECT_LT(rmse(moved, Alignment::kSe3), 1e-12);
  EXPECT_GT(rmse(scaled, Alignment::kSe3), 0.1);
  EXPECT_LT(rmse(scaled, Alignment::kScale), 1e-12);
  EXPECT_GT(rmse(moved, Alignment::kScale), 0.1);
  EXPECT_LT(rmse(Sim3d(), Alignment::kNone), 1e-15);
  EXPECT_GT(rmse(scaled, Alignment::kNone), 0.1);
}

TEST(Ate, IsTheNoiseOfTheEstimate) {
  const auto ground_truth = CurvedPath(2000);
  const auto estimate = WithNoise(ground_truth, 0.01, 5);
  EXPECT_NEAR(EvaluateAte(ground_truth, Transformed(estimate, kOtherWorld)).rmse(), 0.01 * std::sqrt(3.0),
              4e-4);
}

TEST(Ate, DoesNotDependOnTheWorldOfTheEstimate) {
  const auto ground_truth = CurvedPath(200);
  const auto estimate = WithNoise(ground_truth, 0.02, 9);
  const double one = EvaluateAte(ground_truth, estimate).rmse();
  const double other = EvaluateAte(ground_truth, Transformed(estimate, kOtherWorld)).rmse();
  EXPECT_NEAR(one, other, 1e-12);
}

TEST(Ate, SaysWhyThereIsNoResult) {
  const auto path = CurvedPath(30);
  const std::vector<StampedPose> two(path.begin(), path.begin() + 2);
  EXPECT_FALSE(EvaluateAte(path, two).usable());
  auto standing = path;
  for (StampedPose& pose : standing) pose.T_world_cam.translation.setZero();
  const AteReport report = EvaluateAte(path, standing);
  EXPECT_NE(report.reason.find("one point"), std::string::npos);
}

}  // namespace
}  // namespace dmslam
