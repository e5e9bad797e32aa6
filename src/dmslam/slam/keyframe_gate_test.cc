#include "dmslam/slam/keyframe_gate.h"

#include <gtest/gtest.h>

#include <optional>

namespace dmslam {
namespace {

TEST(KeyframeGateTest, OneAtATime) {
  KeyframeGate gate;
  const KeyframeId id = KeyframeId::Make(1, 50);
  EXPECT_TRUE(gate.IsOpen());
  gate.OnProposed(id, 1000);
  EXPECT_FALSE(gate.IsOpen());
  EXPECT_EQ(gate.awaited(), id);
  gate.OnSettled(KeyframeId::Make(1, 40));
  EXPECT_FALSE(gate.IsOpen()) << "an older one";
  gate.OnSettled(KeyframeId::Make(1, 60));
  EXPECT_TRUE(gate.IsOpen()) << "it was settled before that";
  gate.SetWithheld(true);
  EXPECT_FALSE(gate.IsOpen());
  EXPECT_EQ(gate.SinceNs(400), 600);
  EXPECT_EQ(gate.step_ns(), std::nullopt);
  gate.OnFrame(1000);
  gate.OnFrame(1030);
  EXPECT_EQ(gate.step_ns(), 30);
}

TEST(KeyframeGateTest, WhileTheMapGrowsBackEachIsSettledByItself) {
  KeyframeGate gate;
  const KeyframeId id = KeyframeId::Make(1, 50);
  gate.ContinueAfter(2000);
  gate.OnProposed(id, 1000);
  gate.OnSettled(KeyframeId::Make(1, 60));
  EXPECT_FALSE(gate.IsOpen()) << "while the map grows back, newer ones were settled long ago";
  gate.OnSettled(id);
  EXPECT_TRUE(gate.IsOpen());
}

TEST(KeyframeGateTest, BeforeTheFirstKeyframeNothingHasPassed) {
  KeyframeGate gate;
  EXPECT_FALSE(gate.SinceNs(400));
  gate.OnProposed(KeyframeId::Make(1, 0), 0);
  EXPECT_EQ(gate.SinceNs(400), 400);
}

TEST(KeyframeGateTest, WhatIsSettledOfAnotherCameraOpensNothing) {
  KeyframeGate gate;
  gate.OnProposed(KeyframeId::Make(1, 50, 0), 1000);
  gate.OnSettled(KeyframeId::Make(1, 60, 1));
  EXPECT_FALSE(gate.IsOpen());
  gate.OnSettled(KeyframeId::Make(1, 50, 0));
  EXPECT_TRUE(gate.IsOpen());
}

}  // namespace
}  // namespace dmslam
