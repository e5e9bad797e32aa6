#include "dmslam/loops/sightings.h"

#include <gtest/gtest.h>

#include "dmslam/loops/testing/indexed_room.h"

namespace dmslam {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the room and all it is made of

/// A second map begins where the first one did, after a round. Keyframes of the second see places of the
/// first.
class SightingsTest : public ::testing::Test {
 protected:
  static constexpr int kFirstOfSecond = kPerRound;

  /// Keyframe `k` of the second map, at the place where the first map began its `k`th.
  VerifiedLoop Seen(int k) const { return room_.TrueLoop(kFirstOfSecond + k, k); }
  /// The same, but for `error` of the camera.
  VerifiedLoop SeenWrongly(int k, const Sim3d& error) const {
    VerifiedLoop loop = Seen(k);
    loop.S_keyframe_place = error * loop.S_keyframe_place;
    return loop;
  }
  void Add(const VerifiedLoop& loop) { sightings_.Add(loop.Claim()); }
  bool AreBorneOut(const VerifiedLoop& loop, const JoiningOptions& options = {}) const {
    return sightings_.BearOut(room_.map(), loop, options);
  }

  IndexedRoom room_{{.points = 400, .second_map_at = kFirstOfSecond}, kFirstOfSecond + 8};
  Sightings sightings_;
};

TEST_F(SightingsTest, TwoOthersThatSayTheSameBearALoopOut) {
  Add(Seen(0));
  EXPECT_FALSE(AreBorneOut(Seen(6))) << "one may see a picture that hangs in both";
  Add(Seen(3));
  EXPECT_TRUE(AreBorneOut(Seen(6)));
}

TEST_F(SightingsTest, AKeyframeCountsOnceAndNotForItself) {
  for (int times = 0; times < 3; ++times) {
    Add(Seen(3));
    Add(Seen(6));
  }
  EXPECT_FALSE(AreBorneOut(Seen(6)));
}

TEST_F(SightingsTest, OfAKeyframeTheNewestCounts) {
  Add(Seen(0));
  Add(SeenWrongly(3, Sim3d(ExpSo3({0, 0.5, 0}), Eigen::Vector3d::Zero(), 1)));
  ASSERT_FALSE(AreBorneOut(Seen(6)));
  Add(Seen(3));
  EXPECT_TRUE(AreBorneOut(Seen(6)));
}

TEST_F(SightingsTest, OneThatLaysTheMapsOntoOneAnotherOtherwiseDoesNotCount) {
  const Eigen::Quaterniond straight = Eigen::Quaterniond::Identity();
  const Sim3d turned(ExpSo3({0, 0.1, 0}), Eigen::Vector3d::Zero(), 1);
  const Sim3d moved(straight, Eigen::Vector3d(0.8, 0, 0), 1);
  const Sim3d grown(straight, Eigen::Vector3d::Zero(), 1.2);
  for (const Sim3d& error : {turned, moved, grown}) {
    sightings_.Clear();
    Add(Seen(5));
    Add(SeenWrongly(7, error));
    EXPECT_FALSE(AreBorneOut(Seen(6))) << error.translation.transpose() << ", scale " << error.scale;
  }
}

TEST_F(SightingsTest, WhatIsSeenForAMomentOnlyMayBeSomebody) {
  JoiningOptions options;
  options.sightings_s = 2.5;
  Add(Seen(4));
  Add(Seen(5));
  EXPECT_FALSE(AreBorneOut(Seen(6), options));
  Add(Seen(0));
  EXPECT_TRUE(AreBorneOut(Seen(6), options));
}

TEST_F(SightingsTest, AKeyframeOfTheFirstMapThatSeesTheSecondSaysTheSame) {
  for (const int k : {0, 3}) Add(room_.TrueLoop(k, kFirstOfSecond + k));
  EXPECT_TRUE(AreBorneOut(Seen(6)));
}

TEST_F(SightingsTest, WhatKeyframesThatAreGoneSawDoesNotCount) {
  LoopClaim by_one_that_is_gone = Seen(0).Claim(), of_one_that_is_gone = Seen(1).Claim();
  by_one_that_is_gone.keyframe = of_one_that_is_gone.place = Room::IdOf(1000);
  sightings_.Add(by_one_that_is_gone);
  sightings_.Add(of_one_that_is_gone);
  Add(Seen(3));
  EXPECT_FALSE(AreBorneOut(Seen(6)));
  sightings_.Add(Seen(0).Claim());
  EXPECT_TRUE(AreBorneOut(Seen(6)));
}

TEST_F(SightingsTest, WithinOneMapNothingIsJoined) {
  for (const int k : {0, 3}) Add(room_.TrueLoop(k + 1, k));
  EXPECT_FALSE(AreBorneOut(room_.TrueLoop(7, 6)));
}

}  // namespace
}  // namespace dmslam
