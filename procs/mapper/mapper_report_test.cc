#include "mapper/mapper_report.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

/// A mapper whose deltas are counted, and a camera that moves along a wall in steps of 0.3.
class MapperReportTest : public testing::Test {
 protected:
  static constexpr uint16_t kKnown = 60;  // points of the first map

  MapperReportTest()
      : core_(Options(), TestCamera(), Pyramid(), 1,
              [this](const MapDelta& delta) { tally_.OnDelta(delta, core_.map()); }) {}

  static MapperOptions Options() {
    MapperOptions options;
    options.redundant_share = 2.0;  // no keyframe is redundant
    return options;
  }
  static double PlaceOf(uint32_t frame) { return 0.3 * frame; }
  bool Start() {
    InitialMap proposal;
    proposal.map_id = 1;
    proposal.first = scene_.Propose(0, PlaceOf(0), 0, PlaceOf(0), 0);
    proposal.second = scene_.Propose(1, PlaceOf(1), 0, PlaceOf(0), 1);
    for (uint16_t i = 0; i < kKnown; ++i) proposal.points.push_back({i, i, scene_.point(i)});
    return core_.OnInitialMap(proposal);
  }
  /// The frame that follows the first map. It sees all points.
  KeyframeProposal Next() const {
    KeyframeProposal proposal = scene_.Propose(2, PlaceOf(2), 1, PlaceOf(1), 2);
    const Keyframe& last = core_.map().At(Id(1));
    proposal.T_cam_reference.translation *= last.T_cam_world.Center().norm() / PlaceOf(1);
    for (uint16_t i = 0; i < kKnown; ++i) {
      if (last.landmarks[i].valid()) proposal.matches.push_back({i, last.landmarks[i]});
    }
    return proposal;
  }
  LandmarkId Known(size_t feature) const { return core_.map().At(Id(1)).landmarks[feature]; }
  void Say(LandmarkId landmark, uint16_t found, uint16_t moved) {
    FrameEvidence evidence;
    evidence.map_id = 1;
    evidence.items.push_back({landmark, static_cast<uint16_t>(found + moved), found, moved});
    core_.OnEvidence(evidence);
  }
  MapperStatus Status() const { return StatusOf(core_, tally_); }

  WallScene scene_;
  MapTally tally_;
  MapperCore core_;
};

TEST_F(MapperReportTest, TellsWhatTheCoreDid) {
  ASSERT_TRUE(Start());
  Say(Known(5), 0, 4);
  KeyframeProposal next = Next();
  for (uint16_t i = kKnown; i < kKnown + 10; ++i) next.moving.push_back(i);
  ASSERT_EQ(core_.OnKeyframe(next), KeyframeOutcome::kInserted);
  core_.RefuseCorrection(7, "a test");
  const MapperStatus status = Status();
  EXPECT_EQ(status.version, static_cast<int64_t>(core_.map().version()));
  EXPECT_EQ(status.maps, 1);
  EXPECT_EQ(status.keyframes, 3);
  EXPECT_EQ(status.landmarks, static_cast<int32_t>(core_.map().num_landmarks()));
  EXPECT_EQ(status.keyframes_inserted, 1);
  EXPECT_EQ(status.landmarks_created, core_.counters().creation.created);
  EXPECT_GT(status.landmarks_created, 0);
  EXPECT_EQ(status.refused_motion, 10);
  EXPECT_EQ(core_.counters().landmarks_moving_removed, 1u);
  EXPECT_EQ(status.landmarks_culled, static_cast<int64_t>(core_.counters().landmarks_culled +
                                                          core_.counters().landmarks_seen_through + 1));
  EXPECT_EQ(status.corrections_refused, 1);
}

TEST_F(MapperReportTest, TellsAtTheEndWhatWasNotDone) {
  ASSERT_TRUE(Start());
  EXPECT_EQ(NotDoneText(core_.counters()), "");
  KeyframeProposal lost = Next();
  lost.reference = Id(77);
  for (int times = 0; times < 2; ++times) EXPECT_EQ(core_.OnKeyframe(lost), KeyframeOutcome::kRefused);
  Say(LandmarkId::Make(9, 9), 1, 0);
  EXPECT_EQ(NotDoneText(core_.counters()),
            "2 keyframes refused, whose reference is unknown or of another map; "
            "1 pieces of evidence of landmarks that were gone");
  MapReset reset;
  reset.map_id = 1;
  reset.fate = MapReset::Fate::kDrop;
  core_.OnReset(reset);
  EXPECT_NE(NotDoneText(core_.counters()).find("1 maps dropped"), std::string::npos);
}

TEST_F(MapperReportTest, CountsLandmarksWhileTheyAreBelievedToMove) {
  ASSERT_TRUE(Start());
  EXPECT_EQ(Status().moving_landmarks, 0);
  Say(Known(3), 0, 1);
  Say(Known(4), 0, 2);
  EXPECT_EQ(Status().moving_landmarks, 2);
  Say(Known(3), 10, 0);
  EXPECT_EQ(Status().moving_landmarks, 1) << "one stands again";
  Say(Known(4), 0, 2);
  EXPECT_EQ(core_.counters().landmarks_moving_removed, 1u);
  EXPECT_EQ(Status().moving_landmarks, 0) << "the other one is gone";
}

TEST_F(MapperReportTest, WhatGoesWithItsMapIsNotCountedAnyMore) {
  ASSERT_TRUE(Start());
  Say(Known(3), 0, 1);
  MapReset reset;
  reset.map_id = 1;
  reset.fate = MapReset::Fate::kDrop;
  core_.OnReset(reset);
  EXPECT_EQ(Status().maps, 0);
  EXPECT_EQ(Status().moving_landmarks, 0);
}

/// Two maps of a keyframe each, and a landmark in the second one that is believed to move.
MapEditor TwoMaps(const WallScene& scene) {
  MapEditor map(TestCamera(), Pyramid());
  scene.AddKeyframe(map, 1, 0.0);
  map.SetMapId(scene.AddKeyframe(map, 2, 0.3), 2);
  const Landmark& moving = map.At(scene.AddLandmark(map, 1, 0, {2}));
  map.SetMapId(moving, 2);
  LandmarkEvidence evidence;
  evidence.motion_belief = 2;
  map.SetEvidence(moving, evidence);
  map.TakeDelta(MapEvent::kMapStarted, Id(2), 2);
  return map;
}

TEST_F(MapperReportTest, AMapThatIsContinuedIsCountedAsItIs) {
  core_.Continue(TwoMaps(scene_));
  tally_.Count(core_.map());
  EXPECT_EQ(Status().maps, 2);
  EXPECT_EQ(Status().moving_landmarks, 1);
}

TEST_F(MapperReportTest, MapsThatAreJoinedAreOne) {
  MapEditor map = TwoMaps(scene_);
  MapTally tally;
  tally.Count(map);
  EXPECT_EQ(tally.maps(), 2u);
  map.SetMapId(map.At(Id(2)), 1);
  tally.OnDelta(map.TakeDelta(MapEvent::kCorrected, Id(2), 1), map);
  EXPECT_EQ(tally.maps(), 1u);
  EXPECT_EQ(tally.moving(), 1u);
}

TEST(KeyframeTimingTest, TellsHowLongAKeyframeTook) {
  constexpr int64_t kMs = 1'000'000;
  KeyframeTiming timing;
  timing.OnRecord(1 * kMs);
  timing.OnPublished(MapEvent::kLandmarksCreated, 3 * kMs);
  timing.OnPublished(MapEvent::kFused, 4 * kMs);
  timing.OnPublished(MapEvent::kAdjusted, 8 * kMs);
  MapperStatus status;
  timing.Fill(&status);
  for (const double ms : {status.landmarks_p50_ms, status.landmarks_p95_ms, status.landmarks_p99_ms})
    EXPECT_DOUBLE_EQ(ms, 2);
  for (const double ms : {status.adjusted_p50_ms, status.adjusted_p95_ms, status.adjusted_p99_ms})
    EXPECT_DOUBLE_EQ(ms, 7);
  EXPECT_DOUBLE_EQ(status.adjustment_ms, 4);
}

}  // namespace
}  // namespace dmslam
