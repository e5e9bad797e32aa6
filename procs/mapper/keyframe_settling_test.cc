#include "mapper/keyframe_settling.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr Term kNobody;
constexpr Term kFirst{10, 3}, kSecond{11, 4};

KeyframeId Id(uint32_t frame) { return KeyframeId::Make(4, frame); }
KeyframeSettling::Keyframe KeyframeOf(uint32_t frame) { return {Id(frame), 2, {1, frame + 100}}; }

TEST(KeyframeSettlingTest, AKeyframeSettlesWithItsAnswer) {
  KeyframeSettling settling;
  EXPECT_FALSE(settling.Awaits());
  settling.Await(KeyframeOf(7), kFirst);
  EXPECT_TRUE(settling.Awaits());
  EXPECT_FALSE(settling.TakeQuestion(kFirst)) << "it has heard of it";
  const auto settled = settling.OnAnswer(Id(7));
  ASSERT_TRUE(settled);
  EXPECT_EQ(settled->id, Id(7));
  EXPECT_EQ(settled->map_id, 2U);
  EXPECT_EQ(settled->version, (Version{1, 107}));
  EXPECT_FALSE(settling.Awaits());
  EXPECT_FALSE(settling.TakeQuestion(kSecond)) << "nothing is due";
}

TEST(KeyframeSettlingTest, TheAnswerToAnotherKeyframeIsAReasonToAskAgainOnce) {
  KeyframeSettling settling;
  settling.Await(KeyframeOf(7), kFirst);
  EXPECT_FALSE(settling.OnAnswer(Id(6)));
  EXPECT_TRUE(settling.Awaits());
  const auto question = settling.TakeQuestion(kFirst);
  ASSERT_TRUE(question);
  EXPECT_EQ(question->id, Id(7));
  EXPECT_FALSE(settling.TakeQuestion(kFirst));
}

TEST(KeyframeSettlingTest, WhatIsLostMayHaveBeenTheAnswer) {
  KeyframeSettling settling;
  settling.OnLost();
  settling.Await(KeyframeOf(7), kFirst);
  EXPECT_FALSE(settling.TakeQuestion(kFirst)) << "that was before it was asked";
  settling.OnLost();
  EXPECT_TRUE(settling.TakeQuestion(kFirst));
  settling.OnLost();
  EXPECT_TRUE(settling.OnAnswer(Id(7)));
  settling.Await(KeyframeOf(8), kFirst);
  EXPECT_FALSE(settling.TakeQuestion(kFirst)) << "that was another's";
}

TEST(KeyframeSettlingTest, AnotherLoopCloserIsAskedAgain) {
  KeyframeSettling settling;
  settling.Await(KeyframeOf(7), kFirst);
  EXPECT_TRUE(settling.TakeQuestion(kSecond));
  EXPECT_FALSE(settling.TakeQuestion(kSecond));
}

TEST(KeyframeSettlingTest, TheFirstLoopCloserHearsOfItWithTheMap) {
  KeyframeSettling settling;
  settling.Await(KeyframeOf(7), kNobody);
  EXPECT_FALSE(settling.TakeQuestion(kNobody));
  EXPECT_FALSE(settling.TakeQuestion(kFirst));
  EXPECT_TRUE(settling.TakeQuestion(kSecond)) << "it does not know what the first one was asked";
}

TEST(KeyframeSettlingTest, TheLastOneIsKnown) {
  KeyframeSettling settling;
  EXPECT_EQ(settling.last_settled(), std::nullopt);
  settling.OnSettled(Id(7));
  settling.Await(KeyframeOf(8), kFirst);
  settling.OnAnswer(Id(8));
  EXPECT_EQ(settling.last_settled(), Id(7)) << "that its answer is here is not all";
  settling.OnSettled(Id(8));
  EXPECT_EQ(settling.last_settled(), Id(8));
}

}  // namespace
}  // namespace dmslam
