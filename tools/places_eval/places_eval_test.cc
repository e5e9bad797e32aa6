#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "dmslam/place_recognition/vocabulary.h"
#include "evaluate.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

PlacesResult::Query Query(bool expected, double confidence, bool right, bool near) {
  PlacesResult::Query query;
  query.expected = expected;
  query.answers[0] = {confidence, right, near};
  return query;
}

TEST(PrecisionRecall, CountsRightNearAndFalseAnswers) {
  PlacesResult result;
  result.queries = {Query(true, 0.9, true, true),   Query(false, 0.8, false, true),
                    Query(true, 0.7, true, true),   Query(false, 0.6, false, false),
                    Query(true, 0.0, false, false), Query(true, 0.5, true, true)};
  result.num_expected = 4;
  const auto curve = PrecisionRecall(result, Stage::kScore);
  ASSERT_EQ(curve.size(), 5U);
  EXPECT_DOUBLE_EQ(curve[1].precision, 0.5);
  EXPECT_DOUBLE_EQ(curve[1].place_precision, 1.0);
  EXPECT_DOUBLE_EQ(curve[3].precision, 0.5);
  EXPECT_DOUBLE_EQ(curve[3].place_precision, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(curve[4].recall, 0.75);
  EXPECT_DOUBLE_EQ(BestWithoutError(curve, false).recall, 0.25);
  EXPECT_DOUBLE_EQ(BestWithoutError(curve, true).recall, 0.5);
  EXPECT_TRUE(PrecisionRecall(result, Stage::kPose).empty());
  EXPECT_EQ(BestWithoutError({}, false).recall, 0.0);
}

TEST(PrecisionRecall, AnswersOfEqualConfidenceStandOrFallTogether) {
  PlacesResult result;
  result.queries = {Query(true, 5, true, true), Query(false, 5, false, false), Query(true, 4, true, true)};
  result.num_expected = 2;
  const auto curve = PrecisionRecall(result, Stage::kScore);
  ASSERT_EQ(curve.size(), 2U);
  EXPECT_DOUBLE_EQ(curve[0].precision, 0.5);
  EXPECT_EQ(BestWithoutError(curve, false).recall, 0.0);
}

/// Views within 0.3 and 20 degrees, more than five seconds apart, of a real kitchen.
TEST(PlacesEval, RecognisesTheKitchen) {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  if (source == nullptr) GTEST_SKIP() << "DMSLAM_SOURCE_DIR is not set";
  const char* data = std::getenv("DMSLAM_DATA");
  const fs::path sequence =
      (data != nullptr ? fs::path(data) : fs::path(source) / "../shared/data") / "kitchen";
  if (!fs::exists(sequence)) GTEST_SKIP() << sequence << " is absent; set DMSLAM_DATA";
  PlacesOptions options;
  options.sequence = sequence.string();
  options.vocabulary = (fs::path(source) / "data/vocabulary.dmv").string();
  options.camera = {525.505, 525.505, 320.0, 240.0};
  const PlacesResult result = EvaluatePlaces(options);
  EXPECT_EQ(result.queries.size(), 200U);
  EXPECT_EQ(result.num_expected, 41U);
  const auto by_pose = PrecisionRecall(result, Stage::kPose);
  const CurvePoint strict = BestWithoutError(by_pose, false);
  const CurvePoint place = BestWithoutError(by_pose, true);
  RecordProperty("recall_at_full_precision", std::to_string(strict.recall));
  RecordProperty("recall_without_false_place", std::to_string(place.recall));
  EXPECT_GE(strict.recall, 0.5);
  EXPECT_GE(place.recall, 0.7);
}

}  // namespace
}  // namespace dmslam
