#include "dmslam/dynamics/landmark_votes.h"

#include <gtest/gtest.h>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

TEST(LandmarkVotesTest, WhatIsBelievedToMoveHasNone) {
  Landmark landmark;
  landmark.id = MapScene::IdOf(0);
  const LandmarkVotes votes({});
  EXPECT_TRUE(votes.HasVote(landmark));
  landmark.evidence.motion_belief = 0.1F;
  EXPECT_FALSE(votes.HasVote(landmark));
  EXPECT_TRUE(LandmarkVotes({.motion_belief = false}).HasVote(landmark));
}

TEST(LandmarkVotesTest, AStreakElsewhereCostsTheVoteUntilItIsFound) {
  Landmark landmark;
  landmark.id = MapScene::IdOf(0);
  LandmarkVotes votes({});
  for (int sighting = 0; sighting < 3; ++sighting) {
    EXPECT_TRUE(votes.HasVote(landmark)) << sighting;
    votes.OnSeenElsewhere(landmark.id);
  }
  EXPECT_FALSE(votes.HasVote(landmark));
  votes.OnFound(landmark.id);
  EXPECT_TRUE(votes.HasVote(landmark));
}

/// The pose by which it lay elsewhere was wrong.
TEST(LandmarkVotesTest, ASightingThatIsTakenBackCostsNothing) {
  Landmark landmark;
  landmark.id = MapScene::IdOf(0);
  LandmarkVotes votes({});
  for (int sighting = 0; sighting < 5; ++sighting) {
    votes.OnSeenElsewhere(landmark.id);
    votes.TakeBackSeenElsewhere(landmark.id);
  }
  votes.TakeBackSeenElsewhere(landmark.id);
  for (int sighting = 0; sighting < 3; ++sighting) {
    EXPECT_TRUE(votes.HasVote(landmark)) << sighting;
    votes.OnSeenElsewhere(landmark.id);
  }
  EXPECT_FALSE(votes.HasVote(landmark));
}

TEST(LandmarkVotesTest, TrustGrowsWithAge) {
  const LandmarkVotes votes({.young_trust = 0.3, .trusted_age_s = 4.0});
  EXPECT_DOUBLE_EQ(votes.Trust(0), 0.3);
  EXPECT_DOUBLE_EQ(votes.Trust(2), 0.65);
  EXPECT_DOUBLE_EQ(votes.Trust(9), 1.0);
}

/// Keyframes see it from 10 to 10.1 s.
TEST(LandmarkVotesTest, AgeCountsFromTheFarEndOfTheTimeInWhichItIsSeen) {
  constexpr int64_t kSecond = 1'000'000'000;
  MapScene scene;
  scene.AddPoint({0, 0, 4}, 10 * kSecond);
  scene.MapAll(4, 0.05, 300, 10 * kSecond);
  const auto age_s = [&](double at_s) {
    return LandmarkAges(scene.map(), static_cast<int64_t>(at_s * 1e9)).Of(scene.map().At(MapScene::IdOf(0)));
  };
  EXPECT_NEAR(age_s(15), 5, 1e-9) << "since it was made";
  EXPECT_NEAR(age_s(7), 3.1, 1e-6) << "time runs backwards";
  Landmark unseen;
  unseen.first_ns = 10 * kSecond;
  EXPECT_NEAR(LandmarkAges(scene.map(), 7 * kSecond).Of(unseen), 3, 1e-9);
}

TEST(LandmarkVotesTest, OldIsWhatWasMadeLongBefore) {
  constexpr int64_t kSecond = 1'000'000'000;
  Landmark landmark;
  landmark.first_ns = 10 * kSecond;
  const auto old = [&](int64_t at_s) { return IsOldAt(landmark, at_s * kSecond, {.trusted_age_s = 4.0}); };
  EXPECT_FALSE(old(13));
  EXPECT_TRUE(old(14));
  EXPECT_FALSE(old(2)) << "where time runs backwards none is";
}

TEST(LandmarkVotesTest, OfAMapThatIsGoneNothingIsRemembered) {
  Landmark landmark;
  landmark.id = MapScene::IdOf(0);
  LandmarkVotes votes({});
  for (int sighting = 0; sighting < 3; ++sighting) votes.OnSeenElsewhere(landmark.id);
  ASSERT_FALSE(votes.HasVote(landmark));
  votes.Reset();
  EXPECT_TRUE(votes.HasVote(landmark));
}

TEST(LandmarkVotesTest, SwitchedOffAllAreEqual) {
  EXPECT_DOUBLE_EQ(LandmarkVotes({.motion_belief = false}).Trust(0), 1.0);
}

}  // namespace
}  // namespace dmslam
