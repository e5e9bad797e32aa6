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

TEST(LandmarkVotesTest, TrustGrowsWithAge) {
  Landmark landmark;
  const LandmarkVotes votes({.young_trust = 0.3, .trusted_age_s = 4.0});
  EXPECT_DOUBLE_EQ(votes.Trust(landmark, 0), 0.3);
  EXPECT_DOUBLE_EQ(votes.Trust(landmark, 2'000'000'000), 0.65);
  EXPECT_DOUBLE_EQ(votes.Trust(landmark, 9'000'000'000), 1.0);
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
  Landmark young;
  young.first_ns = 10'000'000'000;
  EXPECT_DOUBLE_EQ(LandmarkVotes({.motion_belief = false}).Trust(young, young.first_ns), 1.0);
}

}  // namespace
}  // namespace dmslam
