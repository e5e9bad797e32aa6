#include "mapper/loop_answers.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr uint32_t kSession = 4;

/// A correction as a group of three records.
std::vector<LoopAnswer> Correction(uint64_t id) {
  LoopAnswer answer;
  answer.keyframe = KeyframeId::Make(kSession, 9);
  answer.correction_id = id;
  answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
  for (uint32_t frame : {1, 2, 3}) answer.corrections.push_back({KeyframeId::Make(kSession, frame), {}});
  return wire::Split(answer, 1);
}

TEST(LoopAnswers, AGroupIsOneAnswerOfTheVersionOfItsLastRecord) {
  LoopAnswers answers;
  const std::vector<LoopAnswer> records = Correction(5);
  ASSERT_EQ(records.size(), 3U);
  for (size_t i = 0; i < records.size(); ++i) {
    EXPECT_TRUE(answers.empty()) << i;
    EXPECT_TRUE(answers.Add(records[i], Term{1, 1}, Version{1, static_cast<int64_t>(i) + 1}).empty());
  }
  ASSERT_FALSE(answers.empty());
  const LoopAnswers::Answer answer = answers.TakeFirst();
  EXPECT_EQ(answer.answer.correction_id, 5U);
  EXPECT_EQ(answer.answer.corrections.size(), 3U);
  EXPECT_EQ(answer.version, (Version{1, 3}));
  EXPECT_TRUE(answers.empty());
  EXPECT_FALSE(answers.TakeLost());
}

TEST(LoopAnswers, AGroupThatLacksARecordIsNamedOnceAsBroken) {
  LoopAnswers answers;
  const std::vector<LoopAnswer> records = Correction(6);
  EXPECT_TRUE(answers.Add(records[0], Term{1, 1}, Version{1, 1}).empty());
  EXPECT_EQ(answers.Add(records[2], Term{1, 1}, Version{1, 2}).size(), 1U);
  EXPECT_TRUE(answers.empty());
  EXPECT_TRUE(answers.TakeLost());
  EXPECT_FALSE(answers.TakeLost());
  EXPECT_EQ(answers.TakeBroken(), std::vector<uint64_t>{6});
  EXPECT_TRUE(answers.TakeBroken().empty());
}

TEST(LoopAnswers, AGroupWhoseWriterIsSucceededIsReportedAndTheNextOneHeard) {
  LoopAnswers answers;
  EXPECT_TRUE(answers.Add(Correction(7)[0], Term{1, 1}, Version{1, 1}).empty());
  std::vector<std::string> problems;
  for (const LoopAnswer& record : Correction(8)) {
    for (const std::string& problem : answers.Add(record, Term{2, 2}, Version{2, 1}))
      problems.push_back(problem);
  }
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_NE(problems[0].find("its writer is gone"), std::string::npos) << problems[0];
  EXPECT_TRUE(answers.TakeBroken().empty()) << "its successor says it again";
  ASSERT_FALSE(answers.empty());
  EXPECT_EQ(answers.TakeFirst().answer.correction_id, 8U);
}

TEST(LoopAnswers, WhatCannotBeReadIsLost) {
  LoopAnswers answers;
  answers.AddUnreadable();
  EXPECT_TRUE(answers.TakeLost());
  EXPECT_TRUE(answers.TakeBroken().empty());
}

}  // namespace
}  // namespace dmslam
