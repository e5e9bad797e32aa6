#include "dmslam/map/renumbering.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dmslam/map/map_difference.h"
#include "dmslam/map/testing/random_editor.h"

namespace dmslam {
namespace {

Replica RandomMap(uint64_t seed) {
  RandomEditor editor(seed);
  editor.Steps(800);
  return Replica(editor.map());
}

TEST(RenumberingTest, TwoMapsOfTheSameNamesStandSideBySide) {
  const Replica a = RandomMap(1), b = RandomMap(2);
  const Renumbering names = NamesBeside(a, b, true);
  const Replica both = Beside(a, b, names);
  EXPECT_EQ(both.keyframes().size(), a.keyframes().size() + b.keyframes().size());
  EXPECT_EQ(both.num_landmarks(), a.num_landmarks() + b.num_landmarks());
  EXPECT_EQ(both.keyframe_tombstones().size(),
            a.keyframe_tombstones().size() + b.keyframe_tombstones().size());
  EXPECT_EQ(both.landmark_tombstones().size(),
            a.landmark_tombstones().size() + b.landmark_tombstones().size());
  EXPECT_EQ(both.skipped_references(), 0u);
  EXPECT_EQ(MapsOf(both).size(), MapsOf(a).size() + MapsOf(b).size());
  // Every keyframe of b sees what it saw, under its new name.
  for (const auto& [id, keyframe] : b.keyframes()) {
    const uint32_t session = names.sessions.at(id.session());
    const Keyframe& renamed = both.At(KeyframeId::Make(session, id.frame_index()));
    EXPECT_EQ(renamed.stamp_ns, keyframe.stamp_ns);
    EXPECT_EQ(renamed.T_cam_world.translation, keyframe.T_cam_world.translation);
    EXPECT_EQ(renamed.map_id, names.maps.at(keyframe.map_id));
    EXPECT_EQ(renamed.covisible.size(), keyframe.covisible.size());
    ASSERT_EQ(renamed.landmarks.size(), keyframe.landmarks.size());
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const LandmarkId seen = keyframe.landmarks[i], now = renamed.landmarks[i];
      ASSERT_EQ(seen.valid(), now.valid());
      if (!seen.valid()) continue;
      EXPECT_EQ(now.number(), seen.number());
      EXPECT_EQ(now.epoch_ordinal(), names.ordinals.at(seen.epoch_ordinal()));
    }
  }
}

TEST(RenumberingTest, WhatIsOfAStaysAsItIs) {
  const Replica a = RandomMap(1), b = RandomMap(2);
  const Replica both = Beside(a, b, NamesBeside(a, b, true));
  const MapDifference difference = Compare(a, both);
  EXPECT_TRUE(difference.maps.only_a.empty());
  EXPECT_TRUE(difference.keyframes.only_a.empty());
  EXPECT_TRUE(difference.landmarks.only_a.empty());
  EXPECT_EQ(difference.changed_keyframes, 0u);
  EXPECT_EQ(difference.changed_landmarks, 0u);
  EXPECT_EQ(difference.keyframes.only_b.size(), b.keyframes().size());
}

TEST(RenumberingTest, SessionsKeepTheirNumbersUnlessBothHaveThem) {
  const Replica a = RandomMap(1), b = RandomMap(2);
  EXPECT_TRUE(NamesBeside(a, b, false).sessions.empty());
  Renumbering apart;
  for (const uint32_t session : SessionsOf(b)) apart.sessions[session] = session + 50;
  const Replica moved = Beside(Replica(b.camera(), b.pyramid()), b, apart);
  EXPECT_TRUE(NamesBeside(a, moved, true).sessions.empty());
}

TEST(RenumberingTest, SessionsOfOtherNumbersKeepTheirOrder) {
  const Replica a = RandomMap(1), b = RandomMap(2);
  const Replica of_two = Beside(b, RandomMap(3), NamesBeside(b, RandomMap(3), true));
  ASSERT_EQ(SessionsOf(of_two).size(), 2u) << "of which a has the first";
  const Renumbering names = NamesBeside(a, of_two, true);
  uint32_t last = 0;
  for (const uint32_t session : SessionsOf(of_two)) {
    const auto renamed = names.sessions.find(session);
    const uint32_t named = renamed == names.sessions.end() ? session : renamed->second;
    EXPECT_GT(named, last) << "later ones of b were later";
    EXPECT_FALSE(SessionsOf(a).contains(named));
    last = named;
  }
}

TEST(RenumberingTest, OneOfTheMapsIsTakenOut) {
  const Replica a = RandomMap(1), b = RandomMap(2);
  const Renumbering names = NamesBeside(a, b, true);
  const Replica both = Beside(a, b, names);
  size_t keyframes = 0, landmarks = 0;
  for (const MapId map_id : MapsOf(both)) {
    const Replica only = OnlyMap(both, map_id);
    EXPECT_EQ(only.skipped_references(), 0u);
    EXPECT_EQ(MapsOf(only), std::set<MapId>{map_id});
    EXPECT_EQ(only.keyframes().size(), both.KeyframesOf(map_id).size());
    keyframes += only.keyframes().size();
    landmarks += only.num_landmarks();
  }
  EXPECT_EQ(keyframes, both.keyframes().size());
  EXPECT_EQ(landmarks, both.num_landmarks());
}

}  // namespace
}  // namespace dmslam
