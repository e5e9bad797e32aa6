#include "dmslam/mapping/landmark_history.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/map/testing/map_scene.h"
#include "dmslam/mapping/mapper_core.h"
#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

std::vector<uint32_t> FramesOf(const std::vector<LandmarkSight>& sights) {
  std::vector<uint32_t> frames;
  frames.reserve(sights.size());
  for (const LandmarkSight& sight : sights) frames.push_back(sight.keyframe.frame_index());
  return frames;
}

/// What a real mapper publishes of a camera that moves along a wall, in steps of 0.3.
class OfAMapper : public ::testing::Test {
 protected:
  OfAMapper()
      : core_(MapperOptions(), TestCamera(), Pyramid(), 1,
              [this](const MapDelta& delta) { histories_.Add(delta); }) {
    InitialMap proposal;
    proposal.map_id = 1;
    proposal.first = scene_.Propose(0, 0, 0, 0, 0);
    proposal.second = scene_.Propose(1, kStep, 0, 0, 1);
    for (uint16_t i = 0; i < kKnown; ++i) proposal.points.push_back({i, i, scene_.point(i)});
    EXPECT_TRUE(core_.OnInitialMap(proposal));
  }

  /// Sees all of the wall, and what the keyframe before it has landmarks of.
  KeyframeProposal Frame(uint32_t frame) const {
    const Keyframe& last = core_.map().keyframes().rbegin()->second;
    const uint32_t reference = last.id.frame_index();
    KeyframeProposal proposal = scene_.Propose(frame, kStep * frame, reference, kStep * reference, frame);
    proposal.T_cam_reference.translation *= last.T_cam_world.Center().norm() / (kStep * reference);
    for (size_t i = 0; i < last.landmarks.size(); ++i) {
      if (last.landmarks[i].valid())
        proposal.matches.push_back({static_cast<uint16_t>(i), last.landmarks[i]});
    }
    return proposal;
  }
  LandmarkId SeenBy(uint32_t frame, uint16_t feature) const {
    return core_.map().At(WallScene::Id(frame)).landmarks[feature];
  }
  const LandmarkHistory& Of(LandmarkId id) const { return histories_.landmarks().at(id); }

  static constexpr double kStep = 0.3;
  static constexpr uint16_t kKnown = 60;  // points of the first map
  WallScene scene_;
  LandmarkHistories histories_{TestCamera(), Pyramid(), MapperOptions()};
  MapperCore core_;
};

TEST_F(OfAMapper, ToldWhichKeyframesMadeIt) {
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  const LandmarkHistory& first = Of(SeenBy(2, 5));
  EXPECT_EQ(first.origin, LandmarkOrigin::kFirstMap);
  EXPECT_EQ(first.made.about, WallScene::Id(1));
  EXPECT_EQ(first.made.stamp_ns, 1'000'000'000);
  EXPECT_EQ(FramesOf(first.made_from), (std::vector<uint32_t>{0, 1}));
  EXPECT_FALSE(first.end);

  const LandmarkHistory& made = Of(SeenBy(2, kKnown + 5));
  EXPECT_EQ(made.origin, LandmarkOrigin::kTriangulated);
  EXPECT_EQ(made.made.event, MapEvent::kLandmarksCreated);
  EXPECT_EQ(made.made.about, WallScene::Id(2));
  EXPECT_GT(made.made.version, first.made.version);
  EXPECT_EQ(FramesOf(made.made_from), (std::vector<uint32_t>{0, 1, 2}));
  for (const LandmarkSight& sight : made.made_from) {
    EXPECT_EQ(sight.feature, kKnown + 5);
    EXPECT_LT(sight.error_px.value(), 2.0);
  }
  ASSERT_TRUE(made.widest);
  EXPECT_EQ(made.widest->keyframe, WallScene::Id(0)) << "it stands farthest away";
}

TEST_F(OfAMapper, WhatIsRarelyFoundWhileItIsYoungIsToldFromWhatIsSeenThrough) {
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  const LandmarkId lost = SeenBy(2, kKnown + 5);
  histories_.Watch(lost);
  const KeyframeProposal next = Frame(3);
  FrameEvidence evidence;
  evidence.map_id = 1;
  evidence.items.push_back({lost, 20, 2, 0});
  core_.OnEvidence(evidence);
  ASSERT_EQ(core_.OnKeyframe(next), KeyframeOutcome::kInserted);
  const LandmarkHistory& history = Of(lost);
  ASSERT_TRUE(history.end);
  EXPECT_EQ(history.end->fate, LandmarkFate::kRarelyFound);
  EXPECT_EQ(history.end->when.about, WallScene::Id(3));
  ASSERT_TRUE(history.end->last);
  EXPECT_EQ(history.end->last->evidence.visible, 21u) << "with the frame that made it";
  EXPECT_EQ(history.end->last->evidence.found, 3u);
  EXPECT_EQ(FramesOf(history.end->seen), (std::vector<uint32_t>{0, 1, 2, 3})) << "the newest saw it, too";
  ASSERT_EQ(history.evidence.size(), 1u);
  EXPECT_EQ(history.evidence[0].when.event, MapEvent::kEvidence);
  EXPECT_EQ(history.evidence[0].when.stamp_ns, 2'000'000'000) << "of the newest keyframe by then";
}

/// Changes made one by one. Four keyframes see six points.
class OfAnEditor : public ::testing::Test {
 protected:
  OfAnEditor() {
    scene_.AddCloud(6, {0, 0, 4}, {0.5, 0.5, 0.2});
    scene_.MapAll(4);
    Tell(MapEvent::kMapStarted, Id(3));
  }

  static KeyframeId Id(uint32_t frame) { return KeyframeId::Make(MapScene::kSession, frame); }
  MapEditor& map() { return scene_.map(); }
  const Landmark& At(size_t point) { return map().At(MapScene::IdOf(point)); }
  const Keyframe& At(KeyframeId id) { return map().At(id); }
  void Tell(MapEvent event, std::optional<KeyframeId> about, const std::string& note = "") {
    MapDelta delta = map().TakeDelta(event, about, MapScene::kMap);
    delta.note = note;
    histories_.Add(delta);
  }
  const LandmarkHistory& Of(size_t point) { return histories_.landmarks().at(MapScene::IdOf(point)); }
  /// A keyframe that sees nothing yet, beside the last one.
  void AddKeyframe(uint32_t frame) {
    Keyframe keyframe = At(Id(3));
    keyframe.id = Id(frame);
    keyframe.stamp_ns = frame * MapScene::kStepNs;
    keyframe.parent = Id(3);
    keyframe.covisible.clear();
    std::ranges::fill(keyframe.landmarks, LandmarkId());
    map().AddKeyframe(std::move(keyframe));
    Tell(MapEvent::kKeyframeInserted, Id(frame));
  }

  MapScene scene_;
  LandmarkHistories histories_{TestCamera(), Pyramid(), MapperOptions()};
};

TEST_F(OfAnEditor, FusionIsToldOfBoth) {
  map().Fuse(At(0), At(1), At(1).evidence);
  Tell(MapEvent::kFused, Id(3));
  ASSERT_TRUE(Of(0).end);
  EXPECT_EQ(Of(0).end->fate, LandmarkFate::kFused);
  EXPECT_EQ(Of(0).end->into, MapScene::IdOf(1));
  EXPECT_EQ(FramesOf(Of(0).end->seen), (std::vector<uint32_t>{0, 1, 2, 3}));
  ASSERT_EQ(Of(1).absorbed.size(), 1u);
  EXPECT_EQ(Of(1).absorbed[0].absorbed, MapScene::IdOf(0));
  EXPECT_EQ(Of(1).absorbed[0].when.version, map().version());
  EXPECT_FALSE(Of(1).end);
}

TEST_F(OfAnEditor, EachStepOfTheMapperHasItsReasons) {
  const std::vector<std::pair<MapEvent, LandmarkFate>> steps = {
      {MapEvent::kLandmarksCreated, LandmarkFate::kSeenThrough},  // its probation is over
      {MapEvent::kEvidence, LandmarkFate::kMoved},
      {MapEvent::kAdjusted, LandmarkFate::kUnheld},
      {MapEvent::kMapped, LandmarkFate::kKeyframeCulled},
      {MapEvent::kMapAdjusted, LandmarkFate::kUnheld},
      {MapEvent::kRequestDone, LandmarkFate::kUnproven}};
  for (size_t i = 0; i < steps.size(); ++i) {
    map().RemoveLandmark(At(i));
    Tell(steps[i].first, Id(3));
    ASSERT_TRUE(Of(i).end) << i;
    EXPECT_EQ(Of(i).end->fate, steps[i].second) << i;
    EXPECT_EQ(Of(i).end->when.event, steps[i].first) << i;
  }
}

TEST_F(OfAnEditor, AYoungLandmarkWithTwoObserversGoesForThat) {
  Landmark young = At(2);
  young.id = MapScene::IdOf(9);
  young.first_keyframe = Id(3);
  young.observations.clear();
  map().AddLandmark(young);
  for (const uint32_t frame : {2u, 3u}) map().SetObservation(At(Id(frame)), 2, map().At(young.id));
  Tell(MapEvent::kLandmarksCreated, Id(3));
  EXPECT_EQ(Of(9).origin, LandmarkOrigin::kTriangulated);
  AddKeyframe(4);
  AddKeyframe(5);
  map().RemoveLandmark(map().At(young.id));
  Tell(MapEvent::kLandmarksCreated, Id(5));
  ASSERT_TRUE(Of(9).end);
  EXPECT_EQ(Of(9).end->fate, LandmarkFate::kFewObservers);
}

TEST_F(OfAnEditor, ALandmarkBeforeTheLensGoesForThatAtTheEnd) {
  map().SetPosition(At(0), {0, 0, 0.2});
  Tell(MapEvent::kAdjusted, Id(3));
  map().RemoveLandmark(At(0));
  Tell(MapEvent::kMapAdjusted, std::nullopt);
  EXPECT_EQ(Of(0).end->fate, LandmarkFate::kTooNear);
}

TEST_F(OfAnEditor, OneThatMovesTakesAlongWhatFramesSaidOfItLast) {
  LandmarkEvidence before = At(1).evidence;
  before.motion_belief = 2.0F;
  map().SetEvidence(At(1), before);
  map().Fuse(At(0), At(1), before);
  Tell(MapEvent::kFused, Id(3));
  FrameEvidence said;
  said.stamp_ns = 7'000'000'000;
  said.items = {{MapScene::IdOf(0), 3, 0, 1}, {MapScene::IdOf(1), 2, 1, 1}};  // with the first it is gone
  EXPECT_EQ(ApplyEvidence(map(), said, MotionBeliefOptions()).removed, 1);
  histories_.Add(map().TakeDelta(MapEvent::kEvidence, std::nullopt, MapScene::kMap), &said);
  ASSERT_TRUE(Of(1).end);
  EXPECT_EQ(Of(1).end->fate, LandmarkFate::kMoved);
  EXPECT_EQ(Of(1).end->when.stamp_ns, said.stamp_ns);
  EXPECT_EQ(Of(1).end->last->evidence.visible, before.visible + 3);
  EXPECT_EQ(Of(1).end->last->evidence.moved, before.moved + 1);
  EXPECT_EQ(Of(1).end->last->evidence.motion_belief, 3.0F);
}

TEST_F(OfAnEditor, WhoSawItOnceIsTold) {
  map().ClearObservation(At(Id(1)), 4);
  Tell(MapEvent::kAdjusted, Id(3));
  map().RemoveKeyframe(At(Id(2)));
  Tell(MapEvent::kMapped, Id(3));
  const std::vector<FormerSight>& former = Of(4).former;
  ASSERT_EQ(former.size(), 2u);
  EXPECT_EQ(former[0].sight.keyframe, Id(1));
  EXPECT_EQ(former[0].sight.feature, 4u);
  EXPECT_FALSE(former[0].keyframe_culled);
  EXPECT_EQ(former[1].sight.keyframe, Id(2));
  EXPECT_TRUE(former[1].keyframe_culled);
  EXPECT_EQ(former[1].until.event, MapEvent::kMapped);
}

TEST_F(OfAnEditor, BeliefIsToldWhereItChangesSidesAndWhollyWhereItIsWatched) {
  histories_.Watch(MapScene::IdOf(1));
  const auto believe = [&](float belief) {
    for (const size_t point : {0u, 1u}) {
      LandmarkEvidence evidence = At(point).evidence;
      ++evidence.visible;
      evidence.motion_belief = belief;
      map().SetEvidence(At(point), evidence);
    }
    Tell(MapEvent::kEvidence, std::nullopt);
  };
  for (const float belief : {-0.5F, 1.0F, 2.0F, -0.5F}) believe(belief);
  ASSERT_EQ(Of(0).evidence.size(), 2u);
  EXPECT_EQ(Of(0).evidence[0].evidence.motion_belief, 1.0F);
  EXPECT_EQ(Of(0).evidence[1].evidence.motion_belief, -0.5F);
  EXPECT_EQ(Of(1).evidence.size(), 4u);
}

TEST_F(OfAnEditor, AMapThatIsGivenUpTakesItsLandmarksWithIt) {
  map().DropMap(MapScene::kMap);
  Tell(MapEvent::kMapDropped, std::nullopt, "did not predict");
  ASSERT_TRUE(Of(0).end);
  EXPECT_EQ(Of(0).end->fate, LandmarkFate::kMapDropped);
  EXPECT_EQ(Of(0).end->note, "did not predict");
}

TEST_F(OfAnEditor, ASnapshotSaysWhatIsThereAndNotWhy) {
  map().Fuse(At(0), At(1), At(1).evidence);
  const std::vector<MapDelta> saved = CutSnapshot(map(), Id(3), 60000);
  LandmarkHistories of_snapshot(TestCamera(), Pyramid(), MapperOptions());
  for (const MapDelta& part : saved) of_snapshot.Add(part);
  const LandmarkHistory& stays = of_snapshot.landmarks().at(MapScene::IdOf(1));
  EXPECT_EQ(stays.origin, LandmarkOrigin::kNotTold);
  EXPECT_TRUE(stays.made_from.empty());
  ASSERT_EQ(stays.absorbed.size(), 1u);
  const LandmarkHistory& gone = of_snapshot.landmarks().at(MapScene::IdOf(0));
  ASSERT_TRUE(gone.end);
  EXPECT_EQ(gone.end->fate, LandmarkFate::kFused);
  EXPECT_FALSE(gone.end->last);
}

TEST_F(OfAnEditor, WhatIsNamedAndNeverToldIsNotSaidToBeInTheMap) {
  map().Fuse(At(0), At(1), At(1).evidence);
  MapDelta only = map().TakeDelta(MapEvent::kFused, Id(3), MapScene::kMap);
  LandmarkHistories histories(TestCamera(), Pyramid(), MapperOptions());
  only.landmarks.clear();
  histories.Add(only);  // all before it is missing
  histories.Finish();
  const LandmarkHistory& into = histories.landmarks().at(MapScene::IdOf(1));
  EXPECT_EQ(into.origin, LandmarkOrigin::kOther);
  ASSERT_TRUE(into.end);
  EXPECT_EQ(into.end->fate, LandmarkFate::kNotTold);
}

TEST_F(OfAnEditor, WhatALaterMapperBeganWithMayLackSome) {
  const std::vector<MapDelta> checkpoint = CutSnapshot(map(), Id(3), 60000);
  Landmark newer = At(2);
  newer.id = MapScene::IdOf(9);
  newer.observations.clear();
  map().AddLandmark(newer);
  map().SetObservation(At(Id(3)), 2, map().At(newer.id));
  map().RemoveLandmark(At(1));
  Tell(MapEvent::kLandmarksCreated, Id(3));
  histories_.BeginAnew();
  for (const MapDelta& part : checkpoint) histories_.Add(part);
  histories_.Finish();
  ASSERT_TRUE(Of(9).end);
  EXPECT_EQ(Of(9).end->fate, LandmarkFate::kLeftOut);
  EXPECT_EQ(Of(9).end->when.version, map().version()) << "until then it was there";
  EXPECT_TRUE(Of(9).end->last);
  EXPECT_FALSE(Of(1).end) << "the older map has it";
  EXPECT_EQ(Of(1).origin, LandmarkOrigin::kFirstMap) << "what was told of it before holds";
}

}  // namespace
}  // namespace dmslam
