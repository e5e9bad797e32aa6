#include "dmslam/evaluation/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dmslam/evaluation/evaluation_test_util.h"

namespace dmslam {
namespace {

/// RPE per frame, per second and per metre.
EvaluationOptions DefaultOptions() {
  EvaluationOptions options;
  options.rpe.resize(3);
  options.rpe[1].unit = RpeUnit::kSeconds;
  options.rpe[2].unit = RpeUnit::kMetres;
  return options;
}

TEST(Report, JsonHoldsTheFigures) {
  const auto ground_truth = CurvedPath(150);
  const auto estimate = WithNoise(ground_truth, 0.01, 3);
  const auto evaluation = Evaluate(ground_truth, estimate, DefaultOptions(), ComputeCoverage(estimate, 200));
  const auto json = nlohmann::json::parse(EvaluationJson(evaluation));
  EXPECT_EQ(json["ate"]["rmse"].get<double>(), evaluation.ate.rmse());
  EXPECT_EQ(json["coverage"]["percent"].get<double>(), 75.0);
  EXPECT_TRUE(json["coverage"]["time_to_first_pose_s"].is_null());
  ASSERT_EQ(json["rpe"].size(), 3u);
  EXPECT_EQ(json["rpe"][1]["unit"], "seconds");
  EXPECT_EQ(json["rpe"][1]["rotation_deg"]["median"].get<double>(), evaluation.rpe[1].rotation_deg.median);
  EXPECT_EQ(json["pairs"], 150);
}

TEST(Report, TableNamesCoverageAndWhatIsMissing) {
  const auto ground_truth = CurvedPath(20);
  const auto evaluation =
      Evaluate(ground_truth, ground_truth, DefaultOptions(), ComputeCoverage(ground_truth, 25));
  const std::string table = EvaluationTable(evaluation);
  EXPECT_NE(table.find("80.0 % (20 poses, 25 frames)"), std::string::npos) << table;
  EXPECT_NE(table.find("RPE per second: none"), std::string::npos) << table;
  EXPECT_NE(table.find("RPE per frame [deg]"), std::string::npos) << table;
}

TEST(Report, NoResultSaysWhy) {
  const auto ground_truth = CurvedPath(20);
  const std::vector<StampedPose> two(ground_truth.begin(), ground_truth.begin() + 2);
  const auto evaluation = Evaluate(ground_truth, two, DefaultOptions(), ComputeCoverage(two, size_t{0}));
  EXPECT_NE(EvaluationTable(evaluation).find("fewer than three pairs"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(EvaluationJson(evaluation)).contains("reason"));
}

}  // namespace
}  // namespace dmslam
