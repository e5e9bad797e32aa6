#include "dmslam/slam/map_merge.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dmslam/geometry/similarity.h"
#include "dmslam/loops/testing/ring_room.h"
#include "dmslam/map/snapshot.h"

namespace dmslam {
namespace {

using testing::kKeyframes;
using testing::kPerRound;
using testing::Room;
using testing::TruePose;
using testing::WorldOptions;

/// Two maps of one run, as if each were of a run of its own.
struct TwoMaps {
  Replica a, b;
};

TwoMaps MapsOfWorld(const WorldOptions& world) {
  Room room(world);
  for (int k = 0; k < kKeyframes; ++k) room.Next();
  return {OnlyMap(room.map(), 1), OnlyMap(room.map(), 2)};
}

/// b's only session is called so in the joined map.
constexpr uint32_t kSessionOfB = 2;

MapMerge MergeOf(const TwoMaps& maps, const LoopcloserOptions& loop = {}) {
  MapMergeOptions options;
  options.loop = loop;
  return MapMerge(maps.a, maps.b, NamesBeside(maps.a, maps.b, true), options);
}

/// Largest distance of a camera from where it truly was, when all are laid on the truth.
double LargestError(const Map& map) {
  std::vector<Eigen::Vector3d> found, truth;
  for (const auto& [id, keyframe] : map.keyframes()) {
    found.push_back(keyframe.T_cam_world.Center());
    truth.push_back(TruePose(static_cast<int>(id.frame_index()) - 1).Center());
  }
  const Sim3d S = AlignSim3(found, truth).value();
  double largest = 0;
  for (size_t i = 0; i < found.size(); ++i) largest = std::max(largest, (S * found[i] - truth[i]).norm());
  return largest;
}

TEST(MapMergeTest, TwoMapsOfOneRoomBecomeOne) {
  const TwoMaps maps = MapsOfWorld({.second_map_at = kPerRound - 10});
  MapMerge merge = MergeOf(maps);
  const MapMergeReport report = merge.Run(testing::ShippedVocabulary());
  ASSERT_TRUE(report.joined);
  ASSERT_EQ(report.welds.size(), 1u);
  EXPECT_TRUE(report.welds[0].keyframe.of_b) << "those of the second are asked first";
  EXPECT_FALSE(report.welds[0].place.of_b);
  EXPECT_EQ(MapsOf(merge.map()).size(), 1u);
  EXPECT_EQ(merge.map().keyframes().size(), static_cast<size_t>(kKeyframes));
  EXPECT_LT(LargestError(merge.map()), 0.05) << "of a path with a radius of 2";
  // What both see is one: keyframes of the two rounds share landmarks.
  const Keyframe& late = merge.map().At(KeyframeId::Make(kSessionOfB, kPerRound + 6));
  const auto early = late.covisible.find(KeyframeId::Make(1, 6));
  ASSERT_NE(early, late.covisible.end());
  EXPECT_GT(early->second, 50);
}

TEST(MapMergeTest, TheJoinedMapLiesWhereTheFirstLay) {
  const TwoMaps maps = MapsOfWorld({.second_map_at = kPerRound - 10});
  const TwoMaps other_way{maps.b, maps.a};
  for (const TwoMaps* each : {&maps, &other_way}) {
    MapMerge merge = MergeOf(*each);
    ASSERT_TRUE(merge.Run(testing::ShippedVocabulary()).joined);
    const Keyframe& before = each->a.keyframes().begin()->second;
    const Keyframe& after = merge.map().At(before.id);
    EXPECT_LT((after.T_cam_world.Center() - before.T_cam_world.Center()).norm(), 1e-6);
    EXPECT_LT(AngleBetween(after.T_cam_world.rotation, before.T_cam_world.rotation), 1e-6);
    EXPECT_NEAR(merge.map().MedianDepth(after).value() / each->a.MedianDepth(before).value(), 1.0, 0.03);
  }
}

TEST(MapMergeTest, TwoRoomsStayApart) {
  const TwoMaps maps =
      MapsOfWorld({.second_visit_elsewhere = true, .picture_rad = 0.25, .second_map_at = kPerRound});
  MapMerge merge = MergeOf(maps);
  const MapMergeReport report = merge.Run(testing::ShippedVocabulary());
  EXPECT_FALSE(report.joined);
  EXPECT_TRUE(report.welds.empty());
  EXPECT_EQ(report.keyframes_asked, static_cast<size_t>(kKeyframes));
  EXPECT_EQ(MapsOf(merge.map()).size(), 2u);
}

/// Stamps that lie near one another say nothing here: the clocks may be different ones.
TEST(MapMergeTest, SomebodyWhoStoodInBothIsNoProofThoughTheClocksAgree) {
  const WorldOptions world{.second_visit_elsewhere = true, .person_at = {20, 100}, .second_map_at = 97};
  TwoMaps maps = MapsOfWorld(world);
  MapDelta shifted = CutSnapshot(maps.b, std::nullopt, SIZE_MAX / 2).front();
  for (KeyframeState& keyframe : shifted.keyframes) keyframe.stamp_ns -= 80 * testing::kInterval_ns;
  maps.b.Clear();
  maps.b.Apply(shifted);
  MapMerge merge = MergeOf(maps);
  EXPECT_FALSE(merge.Run(testing::ShippedVocabulary()).joined);
}

TEST(MapMergeTest, TheSameMapsGiveTheSameMap) {
  const TwoMaps maps = MapsOfWorld({.second_map_at = kPerRound - 10});
  MapMerge first = MergeOf(maps), second = MergeOf(maps);
  first.Run(testing::ShippedVocabulary());
  second.Run(testing::ShippedVocabulary());
  for (const auto& [id, keyframe] : first.map().keyframes())
    ASSERT_EQ(keyframe.T_cam_world.translation, second.map().At(id).T_cam_world.translation);
}

}  // namespace
}  // namespace dmslam
