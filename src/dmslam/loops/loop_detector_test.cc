#include "dmslam/loops/loop_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "dmslam/loops/testing/indexed_room.h"

namespace dmslam {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the room and all it is made of

constexpr int kNear = 12;  // keyframes from one that shows a place to the last that shows some of it

LoopDetector MakeDetector(int consistency, double same_time_s = 0.5) {
  LoopcloserOptions options;
  options.consistency = consistency;
  options.same_time_s = same_time_s;
  return LoopDetector(options);
}

/// Whether one of the keyframes shows what number `k` does.
bool Contain(const std::vector<const Keyframe*>& found, int k) {
  return std::ranges::any_of(found, [&](const Keyframe* keyframe) {
    return std::abs(static_cast<int>(keyframe->id.frame_index()) - 1 - k) <= kNear;
  });
}

class WithinAMap : public ::testing::Test {
 protected:
  LoopDetector::Found Detect(LoopDetector& detector, const Keyframe& keyframe) const {
    return detector.Detect(room_.map(), room_.places(), keyframe);
  }
  LoopDetector::Found Detect(LoopDetector& detector, int k) const { return Detect(detector, room_.At(k)); }

  IndexedRoom room_{{}, kPerRound + 48};
};

TEST_F(WithinAMap, APlaceIsNamedByTheThirdKeyframeInARow) {
  LoopDetector detector = MakeDetector(3);
  EXPECT_TRUE(Detect(detector, kPerRound + 2).candidates.empty());
  EXPECT_TRUE(Detect(detector, kPerRound + 3).candidates.empty());
  const LoopDetector::Found third = Detect(detector, kPerRound + 4);
  EXPECT_TRUE(Contain(third.candidates, 4));
  EXPECT_GE(third.named, static_cast<int>(third.candidates.size()));
}

TEST_F(WithinAMap, PlacesThatDoNotBelongTogetherAreNoneInARow) {
  LoopDetector detector = MakeDetector(3);
  for (int times = 0; times < 3; ++times) {
    for (const int k : {2, 45}) {
      const LoopDetector::Found found = Detect(detector, kPerRound + k);
      EXPECT_GE(found.named, 1);
      EXPECT_TRUE(found.candidates.empty());
    }
  }
}

TEST_F(WithinAMap, AfterALoopThePlaceMustBeNamedAnew) {
  LoopDetector detector = MakeDetector(3);
  for (const int k : {2, 3}) Detect(detector, kPerRound + k);
  detector.Reset();
  EXPECT_TRUE(Detect(detector, kPerRound + 4).candidates.empty());
}

TEST_F(WithinAMap, WhatAKeyframeSharesLandmarksWithIsNoReturn) {
  LoopDetector detector = MakeDetector(1);
  for (const int k : {20, 50, kPerRound + 2}) {
    const Keyframe& keyframe = room_.At(k);
    for (const Keyframe* place : Detect(detector, keyframe).candidates) {
      EXPECT_NE(place->id, keyframe.id);
      const auto shared = keyframe.covisible.find(place->id);
      EXPECT_TRUE(shared == keyframe.covisible.end() || shared->second < kMinCovisibility) << k;
    }
  }
}

/// Neighbours are here those that see nearly the same: others see a part of it, and look less alike.
TEST_F(WithinAMap, APlaceLooksAtLeastAsMuchAlikeAsTheNeighbours) {
  LoopcloserOptions options;
  options.consistency = 1;
  options.min_covisibility = 60;
  LoopDetector detector(options);
  for (const int k : {30, 50, 70}) {
    const Keyframe& keyframe = room_.At(k);
    const auto alike = [&](KeyframeId id) {
      return L1Score(*room_.places().Words(keyframe.id), *room_.places().Words(id));
    };
    double least = 1.0;
    for (const auto& [id, shared] : keyframe.covisible) {
      if (shared >= options.min_covisibility) least = std::min(least, alike(id));
    }
    ASSERT_LT(least, 1.0);
    for (const Keyframe* place : Detect(detector, keyframe).candidates)
      EXPECT_GE(alike(place->id), least) << k;
  }
}

TEST_F(WithinAMap, EachCameraNamesItsPlacesInItsOwnRow) {
  LoopDetector detector = MakeDetector(3);
  Detect(detector, kPerRound + 2);
  Keyframe of_another = room_.At(kPerRound + 3);
  of_another.camera_id = 1;
  Detect(detector, of_another);
  EXPECT_TRUE(Detect(detector, kPerRound + 4).candidates.empty());
  EXPECT_FALSE(Detect(detector, kPerRound + 5).candidates.empty());
}

class BetweenMaps : public ::testing::Test {
 protected:
  std::vector<const Keyframe*> Detect(const IndexedRoom& room, int k, double same_time_s = 0.5) const {
    return MakeDetector(3, same_time_s).DetectInOtherMaps(room.map(), room.places(), room.At(k));
  }
};

TEST_F(BetweenMaps, WhatLooksAlikeIsNamedAtOnceAndOfOtherMapsOnly) {
  const IndexedRoom room({.second_map_at = kPerRound - 2}, kPerRound + 6);
  const std::vector<const Keyframe*> found = Detect(room, kPerRound + 3);
  EXPECT_TRUE(Contain(found, 3));
  EXPECT_LE(found.size(), 3U);
  for (const Keyframe* place : found) EXPECT_EQ(place->map_id, 1U);
}

TEST_F(BetweenMaps, WhatWasTakenAtTheSameTimeIsNamedHoweverItLooks) {
  const IndexedRoom room({.second_visit_elsewhere = true, .second_map_at = kPerRound}, kPerRound + 4);
  const KeyframeId last_of_first = Room::IdOf(kPerRound - 1);
  const std::vector<const Keyframe*> meanwhile = Detect(room, kPerRound, 1e-9 * kInterval_ns);
  ASSERT_FALSE(meanwhile.empty());
  EXPECT_EQ(meanwhile.front()->id, last_of_first);
  EXPECT_EQ(std::ranges::count(Detect(room, kPerRound, 0.9e-9 * kInterval_ns), last_of_first, &Keyframe::id),
            0);
}

}  // namespace
}  // namespace dmslam
