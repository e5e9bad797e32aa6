#include "dmslam/map/map_editor.h"

#include <gtest/gtest.h>

#include "dmslam/map/testing/random_editor.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

KeyframeId Kf(uint32_t frame) { return KeyframeId::Make(1, frame); }
LandmarkId Lm(uint64_t number) { return LandmarkId::Make(1, number); }

/// Keyframes 1, 2, 3 in a row, each with ten features and hanging from the one before. Landmarks 1 to 4:
/// landmark n is seen by feature n of all three.
class Editor : public testing::Test {
 protected:
  Editor() : map_(TestCamera(), Pyramid()) {
    Random random(3);
    for (uint32_t frame = 1; frame <= 3; ++frame) {
      Keyframe keyframe;
      keyframe.id = Kf(frame);
      keyframe.map_id = 1;
      keyframe.stamp_ns = 100 * frame;
      if (frame > 1) keyframe.parent = Kf(frame - 1);
      keyframe.T_cam_world.translation = {-static_cast<double>(frame), 0, 0};
      keyframe.features = RandomFeatures(random, 10);
      map_.AddKeyframe(keyframe);
    }
    for (uint64_t number = 1; number <= 4; ++number) {
      Landmark landmark;
      landmark.id = Lm(number);
      landmark.map_id = 1;
      landmark.p_world = {0, 0, 4};
      landmark.reference = landmark.first_keyframe = Kf(1);
      map_.AddLandmark(landmark);
      for (uint32_t frame = 1; frame <= 3; ++frame)
        map_.SetObservation(map_.At(Kf(frame)), static_cast<uint16_t>(number), map_.At(Lm(number)));
    }
    first_ = Take();
  }
  MapDelta Take() { return map_.TakeDelta(MapEvent::kSettled, Kf(3), 1); }

  MapEditor map_;
  MapDelta first_;
};

TEST_F(Editor, FirstDeltaHoldsEverythingAndTheNextNothing) {
  EXPECT_EQ(first_.keyframes.size(), 3u);
  EXPECT_NE(first_.keyframes.front().features, nullptr);
  EXPECT_EQ(first_.landmarks.size(), 4u);
  EXPECT_EQ(first_.observations.size(), 12u);
  EXPECT_EQ(first_.version, 1u);
  EXPECT_EQ(first_.stamp_ns, 300);
  const MapDelta second = Take();
  EXPECT_TRUE(second.Empty());
  EXPECT_EQ(second.version, 2u);
}

TEST_F(Editor, AThingThatMovedTravelsWithoutItsState) {
  map_.SetPose(map_.At(Kf(2)), Rigid3d(Eigen::Quaterniond::Identity(), {7, 0, 0}));
  map_.SetPosition(map_.At(Lm(2)), {1, 2, 3});
  map_.SetEvidence(map_.At(Lm(3)), {5, 4, 0, 0.5F, 0});
  const MapDelta delta = Take();
  EXPECT_TRUE(delta.keyframes.empty());
  ASSERT_EQ(delta.keyframe_poses.size(), 1u);
  EXPECT_EQ(delta.keyframe_poses.front().T_cam_world.translation.x(), 7);
  EXPECT_TRUE(delta.landmarks.empty());
  ASSERT_EQ(delta.landmark_positions.size(), 1u);
  EXPECT_EQ(delta.landmark_positions.front().id, Lm(2));
  ASSERT_EQ(delta.landmark_evidence.size(), 1u);
  EXPECT_EQ(delta.landmark_evidence.front().id, Lm(3));
}

TEST_F(Editor, AStateIncludesPoseAndPosition) {
  map_.SetPose(map_.At(Kf(2)), Rigid3d());
  map_.SetParent(map_.At(Kf(2)), Kf(3));
  map_.SetPosition(map_.At(Lm(2)), {1, 2, 3});
  map_.SetMapId(map_.At(Lm(2)), 5);
  const MapDelta delta = Take();
  ASSERT_EQ(delta.keyframes.size(), 1u);
  EXPECT_EQ(delta.keyframes.front().features, nullptr) << "they are known";
  EXPECT_TRUE(delta.keyframe_poses.empty());
  ASSERT_EQ(delta.landmarks.size(), 1u);
  EXPECT_TRUE(delta.landmark_positions.empty());
}

TEST_F(Editor, ALandmarkHasOneFeaturePerKeyframe) {
  map_.SetObservation(map_.At(Kf(2)), 9, map_.At(Lm(1)));
  EXPECT_FALSE(map_.At(Kf(2)).landmarks[1].valid()) << "the older one is released";
  EXPECT_EQ(map_.At(Lm(1)).SeenBy(Kf(2))->feature, 9);
  EXPECT_EQ(map_.At(Lm(1)).observations.size(), 3u);
  const MapDelta delta = Take();
  ASSERT_EQ(delta.observations.size(), 2u);
  EXPECT_EQ(delta.observations[0], (ObservationState{Kf(2), 1, std::nullopt}));
  EXPECT_EQ(delta.observations[1], (ObservationState{Kf(2), 9, Lm(1)}));
}

TEST_F(Editor, AFeatureSeesOneLandmark) {
  map_.SetObservation(map_.At(Kf(2)), 1, map_.At(Lm(4)));
  EXPECT_EQ(map_.At(Lm(1)).SeenBy(Kf(2)), nullptr);
  EXPECT_EQ(map_.At(Kf(1)).covisible.at(Kf(2)), 3);
  EXPECT_EQ(map_.At(Kf(1)).covisible.at(Kf(3)), 4);
}

TEST_F(Editor, FusedLandmarksShareObserversAndHaveTheEvidenceThatIsTold) {
  map_.ClearObservation(map_.At(Kf(3)), 2);
  map_.SetEvidence(map_.At(Lm(1)), {10, 8, 1, 0, 0});
  map_.SetEvidence(map_.At(Lm(2)), {5, 4, 2, 0, 0});
  Take();
  map_.Fuse(map_.At(Lm(1)), map_.At(Lm(2)), {15, 12, 3, 0.5F, 0});
  EXPECT_EQ(map_.FindLandmark(Lm(1)), nullptr);
  EXPECT_EQ(map_.Resolve(Lm(1)), &map_.At(Lm(2)));
  EXPECT_EQ(map_.At(Lm(2)).evidence.visible, 15u);
  EXPECT_EQ(map_.At(Lm(2)).evidence.found, 12u);
  EXPECT_EQ(map_.At(Lm(2)).evidence.moved, 3u);
  EXPECT_EQ(map_.At(Lm(2)).evidence.motion_belief, 0.5F);
  EXPECT_EQ(map_.At(Lm(2)).SeenBy(Kf(3))->feature, 1) << "it did not see the other: it sees it now";
  EXPECT_EQ(map_.At(Lm(2)).SeenBy(Kf(1))->feature, 2) << "it saw it already";
  EXPECT_FALSE(map_.At(Kf(1)).landmarks[1].valid());
  const MapDelta delta = Take();
  ASSERT_EQ(delta.landmark_tombstones.size(), 1u);
  EXPECT_EQ(delta.landmark_tombstones.front().replaced_by, Lm(2));
}

TEST_F(Editor, RemovedKeyframeHandsOnChildrenAndReferences) {
  Landmark own;
  own.id = Lm(9);
  own.map_id = 1;
  own.reference = own.first_keyframe = Kf(2);
  map_.AddLandmark(own);
  map_.SetObservation(map_.At(Kf(2)), 8, map_.At(Lm(9)));
  Landmark shared = own;
  shared.id = Lm(8);
  map_.AddLandmark(shared);
  map_.SetObservation(map_.At(Kf(2)), 7, map_.At(Lm(8)));
  map_.SetObservation(map_.At(Kf(3)), 7, map_.At(Lm(8)));
  map_.AddLoopEdge(map_.At(Kf(1)), map_.At(Kf(2)));
  map_.RemoveKeyframe(map_.At(Kf(2)));
  EXPECT_EQ(map_.At(Kf(3)).parent, Kf(1));
  EXPECT_EQ(map_.Children(Kf(1)), std::vector<KeyframeId>{Kf(3)});
  EXPECT_EQ(map_.FindLandmark(Lm(9)), nullptr) << "nobody else saw it";
  EXPECT_EQ(map_.At(Lm(8)).reference, Kf(3));
  EXPECT_TRUE(map_.At(Kf(1)).loop_edges.empty());
  EXPECT_EQ(map_.At(Kf(1)).covisible.count(Kf(2)), 0u);
  ASSERT_TRUE(map_.keyframe_tombstones().contains(Kf(2)));
  EXPECT_EQ(map_.keyframe_tombstones().at(Kf(2)).parent, Kf(1));
}

TEST_F(Editor, NothingIsSaidOfWhatCameAndWentBetweenTwoDeltas) {
  Random random(4);
  Keyframe keyframe;
  keyframe.id = Kf(4);
  keyframe.map_id = 1;
  keyframe.parent = Kf(3);
  keyframe.features = RandomFeatures(random, 5);
  map_.AddKeyframe(keyframe);
  map_.SetObservation(map_.At(Kf(4)), 0, map_.At(Lm(1)));
  map_.RemoveKeyframe(map_.At(Kf(4)));
  const MapDelta delta = Take();
  EXPECT_TRUE(delta.keyframes.empty());
  EXPECT_TRUE(delta.observations.empty());
  EXPECT_EQ(delta.keyframe_tombstones.size(), 1u);
}

TEST_F(Editor, ADroppedMapIsAllThatIsSaidOfIt) {
  map_.SetPosition(map_.At(Lm(1)), {1, 1, 1});
  map_.DropMap(1);
  EXPECT_TRUE(map_.keyframes().empty());
  EXPECT_EQ(map_.num_landmarks(), 0u);
  const MapDelta delta = Take();
  EXPECT_EQ(delta.dropped_maps, std::vector<MapId>{1});
  EXPECT_TRUE(delta.landmark_positions.empty());
  EXPECT_TRUE(delta.observations.empty());
}

TEST_F(Editor, TheMiddleDescriptorStandsForTheLandmark) {
  FeatureSet features;
  for (const uint64_t word : {0ULL, 0x1ULL, 0xffffULL}) {
    features.keypoints.push_back({320 * 16, 240 * 16, 0, 0});
    features.descriptors.push_back({{word, 0, 0, 0}});
  }
  for (uint32_t i = 0; i < 3; ++i) {
    Keyframe keyframe;
    keyframe.id = Kf(10 + i);
    keyframe.map_id = 1;
    keyframe.parent = Kf(1);
    keyframe.features = MakeFrameFeatures(features, map_.camera(), map_.pyramid());
    map_.AddKeyframe(keyframe);
  }
  Landmark landmark;
  landmark.id = Lm(20);
  landmark.reference = Kf(10);
  map_.AddLandmark(landmark);
  for (uint16_t i = 0; i < 3; ++i) map_.SetObservation(map_.At(Kf(10 + i)), i, map_.At(Lm(20)));
  map_.UpdateDescriptor(map_.At(Lm(20)));
  EXPECT_EQ(map_.At(Lm(20)).descriptor.words[0], 0u) << "1 and 16 bits from the others; ties: the first";
  map_.ClearObservation(map_.At(Kf(10)), 0);
  map_.UpdateDescriptor(map_.At(Lm(20)));
  EXPECT_EQ(map_.At(Lm(20)).descriptor.words[0], 1u);
}

TEST_F(Editor, AMapThatIsContinuedIsKnown) {
  MapEditor next{Map(map_)};
  EXPECT_EQ(next.version(), map_.version());
  EXPECT_TRUE(next.TakeDelta(MapEvent::kSettled, {}, 1).Empty());
}

TEST_F(Editor, FirstKeyframeCannotBeRemoved) {
  EXPECT_THROW(map_.RemoveKeyframe(map_.At(Kf(1))), InvariantError);
}

TEST_F(Editor, EditsOfWhatIsNotThereAreNamed) {
  EXPECT_THROW(map_.SetPose(map_.At(Kf(9)), Rigid3d()), InvariantError);
  EXPECT_THROW(map_.SetPosition(map_.At(Lm(9)), {0, 0, 1}), InvariantError);
  EXPECT_THROW(map_.SetObservation(map_.At(Kf(1)), 10, map_.At(Lm(1))), InvariantError);
  EXPECT_THROW(map_.AddLandmark(map_.At(Lm(1))), InvariantError);
}

}  // namespace
}  // namespace dmslam
