#include "dmslam/map/map_difference.h"

#include <gtest/gtest.h>

#include "dmslam/map/renumbering.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

MapEditor SceneMap() {
  MapScene scene;
  scene.AddCloud(60, {0, 0, 4}, {1, 1, 0.5});
  scene.MapAll(6);
  return scene.map();
}

TEST(MapDifferenceTest, AMapDiffersNotFromItself) {
  const MapEditor map = SceneMap();
  const MapDifference difference = Compare(map, map);
  EXPECT_TRUE(difference.Equal());
  EXPECT_EQ(difference.keyframes.both, 6u);
  EXPECT_EQ(difference.landmarks.both, 60u);
  ASSERT_EQ(difference.common.size(), 1u);
  EXPECT_FALSE(difference.common[0].S_b_a);
}

TEST(MapDifferenceTest, WhatOneHasAloneIsListed) {
  const MapEditor a = SceneMap();
  MapEditor b = SceneMap();
  b.RemoveLandmark(b.At(MapScene::IdOf(7)));
  b.RemoveKeyframe(b.At(KeyframeId::Make(MapScene::kSession, 5)));
  const MapDifference there = Compare(a, b), back = Compare(b, a);
  EXPECT_FALSE(there.Equal());
  EXPECT_EQ(there.landmarks.only_a, std::vector{MapScene::IdOf(7)});
  EXPECT_TRUE(there.landmarks.only_b.empty());
  EXPECT_EQ(there.keyframes.only_a, std::vector{KeyframeId::Make(MapScene::kSession, 5)});
  EXPECT_EQ(back.keyframes.only_b, there.keyframes.only_a);
  EXPECT_EQ(there.changed_landmarks, 59u) << "each has an observer less";
  EXPECT_EQ(there.common[0].points.moved, 0u);
}

TEST(MapDifferenceTest, WhatMovedIsToldInDepthsOfTheScene) {
  const MapEditor a = SceneMap();
  MapEditor b = SceneMap();
  const Landmark& landmark = b.At(MapScene::IdOf(3));
  b.SetPosition(landmark, landmark.p_world + Eigen::Vector3d(0.4, 0, 0));
  const MapDifference difference = Compare(a, b);
  EXPECT_FALSE(difference.Equal());
  ASSERT_EQ(difference.common.size(), 1u);
  EXPECT_EQ(difference.common[0].points.moved, 1u);
  EXPECT_EQ(difference.common[0].points.median_depths, 0.0);
  EXPECT_NEAR(difference.common[0].points.max_depths, 0.1, 0.02);
  EXPECT_EQ(difference.common[0].cameras.moved, 0u);
}

TEST(MapDifferenceTest, AMapThatLiesElsewhereAsAWholeIsTheSameBeyondThat) {
  MapEditor a = SceneMap();
  // Not all cameras on a line: only then do they say how the map lies.
  const Keyframe& off = a.At(KeyframeId::Make(MapScene::kSession, 2));
  a.SetPose(off, Rigid3d(off.T_cam_world.rotation, off.T_cam_world.translation + Eigen::Vector3d(0, 0.3, 0)));
  MapEditor b = a;
  const Sim3d moved(ExpSo3(Eigen::Vector3d(0.3, -0.1, 0.7)), Eigen::Vector3d(5, 2, 1), 2.5);
  for (const Keyframe* keyframe : b.KeyframesOf(MapScene::kMap))
    b.SetPoseAndScale(*keyframe, (Sim3d(keyframe->T_cam_world) * moved.Inverse()).ToRigid(), moved.scale);
  for (const Landmark* landmark : b.LandmarksOf(MapScene::kMap))
    b.SetPosition(*landmark, moved * landmark->p_world);
  const MapDifference difference = Compare(a, b);
  ASSERT_TRUE(difference.common[0].S_b_a);
  EXPECT_NEAR(difference.common[0].S_b_a->scale, 2.5, 1e-9);
  EXPECT_EQ(difference.common[0].points.moved, 60u);
  EXPECT_LT(difference.common[0].points.max_depths, 1e-9);
  EXPECT_LT(difference.common[0].cameras.max_depths, 1e-9);
  EXPECT_FALSE(difference.Equal());
}

TEST(MapDifferenceTest, OtherRunsOfOneNumberAreToldApart) {
  MapScene early, late;
  for (MapScene* scene : {&early, &late}) scene->AddCloud(60, {0, 0, 4}, {1, 1, 0.5});
  early.MapAll(3);
  late.MapAll(3, 0.05, 0, 5'000'000'000);
  const MapDifference difference = Compare(early.map(), late.map());
  EXPECT_EQ(difference.other_times.size(), 3u);
  EXPECT_TRUE(difference.NothingInCommon()) << "whatever their numbers";
  EXPECT_EQ(difference.keyframes.only_a.size(), 3u);
  EXPECT_EQ(difference.landmarks.only_b.size(), 60u);
}

/// The same map, as if it were of another session.
Replica AsSession(const Map& map, uint32_t session) {
  Renumbering names;
  names.sessions[MapScene::kSession] = session;
  return Beside(Replica(map.camera(), map.pyramid()), map, names);
}

void ExpectNothingInCommon(const MapDifference& difference) {
  EXPECT_TRUE(difference.NothingInCommon());
  EXPECT_FALSE(difference.Equal());
  EXPECT_EQ(difference.maps.only_a, std::vector{MapScene::kMap});
  EXPECT_EQ(difference.maps.only_b, std::vector{MapScene::kMap});
  EXPECT_EQ(difference.maps.both, 0u);
  EXPECT_EQ(difference.keyframes.only_a.size(), 6u);
  EXPECT_EQ(difference.keyframes.only_b.size(), 6u);
  EXPECT_EQ(difference.landmarks.only_a.size(), 60u);
  EXPECT_EQ(difference.landmarks.only_b.size(), 60u);
  EXPECT_EQ(difference.changed_landmarks, 0u);
  EXPECT_TRUE(difference.common.empty());
}

TEST(MapDifferenceTest, NumbersThatCoincideAreNothingInCommon) {
  const MapEditor map = SceneMap();
  ExpectNothingInCommon(Compare(map, AsSession(map, 2)));
  ExpectNothingInCommon(Compare(map, map, {MapScene::kSession}));
}

TEST(MapDifferenceTest, ASessionIsAnotherRunWhereItHasNoKeyframeOfTheOther) {
  MapScene first, second;
  for (MapScene* scene : {&first, &second}) scene->AddCloud(60, {0, 0, 4}, {1, 1, 0.5});
  first.MapAll(6);
  second.MapAll(6, 0.05, 50, 50 * MapScene::kStepNs);  // a later part of one sequence
  const MapDifference difference = Compare(first.map(), second.map());
  ExpectNothingInCommon(difference);
  EXPECT_EQ(difference.other_runs.at(MapScene::kSession), OtherRun::kNoKeyframe);
}

TEST(MapDifferenceTest, ASessionIsAnotherRunWhereItsLandmarksAreOthers) {
  const auto mapped = [](uint32_t second_of_landmarks, uint32_t by_keyframe) {
    MapScene scene;
    scene.AddCloud(60, {0, 0, 4}, {1, 1, 0.5}, second_of_landmarks * 1'000'000'000LL);
    scene.MapAll(6);
    for (uint32_t frame = 0; frame < 6; ++frame) {
      const Keyframe& keyframe = scene.map().At(KeyframeId::Make(MapScene::kSession, frame));
      for (uint16_t i = 0; frame != by_keyframe && i < 60; ++i) scene.map().ClearObservation(keyframe, i);
    }
    return scene.map();
  };
  const MapDifference difference = Compare(mapped(1, 2), mapped(2, 3));
  ExpectNothingInCommon(difference);
  EXPECT_EQ(difference.other_runs.at(MapScene::kSession), OtherRun::kOtherLandmarks);
  EXPECT_EQ(Compare(mapped(1, 2), mapped(1, 3)).landmarks.both, 60u) << "made at one time";
  EXPECT_EQ(Compare(mapped(1, 2), mapped(2, 2)).landmarks.both, 60u) << "seen by one keyframe";
}

TEST(MapDifferenceTest, ACulledKeyframeShowsThatTheRunIsTheSame) {
  MapEditor early = SceneMap(), late = SceneMap();
  for (uint32_t frame = 1; frame < 6; ++frame)
    late.RemoveKeyframe(late.At(KeyframeId::Make(MapScene::kSession, frame)));
  EXPECT_TRUE(Compare(early, late).other_runs.empty());
  EXPECT_TRUE(Compare(late, early).other_runs.empty());
}

TEST(MapDifferenceTest, LandmarksAreFoundAgainWhereTheirMapWasJoinedWithAnother) {
  const MapEditor a = SceneMap();
  const Replica b = AsSession(a, 2);
  const Replica joined = Beside(a, b, NamesBeside(a, b, false));
  const MapDifference of_a = Compare(a, joined), of_b = Compare(b, joined);
  EXPECT_EQ(of_a.landmarks.both, 60u);
  EXPECT_EQ(of_a.renumbered_landmarks, 0u);
  EXPECT_EQ(of_a.changed_landmarks, 0u);
  EXPECT_TRUE(of_b.landmarks.only_a.empty());
  EXPECT_EQ(of_b.landmarks.both, 60u);
  EXPECT_EQ(of_b.landmarks.only_b.front(), MapScene::IdOf(0)) << "one of a, in spite of its number";
  EXPECT_EQ(of_b.renumbered_landmarks, 60u);
  EXPECT_EQ(of_b.maps.both, 1u);
  EXPECT_EQ(of_b.maps.only_b, std::vector{MapScene::kMap});
  ASSERT_EQ(of_b.common.size(), 1u);
  EXPECT_EQ(of_b.common[0].b, 2u);
  EXPECT_EQ(of_b.common[0].landmarks, 60u);
  EXPECT_EQ(of_b.common[0].points.moved, 0u);
}

}  // namespace
}  // namespace dmslam
