#include "dmslam/dynamics/motion_belief.h"

#include <gtest/gtest.h>

#include <vector>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kNow = 10'000'000'000;

/// A map of a few landmarks, of which frames say something.
class MotionBeliefTest : public ::testing::Test {
 protected:
  static constexpr size_t kPoints = 10;

  MotionBeliefTest() {
    scene_.AddCloud(kPoints, {0, 0, 4}, {1, 1, 0.1});
    scene_.MapAll(2);
  }

  /// A landmark was found in its place, and elsewhere, so often.
  EvidenceReport Say(size_t point, uint16_t found, uint16_t moved, int64_t stamp_ns = kNow) {
    FrameEvidence evidence;
    evidence.stamp_ns = stamp_ns;
    evidence.items.push_back({MapScene::IdOf(point), static_cast<uint16_t>(found + moved), found, moved});
    return ApplyEvidence(scene_.map(), evidence, options_);
  }
  const Landmark* Find(size_t point) const { return scene_.map().FindLandmark(MapScene::IdOf(point)); }
  float BeliefOf(size_t point) const { return Find(point)->evidence.motion_belief; }

  MapScene scene_;
  MotionBeliefOptions options_;
};

TEST_F(MotionBeliefTest, WhatIsSeenElsewhereIsBelievedToMoveAndWhatIsFoundIsNot) {
  EXPECT_TRUE(IsStatic(Find(0)));
  Say(0, 0, 1);
  EXPECT_FALSE(IsStatic(Find(0)));
  EXPECT_TRUE(IsStatic(Find(1))) << "nothing was said of it";
  Say(0, 2, 0);
  EXPECT_TRUE(IsStatic(Find(0)));
  EXPECT_FALSE(IsStatic(nullptr)) << "nor is what is gone";
}

TEST_F(MotionBeliefTest, WhatIsAsLikelyToMoveAsToStandIsBelievedToStand) {
  LandmarkEvidence evidence;
  EXPECT_FALSE(IsBelievedToMove(evidence)) << "nothing was said of it";
  for (const float belief : {kBelievedToMove, kLowestBelief}) {
    evidence.motion_belief = belief;
    EXPECT_FALSE(IsBelievedToMove(evidence)) << belief;
  }
  evidence.motion_belief = kBelievedToMove + 0.01F;
  EXPECT_TRUE(IsBelievedToMove(evidence));
}

TEST_F(MotionBeliefTest, WhatGoesOnMovingLeavesTheMap) {
  EXPECT_EQ(Say(0, 0, 2).removed, 0);
  ASSERT_NE(Find(0), nullptr);
  EXPECT_EQ(Say(0, 0, 1).removed, 1);
  EXPECT_EQ(Find(0), nullptr);
  EXPECT_EQ(scene_.map().num_landmarks(), kPoints - 1);
}

TEST_F(MotionBeliefTest, OnlyBeyondTheBoundALandmarkIsToBeRemoved) {
  LandmarkEvidence evidence;
  evidence.motion_belief = options_.remove_above;
  EXPECT_FALSE(IsToBeRemoved(evidence, options_));
  evidence.motion_belief += 0.5F;
  EXPECT_TRUE(IsToBeRemoved(evidence, options_));
  options_.enabled = false;
  EXPECT_FALSE(IsToBeRemoved(evidence, options_)) << "switched off, belief removes nothing";
}

TEST_F(MotionBeliefTest, HoweverLongItStoodWhatBeginsToMoveLeavesSoon) {
  for (int i = 0; i < 50; ++i) Say(0, 30, 0);
  EXPECT_FLOAT_EQ(BeliefOf(0), kLowestBelief);
  int frames = 0;
  while (Find(0) != nullptr && frames < 100) {
    Say(0, 0, 1);
    ++frames;
  }
  EXPECT_EQ(frames, 7);
}

TEST_F(MotionBeliefTest, WhatIsSeenBothWaysIsBelievedByTheSum) {
  Say(0, 1, 2);
  EXPECT_FLOAT_EQ(BeliefOf(0), 1.5F);
}

TEST_F(MotionBeliefTest, AllThatFramesSayIsCounted) {
  Say(0, 3, 1, kNow);
  Say(0, 4, 0, kNow + 5);
  const LandmarkEvidence& evidence = Find(0)->evidence;
  EXPECT_EQ(evidence.visible, 8U);
  EXPECT_EQ(evidence.found, 7U);
  EXPECT_EQ(evidence.moved, 1U);
  EXPECT_EQ(evidence.last_moved_ns, kNow) << "when it was seen elsewhere last";
  Say(0, 0, 1, kNow - 5);
  EXPECT_EQ(Find(0)->evidence.last_moved_ns, kNow) << "evidence of before came late";
}

TEST_F(MotionBeliefTest, WhatIsSaidOfALandmarkIsSaidOfTheOneItBecame) {
  scene_.map().Fuse(*Find(0), *Find(1), Merged(Find(1)->evidence, Find(0)->evidence));
  EXPECT_EQ(Say(0, 0, 1).applied, 1);
  EXPECT_FLOAT_EQ(BeliefOf(1), 1.0F);
}

TEST_F(MotionBeliefTest, OfTwoThatBecomeOneAllThatWasSaidCountsAndTheOneThatStaysIsBelieved) {
  const LandmarkEvidence goes{10, 8, 1, 2.0F, 7}, stays{5, 4, 2, -1.0F, 3};
  EXPECT_EQ(Merged(stays, goes), (LandmarkEvidence{15, 12, 3, -1.0F, 3}));
}

TEST_F(MotionBeliefTest, OfOneThatIsGoneNothingIsKept) {
  scene_.map().RemoveLandmark(*Find(0));
  const EvidenceReport report = Say(0, 0, 1);
  EXPECT_EQ(report.unknown, 1);
  EXPECT_EQ(report.applied, 0);
}

TEST_F(MotionBeliefTest, SwitchedOffItIsCountedAndNothingMore) {
  options_.enabled = false;
  Say(0, 0, 100);
  ASSERT_NE(Find(0), nullptr);
  EXPECT_EQ(Find(0)->evidence.moved, 100U);
  EXPECT_TRUE(IsStatic(Find(0)));
}

TEST_F(MotionBeliefTest, OnlyWhatIsStaticSpeaksForAPlace) {
  Say(3, 0, 1);
  const Keyframe& keyframe = scene_.map().At(KeyframeId::Make(MapScene::kSession, 0));
  std::vector<uint8_t> expected(kPoints, 1);
  expected[3] = 0;
  EXPECT_EQ(StaticFeatures(scene_.map(), keyframe), expected);
  std::vector<const Landmark*> landmarks{Find(2), Find(3), Find(kPoints + 5)};
  KeepStatic(&landmarks);
  EXPECT_EQ(landmarks, std::vector<const Landmark*>{Find(2)});
}

}  // namespace
}  // namespace dmslam
