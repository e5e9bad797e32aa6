#include "dmslam/map/map_journal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "dmslam/map/testing/random_editor.h"

namespace dmslam {
namespace {

using KeyframeChange = MapJournal::KeyframeChange;
using LandmarkChange = MapJournal::LandmarkChange;

KeyframeId Kf(uint32_t frame) { return KeyframeId::Make(1, frame); }
LandmarkId Lm(uint64_t number) { return LandmarkId::Make(1, number); }
Sim3d Shift(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 0}, 1.0}; }

/// A journal beside a map of keyframes 1 to 3 and landmarks 1 to 9, which hang on keyframe 1. It is told by
/// hand: the map's own editor keeps another one.
class Journal : public testing::Test {
 protected:
  Journal() : map_(TestCamera(), Pyramid()) {
    Random random(3);
    for (uint32_t frame = 1; frame <= 3; ++frame) {
      Keyframe keyframe;
      keyframe.id = Kf(frame);
      keyframe.map_id = 1;
      if (frame > 1) keyframe.parent = Kf(frame - 1);
      keyframe.features = RandomFeatures(random, 10);
      map_.AddKeyframe(keyframe);
    }
    for (uint64_t number = 1; number <= 9; ++number) {
      Landmark landmark;
      landmark.id = Lm(number);
      landmark.map_id = 1;
      landmark.reference = landmark.first_keyframe = Kf(1);
      map_.AddLandmark(landmark);
    }
  }
  MapDelta Written() const {
    MapDelta delta;
    journal_.Write(map_, &delta);
    return delta;
  }
  std::vector<LandmarkId> PositionsWritten() const {
    std::vector<LandmarkId> ids;
    std::ranges::transform(Written().landmark_positions, std::back_inserter(ids), &LandmarkPosition::id);
    return ids;
  }

  MapEditor map_;
  MapJournal journal_;
};

TEST_F(Journal, NothingIsWrittenOfWhatIsNotNoted) { EXPECT_TRUE(Written().Empty()); }

TEST_F(Journal, WhatChangedOftenIsWrittenOnceAndAsItIsNow) {
  for (const double x : {1.0, 2.0}) {
    journal_.Note(Kf(2), KeyframeChange::kPose);
    journal_.Note(Lm(2), LandmarkChange::kPosition);
    journal_.NoteObservation(Kf(2), 4);
    map_.SetPoseAndScale(map_.At(Kf(2)), Rigid3d(Eigen::Quaterniond::Identity(), {x, 0, 0}), 2.0);
    map_.SetPosition(map_.At(Lm(2)), {x, 0, 4});
  }
  map_.SetObservation(map_.At(Kf(2)), 4, map_.At(Lm(2)));
  MapDelta delta = Written();
  EXPECT_TRUE(delta.keyframes.empty());
  ASSERT_EQ(delta.keyframe_poses.size(), 1U);
  EXPECT_EQ(delta.keyframe_poses[0].id, Kf(2));
  EXPECT_EQ(delta.keyframe_poses[0].T_cam_world.translation.x(), 2.0);
  EXPECT_EQ(delta.keyframe_poses[0].scale, 4.0);
  EXPECT_TRUE(delta.landmarks.empty());
  ASSERT_EQ(delta.landmark_positions.size(), 1U);
  EXPECT_EQ(delta.landmark_positions[0].p_world.x(), 2.0);
  EXPECT_TRUE(delta.landmark_evidence.empty());
  EXPECT_EQ(delta.observations, (std::vector<ObservationState>{{Kf(2), 4, Lm(2)}}));
  map_.ClearObservation(map_.At(Kf(2)), 4);
  delta = Written();
  EXPECT_EQ(delta.observations, (std::vector<ObservationState>{{Kf(2), 4, std::nullopt}}));
}

TEST_F(Journal, AKeyframesStateIncludesItsPoseAndFeaturesTravelOnlyWhereTheyAreNew) {
  journal_.Note(Kf(1), KeyframeChange::kPose);
  journal_.Note(Kf(1), KeyframeChange::kState);
  journal_.Note(Kf(2), KeyframeChange::kFeatures);
  const MapDelta delta = Written();
  EXPECT_TRUE(delta.keyframe_poses.empty());
  ASSERT_EQ(delta.keyframes.size(), 2U);
  EXPECT_EQ(delta.keyframes[0].id, Kf(1));
  EXPECT_EQ(delta.keyframes[0].features, nullptr);
  EXPECT_EQ(delta.keyframes[1].parent, Kf(1));
  EXPECT_EQ(delta.keyframes[1].features.get(), &map_.At(Kf(2)).features->set) << "not copied";
}

TEST_F(Journal, ALandmarksStateIncludesPositionAndEvidenceWhichAreElseToldApart) {
  for (const uint64_t number : {7, 3, 5, 9, 2, 8, 1}) {
    journal_.Note(Lm(number), LandmarkChange::kPosition);
    journal_.Note(Lm(number), LandmarkChange::kEvidence);
  }
  journal_.Note(Lm(5), LandmarkChange::kState);
  map_.SetEvidence(map_.At(Lm(7)), {5, 4, 0, 0.5F, 0});
  const MapDelta delta = Written();
  ASSERT_EQ(delta.landmarks.size(), 1U);
  EXPECT_EQ(delta.landmarks[0].id, Lm(5));
  EXPECT_EQ(PositionsWritten(), (std::vector<LandmarkId>{Lm(1), Lm(2), Lm(3), Lm(7), Lm(8), Lm(9)}))
      << "by id, however they are kept";
  ASSERT_EQ(delta.landmark_evidence.size(), 6U);
  EXPECT_EQ(delta.landmark_evidence[3].id, Lm(7));
  EXPECT_EQ(delta.landmark_evidence[3].evidence.visible, 5U);
}

TEST_F(Journal, AMoveIsToldOncePerReferenceAndWhoMovedOtherwiseByPosition) {
  for (const uint64_t number : {1, 2, 3}) journal_.NoteMoveWithReference(map_.At(Lm(number)), Shift(1));
  journal_.NoteMoveWithReference(map_.At(Lm(4)), Shift(2));
  Landmark of_another;
  of_another.id = Lm(10);
  of_another.reference = Kf(3);
  journal_.NoteMoveWithReference(map_.AddLandmark(of_another), Shift(2));
  const MapDelta delta = Written();
  ASSERT_EQ(delta.reference_moves.size(), 2U);
  EXPECT_EQ(delta.reference_moves[0].reference, Kf(1));
  EXPECT_EQ(delta.reference_moves[0].after_from_before, Shift(1));
  EXPECT_EQ(delta.reference_moves[1].reference, Kf(3));
  EXPECT_EQ(delta.reference_moves[1].after_from_before, Shift(2));
  EXPECT_EQ(PositionsWritten(), std::vector<LandmarkId>{Lm(4)});
}

TEST_F(Journal, NothingIsSaidOfAForgottenLandmark) {
  journal_.Note(Lm(1), LandmarkChange::kState);
  journal_.Note(Lm(2), LandmarkChange::kPosition);
  journal_.Forget(Lm(1));
  EXPECT_TRUE(Written().landmarks.empty());
  EXPECT_EQ(PositionsWritten(), std::vector<LandmarkId>{Lm(2)});
}

TEST_F(Journal, NothingIsSaidOfAForgottenKeyframeNorOfWhatItSees) {
  for (uint32_t frame = 1; frame <= 3; ++frame) {
    journal_.Note(Kf(frame), KeyframeChange::kPose);
    for (const uint16_t feature : {uint16_t{0}, uint16_t{9}}) journal_.NoteObservation(Kf(frame), feature);
  }
  journal_.NoteObservation(Kf(2), 0xffff);
  journal_.Forget(Kf(2));
  const MapDelta delta = Written();
  ASSERT_EQ(delta.keyframe_poses.size(), 2U);
  EXPECT_EQ(delta.keyframe_poses[0].id, Kf(1));
  EXPECT_EQ(delta.keyframe_poses[1].id, Kf(3));
  EXPECT_EQ(delta.observations, (std::vector<ObservationState>{{Kf(1), 0, std::nullopt},
                                                               {Kf(1), 9, std::nullopt},
                                                               {Kf(3), 0, std::nullopt},
                                                               {Kf(3), 9, std::nullopt}}));
}

TEST_F(Journal, TombstonesAreToldInTheOrderOfDeathAndDroppedMapsByName) {
  map_.Fuse(map_.At(Lm(8)), map_.At(Lm(1)), {});
  map_.RemoveLandmark(map_.At(Lm(6)));
  map_.RemoveKeyframe(map_.At(Kf(2)));
  journal_.NoteTombstone(Lm(8));
  journal_.NoteTombstone(Lm(6));
  journal_.NoteTombstone(Kf(2));
  journal_.NoteDroppedMap(5);
  const MapDelta delta = Written();
  ASSERT_EQ(delta.landmark_tombstones.size(), 2U);
  EXPECT_EQ(delta.landmark_tombstones[0].id, Lm(8));
  EXPECT_EQ(delta.landmark_tombstones[0].replaced_by, Lm(1));
  EXPECT_EQ(delta.landmark_tombstones[1].id, Lm(6));
  EXPECT_FALSE(delta.landmark_tombstones[1].replaced_by);
  ASSERT_EQ(delta.keyframe_tombstones.size(), 1U);
  EXPECT_EQ(delta.keyframe_tombstones[0].parent, Kf(1));
  EXPECT_EQ(delta.dropped_maps, std::vector<MapId>{5});
}

}  // namespace
}  // namespace dmslam
