#include "frontend/camera_turns.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr Term kMapper{10, 3};

TEST(CameraTurnsTest, OneCameraWaitsForNobody) {
  CameraTurns turns;
  EXPECT_TRUE(turns.Has(0));
  EXPECT_FALSE(turns.Ask(0, TurnTime::Of(100), kMapper));
  EXPECT_FALSE(turns.Waits());
}

TEST(CameraTurnsTest, AFrameHasItsTurnWhenTheMapperSaysSo) {
  CameraTurns turns(2);
  EXPECT_FALSE(turns.Has(5));
  const auto request = turns.Ask(5, TurnTime::Of(100), kMapper);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->frame_index, 5U);
  EXPECT_EQ(request->time.stamp_ns, 100);
  EXPECT_EQ(request->camera_id, 2);
  EXPECT_TRUE(turns.Waits());
  EXPECT_FALSE(turns.Ask(5, TurnTime::Of(100), kMapper)) << "it was put already";

  turns.OnTurn(KeyframeId::Make(1, 5, 1));
  EXPECT_FALSE(turns.Has(5)) << "another camera's";
  turns.OnTurn(KeyframeId::Make(1, 4, 2));
  EXPECT_FALSE(turns.Has(5)) << "of an earlier frame";
  turns.OnTurn(KeyframeId::Make(1, 5, 2));
  EXPECT_TRUE(turns.Has(5));
  EXPECT_FALSE(turns.Waits());
  EXPECT_FALSE(turns.Has(6));
  EXPECT_TRUE(turns.Ask(6, TurnTime::Of(200), kMapper));
  EXPECT_FALSE(turns.Has(5));
}

TEST(CameraTurnsTest, AMapperThatWasStartedAgainIsAskedAgain) {
  CameraTurns turns(0);
  EXPECT_FALSE(turns.Ask(5, TurnTime::Of(100), Term())) << "nobody is there";
  EXPECT_FALSE(turns.Waits());
  EXPECT_TRUE(turns.Ask(5, TurnTime::Of(100), kMapper));
  EXPECT_TRUE(turns.Ask(5, TurnTime::Of(100), {11, 4}));
  EXPECT_FALSE(turns.Ask(5, TurnTime::Of(100), {11, 4}));
}

TEST(CameraTurnsTest, WhatIsDoneAtTheEndHasATurnToo) {
  CameraTurns turns(1);
  const auto request = turns.Ask(CameraTurns::kTheEnd, TurnTime::AtTheEnd(), kMapper);
  ASSERT_TRUE(request);
  EXPECT_TRUE(request->time.IsAtTheEnd());
  turns.OnTurn(KeyframeId::Make(1, CameraTurns::kTheEnd, 1));
  EXPECT_TRUE(turns.Has(CameraTurns::kTheEnd));
}

}  // namespace
}  // namespace dmslam
