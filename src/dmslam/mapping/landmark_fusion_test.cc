#include "dmslam/mapping/landmark_fusion.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

class Fusion : public testing::Test {
 protected:
  LandmarkId Add(uint64_t number, uint16_t at, const std::vector<uint32_t>& frames) {
    return scene_.AddLandmark(map_, number, at, frames);
  }
  LandmarkId Seen(uint32_t frame, uint16_t feature) const { return map_.At(Id(frame)).landmarks[feature]; }
  FusionCounts Fuse(uint32_t frame) { return FuseWithNeighbours(map_, map_.At(Id(frame)), options_); }

  WallScene scene_;
  MapEditor map_{TestCamera(), Pyramid()};
  MapperOptions options_;
};

/// Keyframes 1 and 2 share twenty landmarks.
class TwoKeyframes : public Fusion {
 protected:
  TwoKeyframes() {
    scene_.AddKeyframe(map_, 1, 0.0);
    scene_.AddKeyframe(map_, 2, 0.3);
    scene_.AddKeyframe(map_, 3, 5.0);  // looks elsewhere
    for (uint16_t i = 0; i < 20; ++i) Add(100U + i, i, {1, 2});
  }
};

TEST_F(TwoKeyframes, AFeatureWithoutALandmarkBecomesAnObservation) {
  const LandmarkId mine = Add(1, 50, {2}), theirs = Add(2, 51, {1});
  EXPECT_EQ(Fuse(2), (FusionCounts{.landmarks = 0, .observations = 2}));
  EXPECT_EQ(Seen(1, 50), mine);
  EXPECT_EQ(Seen(2, 51), theirs);
  EXPECT_FALSE(Seen(3, 50).valid()) << "it lies outside that image";
}

TEST_F(TwoKeyframes, TwoAtOneFeatureBecomeTheOneWithMoreObservers) {
  const LandmarkId lonely = Add(1, 50, {1});
  const LandmarkId other = Add(2, 50, {2, 3});
  EXPECT_EQ(Fuse(1), (FusionCounts{.landmarks = 1, .observations = 0}));
  EXPECT_EQ(map_.FindLandmark(lonely), nullptr);
  EXPECT_EQ(map_.Resolve(lonely), &map_.At(other));
  EXPECT_EQ(Seen(1, 50), other);
}

TEST_F(TwoKeyframes, WhatWasSaidOfEitherIsSaidOfTheOne) {
  const LandmarkId goes = Add(1, 50, {1}), stays = Add(2, 50, {2, 3});
  map_.SetEvidence(map_.At(goes), {10, 8, 1, 0, {}});
  map_.SetEvidence(map_.At(stays), {5, 4, 0, -1.0F, {}});
  Fuse(1);
  ASSERT_EQ(map_.Resolve(goes), &map_.At(stays));
  EXPECT_EQ(map_.At(stays).evidence, (LandmarkEvidence{15, 12, 1, -1.0F, {}}));
}

TEST_F(TwoKeyframes, OfEqualsTheOlderStays) {
  const LandmarkId young = Add(9, 50, {1}), old = Add(2, 50, {2});
  Fuse(1);
  EXPECT_EQ(map_.Resolve(young), &map_.At(old));
}

TEST_F(TwoKeyframes, WhatLooksOtherwiseIsNotTheSame) {
  const LandmarkId id = Add(1, 50, {1});
  FeatureSet features = map_.At(Id(2)).features->set;
  for (uint64_t& word : features.descriptors[50].words) word = ~word;
  map_.RemoveKeyframe(map_.At(Id(2)));
  Keyframe changed;
  changed.id = Id(4);
  changed.map_id = 1;
  changed.parent = Id(1);
  changed.T_cam_world = WallScene::At(0.3);
  changed.features = MakeFrameFeatures(features, map_.camera(), map_.pyramid());
  map_.AddKeyframe(changed);
  for (uint16_t i = 0; i < 20; ++i)
    map_.SetObservation(map_.At(Id(4)), i, map_.At(LandmarkId::Make(1, 100U + i)));
  EXPECT_EQ(Fuse(1), FusionCounts());
  EXPECT_EQ(map_.At(id).observations.size(), 1u);
}

TEST_F(TwoKeyframes, WhatIsBelievedToMoveSpeaksForNoPlace) {
  const LandmarkId id = Add(1, 50, {1});
  map_.SetEvidence(map_.At(id), {10, 2, 6, 1.0F, 0});
  EXPECT_EQ(Fuse(1), FusionCounts());
  options_.belief.enabled = false;
  EXPECT_EQ(Fuse(1).observations, 1);
}

TEST_F(TwoKeyframes, NeighboursOfNeighboursAreLookedAtToo) {
  scene_.AddKeyframe(map_, 4, 0.6);
  for (uint16_t i = 60; i < 80; ++i) Add(200U + i, i, {2, 4});
  const LandmarkId id = Add(1, 50, {1});
  options_.nearby_keyframes = 0;
  Fuse(1);
  EXPECT_EQ(Seen(4, 50), id);
}

TEST_F(Fusion, KeyframesNearbyAreJoinedWithoutAnythingInCommon) {
  scene_.AddKeyframe(map_, 1, 0.0);
  scene_.AddKeyframe(map_, 2, 0.1);
  for (uint16_t i = 0; i < 40; ++i) Add(100U + i, i, {1});
  options_.nearby_keyframes = 0;
  EXPECT_EQ(Fuse(1), FusionCounts());
  options_.nearby_keyframes = 1;
  EXPECT_EQ(Fuse(1).observations, 40);
  EXPECT_EQ(map_.At(Id(1)).covisible.at(Id(2)), 40);
}

TEST_F(TwoKeyframes, ProjectsFromThePoseThatIsTold) {
  const LandmarkId id = Add(1, 50, {1});
  map_.SetPose(map_.At(Id(2)), WallScene::At(0.6));  // not where it stood when it saw the wall
  EXPECT_EQ(FuseInto(map_, map_.At(Id(2)), map_.At(Id(2)).T_cam_world, {id}, options_), FusionCounts());
  EXPECT_EQ(FuseInto(map_, map_.At(Id(2)), WallScene::At(0.3), {id}, options_).observations, 1);
  EXPECT_EQ(Seen(2, 50), id);
}

}  // namespace
}  // namespace dmslam
