#include "dmslam/loops/loop_verifier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/loops/testing/indexed_room.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the room and all it is made of

// ---- How well a camera sees a place ----

/// A wall that fills the image, which one keyframe sees as a whole and another, behind somebody, in part.
class Looking : public ::testing::Test {
 protected:
  static constexpr size_t kPoints = 600;
  static constexpr double kRadiusPx = 6;

  Looking() {
    scene_.AddCloud(kPoints, {0, 0, 4}, {2.5, 1.85, 0.01});
    scene_.MapAll(2);
  }

  PlaceSupport Look(const MapScene::Place& place) {
    Keyframe keyframe = scene_.map().At(KeyframeId::Make(MapScene::kSession, 0));
    keyframe.features = scene_.See(9, 0, Rigid3d(), place).features;
    return LoopVerifier({}, 1)
        .Look(scene_.map(), keyframe, Rigid3d(), scene_.map().LandmarksOf(MapScene::kMap), kRadiusPx)
        .support;
  }
  MapScene::Place Shown(const std::function<bool(size_t)>& shown) const {
    return [this, shown](size_t i) { return shown(i) ? std::optional(scene_.point(i)) : std::nullopt; };
  }

  MapScene scene_;
};

TEST_F(Looking, OfAllThatAPlaceShouldShowThePartThatIsThereIsTold) {
  const PlaceSupport whole = Look(Shown([](size_t) { return true; }));
  EXPECT_GT(whole.expected, 550);
  EXPECT_GT(whole.Share(), 0.97);
  EXPECT_EQ(whole.cells, 48);
  const PlaceSupport half = Look(Shown([&](size_t i) { return scene_.point(i).x() < 0; }));
  EXPECT_EQ(half.expected, whole.expected) << "what is hidden should be seen nevertheless";
  EXPECT_NEAR(half.Share(), 0.5, 0.06);
  EXPECT_NEAR(half.ShareOver(whole), half.Share(), 0.03);
  EXPECT_EQ(half.cells, 24);
}

TEST_F(Looking, CellsOfTheImageThatShouldShowThePlaceAgreeOrDoNot) {
  const PlaceSupport whole = Look(Shown([](size_t) { return true; }));
  EXPECT_GE(whole.anywhere.told, 46);
  EXPECT_EQ(whole.anywhere.agreeing, whole.anywhere.told);
  EXPECT_LE(whole.at_rim.told, 24) << "the outermost of 8 x 6 cells";
  EXPECT_GE(whole.at_rim.told, 22);
  const PlaceSupport figure = Look(Shown([&](size_t i) { return scene_.point(i).head<2>().norm() < 0.8; }));
  EXPECT_EQ(figure.anywhere.told, whole.anywhere.told);
  EXPECT_LE(figure.anywhere.agreeing, 12);
  EXPECT_EQ(figure.at_rim.agreeing, 0) << "around him there is nothing of the place";
}

TEST_F(Looking, AFeatureShowsOneLandmarkOnly) {
  const size_t point = 7;
  Landmark twin;
  twin.id = MapScene::IdOf(kPoints);
  twin.map_id = MapScene::kMap;
  twin.p_world = scene_.point(point);
  twin.descriptor = scene_.map().At(MapScene::IdOf(point)).descriptor;
  twin.reference = twin.first_keyframe = KeyframeId::Make(MapScene::kSession, 0);
  scene_.map().AddLandmark(twin);
  const Keyframe& other = scene_.map().At(KeyframeId::Make(MapScene::kSession, 1));
  scene_.map().SetObservation(other, point, scene_.map().At(twin.id));
  const PlaceSupport support = Look(Shown([&](size_t i) { return i == point; }));
  EXPECT_EQ(support.found, 1);
}

TEST_F(Looking, WhatLooksOtherwiseIsNotThePlace) {
  const auto elsewhere = [&](size_t i) { return std::optional(scene_.point((i + 1) % kPoints)); };
  EXPECT_LT(Look(elsewhere).Share(), 0.02);
}

TEST_F(Looking, LandmarksThatAreBelievedToMoveAreNoPlace) {
  const Keyframe& place = scene_.map().At(KeyframeId::Make(MapScene::kSession, 0));
  ASSERT_EQ(StaticLandmarksAround(scene_.map(), place, 15, 15).size(), kPoints);
  LandmarkEvidence moves;
  moves.motion_belief = 1.0F;
  scene_.map().SetEvidence(scene_.map().At(MapScene::IdOf(3)), moves);
  const std::vector<const Landmark*> around = StaticLandmarksAround(scene_.map(), place, 15, 15);
  EXPECT_EQ(around.size(), kPoints - 1);
  EXPECT_EQ(std::ranges::count(around, MapScene::IdOf(3), &Landmark::id), 0);
}

// ---- A keyframe that may show a place ----

void ExpectNear(const Sim3d& found, const Sim3d& truth, double distance = 0.03) {
  EXPECT_LT(AngleBetween(found.rotation, truth.rotation), 0.01);
  EXPECT_LT((found.Inverse().translation - truth.Inverse().translation).norm(), distance);
  EXPECT_NEAR(found.scale / truth.scale, 1.0, 0.01);
}

TEST(ProposeTest, AReturnIsFoundWhereItIsAndAsLargeAsItIs) {
  const IndexedRoom room({}, kPerRound + 6);
  const auto loop = room.Propose({}, kPerRound + 3, 3);
  ASSERT_TRUE(loop);
  EXPECT_FALSE(loop->joins);
  ExpectNear(loop->S_keyframe_place, room.TrueLoop(kPerRound + 3, 3).S_keyframe_place);
  EXPECT_GT(loop->share, 0.5);
  EXPECT_GT(loop->support.cells, 20);
}

TEST(ProposeTest, AReturnWithFewLandmarksOfItsOwnIsFoundByThoseOfThePlace) {
  const IndexedRoom room({.landmark_every = 25}, kPerRound + 6);
  const auto loop = room.Propose({}, kPerRound + 3, 3);
  ASSERT_TRUE(loop);
  const Sim3d truth = room.TrueLoop(kPerRound + 3, 3).S_keyframe_place;
  EXPECT_LT(AngleBetween(loop->S_keyframe_place.rotation, truth.rotation), 0.01);
}

TEST(ProposeTest, WithTooFewLandmarksOfBothTwoMapsHaveNoScaleInCommon) {
  const WorldOptions world{.landmark_every = 60, .second_map_at = kPerRound};
  const IndexedRoom room(world, kPerRound + 3);
  EXPECT_FALSE(room.Propose(Trusting(), kPerRound + 2, 2));
}

TEST(ProposeTest, OfTwoMapsTheLandmarksTellTheScale) {
  const IndexedRoom room({.second_map_at = kPerRound - 2}, kPerRound + 6);
  const auto loop = room.Propose({}, kPerRound + 3, 3);
  ASSERT_TRUE(loop);
  EXPECT_TRUE(loop->joins);
  EXPECT_FALSE(loop->drift_sigmas) << "no chain of keyframes leads there";
  ExpectNear(loop->S_keyframe_place, room.TrueLoop(kPerRound + 3, 3).S_keyframe_place);
}

TEST(ProposeTest, APictureThatHangsInTwoPlacesIsToldByWhatIsNotAroundIt) {
  const int here = kPerRound / 2 + 1, there = 1;
  const IndexedRoom room({.points = 3 * kPoints, .picture_rad = 0.1}, here + 3);
  LoopcloserOptions options = Trusting();
  options.min_cells = 0;
  options.min_matches = options.min_sim3_inliers;
  EXPECT_FALSE(room.Propose(options, here, there));
  options.min_share = 0;
  EXPECT_TRUE(room.Propose(options, here, there)) << "the scene is no trap";
}

/// Somebody stands before two keyframes, far from each other, and hides most of the wall.
class SomebodyInTwoPlaces : public ::testing::Test {
 protected:
  static constexpr int kHere = 68, kThere = 20;
  std::optional<VerifiedLoop> Propose(const LoopcloserOptions& options) const {
    return room_.Propose(options, kHere, kThere);
  }
  IndexedRoom room_{{.person_at = {kThere, kHere}}, kHere + 12};
};

TEST_F(SomebodyInTwoPlaces, IsTakenForAPlaceByWhoTrustsAllThatIsSeen) { EXPECT_TRUE(Propose(Trusting())); }

TEST_F(SomebodyInTwoPlaces, IsNoneAsNothingOfHimOutlastsHim) {
  LoopcloserOptions options = Trusting();
  options.min_proven = LoopcloserOptions().min_proven;
  EXPECT_FALSE(Propose(options));
}

TEST_F(SomebodyInTwoPlaces, IsNoneAsTheChainOfKeyframesCannotHaveDriftedSo) {
  LoopcloserOptions options = Trusting();
  options.max_drift_sigmas = LoopcloserOptions().max_drift_sigmas;
  EXPECT_FALSE(Propose(options));
}

TEST_F(SomebodyInTwoPlaces, IsNoneAsTheOtherKeyframeDoesNotSeeWhatIsProvenAroundThisOne) {
  LoopcloserOptions options = Trusting();
  options.min_told = 5;
  EXPECT_FALSE(Propose(options));
}

// ---- Later keyframes ----

class Confirming : public ::testing::Test {
 protected:
  static constexpr int kFirst = kPerRound + 2, kThere = 2;
  std::optional<VerifiedLoop> Confirm(const LoopClaim& earlier, int k,
                                      const LoopcloserOptions& options = {}) const {
    std::string why;
    return LoopVerifier(options, 1).Confirm(room_.map(), room_.At(k), earlier, &why);
  }
  IndexedRoom room_{{}, kPerRound + 10};
};

TEST_F(Confirming, ALaterKeyframeSeesThePlaceWhereAnEarlierOneSaidItIs) {
  const auto later = Confirm(room_.TrueLoop(kFirst, kThere).Claim(), kFirst + 4);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->keyframe->id, Room::IdOf(kFirst + 4));
  const int place = static_cast<int>(later->place->id.frame_index()) - 1;
  EXPECT_LT(place, kThere + 16) << "not one of its own neighbours";
  ExpectNear(later->S_keyframe_place, room_.TrueLoop(kFirst + 4, place).S_keyframe_place, 0.06);
}

TEST_F(Confirming, ALaterKeyframePutsRightWhatTheEarlierOneHadALittleWrong) {
  LoopClaim earlier = room_.TrueLoop(kFirst, kThere).Claim();
  const Sim3d turned(ExpSo3({0, 0.015, 0}), Eigen::Vector3d::Zero(), 1);
  earlier.S_keyframe_place = turned * earlier.S_keyframe_place;
  const auto later = Confirm(earlier, kFirst + 4);
  ASSERT_TRUE(later);
  const int place = static_cast<int>(later->place->id.frame_index()) - 1;
  ExpectNear(later->S_keyframe_place, room_.TrueLoop(kFirst + 4, place).S_keyframe_place, 0.06);
}

TEST_F(Confirming, AKeyframeThatDoesNotSeeItThereDoesNot) {
  LoopClaim earlier = room_.TrueLoop(kFirst, kThere).Claim();
  const Sim3d turned(ExpSo3({0, 0.2, 0}), Eigen::Vector3d::Zero(), 1);
  earlier.S_keyframe_place = turned * earlier.S_keyframe_place;
  EXPECT_FALSE(Confirm(earlier, kFirst + 4));
}

TEST_F(Confirming, MoreIsAskedThanOfAProposal) {
  LoopcloserOptions options;
  options.min_confirmed_share = 1.5;
  EXPECT_FALSE(Confirm(room_.TrueLoop(kFirst, kThere).Claim(), kFirst + 4, options));
  EXPECT_TRUE(room_.Propose(options, kFirst + 4, kThere + 4));
}

TEST_F(Confirming, WhatKeyframesThatAreGoneSaidIsNotConfirmed) {
  LoopClaim earlier = room_.TrueLoop(kFirst, kThere).Claim();
  earlier.keyframe = Room::IdOf(1000);
  EXPECT_FALSE(Confirm(earlier, kFirst + 4));
}

/// Local mapping may have found some of the place again by itself.
TEST(ConfirmTest, AFewLandmarksInCommonMakeThePlaceNoNeighbour) {
  const IndexedRoom room({.fused_every = 12}, kPerRound + 10);
  const LoopVerifier verifier({}, 1);
  std::string why;
  const LoopClaim earlier = room.TrueLoop(kPerRound + 2, 2).Claim();
  EXPECT_TRUE(verifier.Confirm(room.map(), room.At(kPerRound + 6), earlier, &why)) << why;
}

// ---- Two maps ----

/// A place of another map, of which this is seen.
VerifiedLoop Joining(double share) {
  VerifiedLoop loop;
  loop.joins = true;
  loop.share = share;
  loop.support.found = 100;
  loop.support.cells = 20;
  return loop;
}

/// So much of what outlasts people.
PlaceSupport Proven(int found) {
  PlaceSupport proven;
  proven.expected = proven.found = found;
  proven.cells = 8;
  return proven;
}

const LoopVerifier& Verifier() {
  static const LoopVerifier verifier({}, 1);
  return verifier;
}

TEST(HoldsBetweenMapsTest, MostOfWhatShouldBeSeenMustBe) {
  VerifiedLoop loop = Joining(0.69);
  loop.proven = Proven(20);
  loop.proven_share = 0.8;
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop));
  loop.share = 0.7;
  EXPECT_TRUE(Verifier().HoldsBetweenMaps(loop));
  loop.counter_share = 0.5;
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop)) << "the place does not see what is proven around it";
}

TEST(HoldsBetweenMapsTest, BehindPeopleMuchOfWhatIsProvenIsEnough) {
  VerifiedLoop loop = Joining(0.3);
  loop.proven_share = 0.7;
  loop.proven = Proven(49);
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop));
  loop.proven = Proven(50);
  EXPECT_TRUE(Verifier().HoldsBetweenMaps(loop));
  loop.proven.cells = 7;
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop)) << "all of it in one corner";
}

TEST(HoldsBetweenMapsTest, EitherSideMayProveThatItIsNobody) {
  VerifiedLoop loop = Joining(0.9);
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop)) << "somebody fills the picture as well";
  loop.counter = Proven(20);
  loop.counter_share = 0.8;
  EXPECT_TRUE(Verifier().HoldsBetweenMaps(loop));
  loop.joins = false;
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop)) << "within a map the place must";
}

TEST(HoldsBetweenMapsTest, AtTheSameTimeNobodyNeedsToBeProvenToStand) {
  VerifiedLoop loop = Joining(0.9);
  loop.at_same_time = true;
  EXPECT_TRUE(Verifier().HoldsBetweenMaps(loop));
}

TEST(HoldsAmongOthersTest, TwoYoungMapsAreJoinedByAPlaceThatFillsTheImage) {
  VerifiedLoop loop = Joining(0.35);
  loop.support.anywhere = {.told = 40, .agreeing = 24};
  loop.support.at_rim = {.told = 20, .agreeing = 10};
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop));
  EXPECT_TRUE(Verifier().HoldsAmongOthers(loop));
  VerifiedLoop figure = loop;
  figure.support.at_rim.agreeing = 9;
  EXPECT_FALSE(Verifier().HoldsAmongOthers(figure));
  VerifiedLoop part = loop;
  part.support.anywhere = {.told = 48, .agreeing = 23};
  EXPECT_FALSE(Verifier().HoldsAmongOthers(part));
  VerifiedLoop contradicted = loop;
  contradicted.proven.expected = 10;
  contradicted.proven_share = 0.2;
  EXPECT_FALSE(Verifier().HoldsAmongOthers(contradicted)) << "what outlasts people is not there";
}

TEST(HoldsAmongOthersTest, HalfOfWhatIsProvenAroundThePlaceIsEnough) {
  VerifiedLoop loop = Joining(0.35);
  loop.proven = Proven(20);
  loop.proven_share = 0.5;
  EXPECT_FALSE(Verifier().HoldsBetweenMaps(loop));
  EXPECT_TRUE(Verifier().HoldsAmongOthers(loop));
  VerifiedLoop picture = loop;
  picture.proven_share = 0.4;
  EXPECT_FALSE(Verifier().HoldsAmongOthers(picture)) << "what hangs in two places";
  VerifiedLoop corner = loop;
  corner.proven.cells = 5;
  EXPECT_FALSE(Verifier().HoldsAmongOthers(corner));
  VerifiedLoop hidden = loop;
  hidden.share = 0.3;
  EXPECT_FALSE(Verifier().HoldsAmongOthers(hidden)) << "too little of all that should be seen";
  VerifiedLoop from_there = loop;
  std::swap(from_there.proven, from_there.counter);
  from_there.counter_share = 0.5;
  from_there.proven_share = 0.0;
  EXPECT_FALSE(Verifier().HoldsAmongOthers(from_there)) << "half of what the other side has proven is seen "
                                                           "around somebody who stood in both maps, too";
}

}  // namespace
}  // namespace dmslam
