#include "dmslam/mapping/mapper_core.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/replica.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/mapping/testing/wall_scene.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return KeyframeId::Make(1, frame); }

/// A map of three keyframes in a row, each hanging from the one before.
MapEditor SmallMap() {
  MapEditor map(TestCamera(), Pyramid());
  for (uint32_t frame = 1; frame <= 3; ++frame) {
    Keyframe keyframe;
    keyframe.id = Id(frame);
    keyframe.map_id = 1;
    keyframe.T_cam_world = Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(frame, 0, 0));
    if (frame > 1) keyframe.parent = Id(frame - 1);
    keyframe.features = MakeFrameFeatures({}, map.camera(), map.pyramid());
    map.AddKeyframe(std::move(keyframe));
  }
  map.TakeDelta(MapEvent::kMapStarted, Id(3), 1);
  return map;
}

/// Carries what hangs on keyframes 1 and 2 one unit up.
LoopAnswer OneUp(uint64_t base_version, uint64_t correction_id = 7) {
  LoopAnswer answer;
  answer.keyframe = Id(2);
  answer.base_version = base_version;
  answer.correction_id = correction_id;
  answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
  const Sim3d up(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 1, 0), 1.0);
  answer.corrections = {{Id(1), up}, {Id(2), up}};
  return answer;
}

class Corrections : public testing::Test {
 protected:
  Corrections() : core_(MakeCore()) { core_.Continue(SmallMap()); }

  MapperCore MakeCore() {
    return MapperCore(MapperOptions(), TestCamera(), Pyramid(), 1,
                      [this](const MapDelta& delta) { said_.push_back(delta); });
  }
  static double HeightOf(const MapperCore& core, uint32_t frame) {
    return core.map().FindKeyframe(Id(frame))->T_cam_world.Center().y();
  }
  double HeightOf(uint32_t frame) const { return HeightOf(core_, frame); }

  std::vector<MapDelta> said_;
  MapperCore core_;
};

TEST_F(Corrections, OneOfAnOlderVersionIsComposedWithThePosesOfNow) {
  const uint64_t base = core_.map().version();
  for (int i = 0; i < 5; ++i) core_.Settle(Id(3), 1);
  core_.OnLoopAnswer(OneUp(base));
  EXPECT_EQ(core_.counters().corrections_applied, 1u);
  for (const uint32_t frame : {1u, 2u, 3u}) EXPECT_NEAR(HeightOf(frame), 1.0, 1e-12) << frame;
  EXPECT_EQ(said_.back().event, MapEvent::kGloballyAdjusted);
  EXPECT_EQ(said_.back().correction_id, 7u);
  EXPECT_EQ(said_.back().progress.corrected, said_.back().version);
}

TEST_F(Corrections, OneFromBeforeAnotherIsRefused) {
  const uint64_t base = core_.map().version();
  core_.OnLoopAnswer(OneUp(base));
  core_.OnLoopAnswer(OneUp(base, 8));  // of a loop closer that had not heard of the first one
  EXPECT_EQ(core_.counters().corrections_applied, 1u);
  EXPECT_EQ(core_.counters().corrections_refused, 1u);
  EXPECT_NEAR(HeightOf(2), 1.0, 1e-12);
  EXPECT_EQ(said_.back().event, MapEvent::kCorrectionRefused);
  EXPECT_EQ(said_.back().correction_id, 8u);
  EXPECT_NE(said_.back().note.find("before the correction"), std::string::npos) << said_.back().note;
  core_.OnLoopAnswer(OneUp(core_.map().version(), 9));
  EXPECT_NEAR(HeightOf(2), 2.0, 1e-12);
}

TEST_F(Corrections, AMapperThatContinuesAReplicaRefusesThemToo) {
  const uint64_t base = core_.map().version();
  core_.OnLoopAnswer(OneUp(base));
  Replica replica(TestCamera(), Pyramid());
  for (const MapDelta& part : CutSnapshot(core_.map(), Id(1), 60000)) replica.Apply(part);
  MapperCore next = MakeCore();
  next.Continue(std::move(replica));
  next.OnLoopAnswer(OneUp(base, 8));
  EXPECT_EQ(next.counters().corrections_refused, 1u);
  EXPECT_NEAR(HeightOf(next, 2), 1.0, 1e-12);
}

TEST_F(Corrections, OneOfAVersionThatIsNotOursIsRefused) {
  core_.OnLoopAnswer(OneUp(core_.map().version() + 1));
  EXPECT_EQ(core_.counters().corrections_refused, 1u);
  EXPECT_NEAR(HeightOf(2), 0.0, 1e-12);
}

TEST_F(Corrections, OneWhoseKeyframesAreGoneIsRefused) {
  const uint64_t base = core_.map().version();
  MapReset reset;
  reset.map_id = 1;
  reset.fate = MapReset::Fate::kDrop;
  core_.OnReset(reset);
  core_.OnLoopAnswer(OneUp(base));
  EXPECT_EQ(core_.counters().corrections_refused, 1u);
  EXPECT_EQ(said_.back().note, "its keyframes are gone");
}

TEST_F(Corrections, AMapInWhichAnotherCameraHasAPartIsNotDropped) {
  MapReset reset;
  reset.map_id = 1;
  reset.fate = MapReset::Fate::kDrop;
  reset.camera_id = 1;  // as that one knew it before it was joined
  core_.OnReset(reset);
  EXPECT_EQ(core_.map().keyframes().size(), 3u);
  EXPECT_EQ(core_.counters().maps_dropped, 0u);
  reset.camera_id = 0;
  core_.OnReset(reset);
  EXPECT_TRUE(core_.map().keyframes().empty());
}

TEST_F(Corrections, EachCameraIsToldOfItsOwnKeyframes) {
  core_.Settle(Id(3), 1);
  core_.Settle(KeyframeId::Make(1, 3, 2), 1);
  EXPECT_EQ(said_.back().progress.camera, 2u);
  EXPECT_EQ(core_.map().progress(0).settled, Id(3));
  core_.GiveTurn(KeyframeId::Make(1, 9, 1));
  EXPECT_EQ(said_.back().event, MapEvent::kTurn);
  EXPECT_EQ(said_.back().about, KeyframeId::Make(1, 9, 1));
}

/// Two keyframes that see the wall of a third one again. They share landmarks of their own on its first half;
/// of its second half they have none.
class SecondVisit : public Corrections {
 protected:
  static constexpr uint16_t kHalf = 20;

  SecondVisit() {
    MapEditor map(TestCamera(), Pyramid());
    for (const uint32_t frame : {1u, 2u, 3u}) AddKeyframe(frame, 0.05 * frame, map);
    for (const uint16_t feature : Features(0, 2 * kHalf)) AddLandmark(100u + feature, {1}, feature, map);
    for (const uint16_t feature : Features(0, kHalf)) AddLandmark(200u + feature, {2, 3}, feature, map);
    map.TakeDelta(MapEvent::kMapStarted, Id(3), 1);
    core_.Continue(std::move(map));
  }

  static std::vector<uint16_t> Features(uint16_t from, uint16_t to) {
    std::vector<uint16_t> features;
    for (uint16_t i = from; i < to; ++i) features.push_back(i);
    return features;
  }
  static Eigen::Vector3d Point(uint16_t i) {
    const int column = i % 8, row = i / 8;
    return {0.3 * column - 1.0, 0.3 * row - 0.6, 4.0};
  }
  static Descriptor DescriptorOf(uint16_t i) {
    Random random(DeriveSeed(1, i, "descriptor"));
    return {{random.Next(), random.Next(), random.Next(), random.Next()}};
  }
  static void AddKeyframe(uint32_t frame, double x, MapEditor& map) {
    Keyframe keyframe;
    keyframe.id = Id(frame);
    keyframe.map_id = 1;
    keyframe.T_cam_world = Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0));
    if (frame > 1) keyframe.parent = Id(frame - 1);
    FeatureSet features;
    for (uint16_t i = 0; i < 2 * kHalf; ++i) {
      const Eigen::Vector2d uv = *map.camera().Project(keyframe.T_cam_world * Point(i));
      features.keypoints.push_back({static_cast<uint16_t>(std::lround(uv.x() * 16)),
                                    static_cast<uint16_t>(std::lround(uv.y() * 16)), 1, 0});
      features.descriptors.push_back(DescriptorOf(i));
    }
    keyframe.features = MakeFrameFeatures(std::move(features), map.camera(), map.pyramid());
    map.AddKeyframe(std::move(keyframe));
  }
  static void AddLandmark(uint64_t number, const std::vector<uint32_t>& frames, uint16_t feature,
                          MapEditor& map) {
    Landmark landmark;
    landmark.id = LandmarkId::Make(1, number);
    landmark.map_id = 1;
    landmark.p_world = Point(feature);
    landmark.reference = landmark.first_keyframe = Id(frames.front());
    const LandmarkId id = landmark.id;
    map.AddLandmark(std::move(landmark));
    for (const uint32_t frame : frames) map.SetObservation(map.At(Id(frame)), feature, map.At(id));
    map.UpdateDescriptor(map.At(id));
  }
};

TEST_F(SecondVisit, TiesEveryKeyframeOfItsSideToThePlace) {
  LoopAnswer answer;
  answer.keyframe = Id(3);
  answer.seen_from = Id(3);
  answer.matched = Id(1);
  answer.base_version = core_.map().version();
  answer.correction_id = 7;
  answer.kind = LoopAnswer::Kind::kLoop;
  // The graph has moved the neighbour out of its place: what it sees is looked for beside the loop's
  // keyframe.
  const Sim3d aside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.2, 0, 0), 1.0);
  answer.corrections = {{Id(1), Sim3d()}, {Id(2), aside}, {Id(3), Sim3d()}};
  core_.OnLoopAnswer(answer);
  const Keyframe& neighbour = *core_.map().FindKeyframe(Id(2));
  for (const uint16_t feature : Features(kHalf, 2 * kHalf)) {
    EXPECT_EQ(neighbour.landmarks[feature], LandmarkId::Make(1, 100u + feature)) << feature;
  }
}

/// The frontend's records of a camera that moves along a wall, in steps of 0.3.
class KeyframeStep : public testing::Test {
 protected:
  KeyframeStep() : core_(MakeCore(2.0)) {}

  /// With a share above one no keyframe is redundant.
  MapperCore MakeCore(double redundant_share) {
    MapperOptions options;
    options.redundant_share = redundant_share;
    return MapperCore(options, TestCamera(), Pyramid(), 1,
                      [this](const MapDelta& delta) { said_.push_back(delta); });
  }

  static constexpr uint16_t kKnown = 60;  // points of the first map
  static double PlaceOf(uint32_t frame) { return 0.3 * frame; }
  InitialMap FirstMap() const {
    InitialMap proposal;
    proposal.map_id = 1;
    proposal.first = scene_.Propose(0, PlaceOf(0), 0, PlaceOf(0), 0);
    proposal.second = scene_.Propose(1, PlaceOf(1), 0, PlaceOf(0), 1);
    for (uint16_t i = 0; i < kKnown; ++i) proposal.points.push_back({i, i, scene_.point(i)});
    return proposal;
  }
  /// What the frontend would say of a frame: it sees as many of the wall's points as have landmarks, and is
  /// `off` away from where it takes itself to be.
  KeyframeProposal Frame(uint32_t frame, double off = 0) const {
    const uint32_t reference = core_.map().keyframes().rbegin()->first.frame_index();
    KeyframeProposal proposal =
        scene_.Propose(frame, PlaceOf(frame), reference, PlaceOf(reference), static_cast<double>(frame));
    proposal.T_cam_reference.translation = Scale() * proposal.T_cam_reference.translation;
    proposal.T_cam_reference.translation.y() += off;
    const Keyframe& last = core_.map().keyframes().rbegin()->second;
    for (size_t i = 0; i < last.landmarks.size(); ++i) {
      if (last.landmarks[i].valid())
        proposal.matches.push_back({static_cast<uint16_t>(i), last.landmarks[i]});
    }
    return proposal;
  }
  /// Of the map over that of the scene.
  double Scale() const { return core_.map().ResolvePose(Id(1))->T_cam_world.Center().norm() / PlaceOf(1); }
  std::vector<MapEvent> EventsSince(size_t first) const {
    std::vector<MapEvent> events;
    for (size_t i = first; i < said_.size(); ++i) events.push_back(said_[i].event);
    return events;
  }
  bool Start() { return core_.OnInitialMap(FirstMap()); }

  WallScene scene_;
  std::vector<MapDelta> said_;
  MapperCore core_;
};

TEST_F(KeyframeStep, PublishesEveryStepInOrder) {
  ASSERT_TRUE(Start());
  EXPECT_EQ(EventsSince(0), std::vector<MapEvent>{MapEvent::kMapStarted});
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  ASSERT_EQ(core_.OnKeyframe(Frame(3)), KeyframeOutcome::kInserted);
  const std::vector<MapEvent> expected = {MapEvent::kKeyframeInserted, MapEvent::kLandmarksCreated,
                                          MapEvent::kFused, MapEvent::kAdjusted, MapEvent::kMapped};
  std::vector<MapEvent> events = EventsSince(1);
  std::erase(events, MapEvent::kFused);  // said where something was fused
  std::vector<MapEvent> without_fused = expected;
  std::erase(without_fused, MapEvent::kFused);
  std::vector<MapEvent> twice = without_fused;
  twice.insert(twice.end(), without_fused.begin(), without_fused.end());
  EXPECT_EQ(events, twice);
  for (size_t i = 1; i < said_.size(); ++i) EXPECT_GT(said_[i].version, said_[i - 1].version);
}

TEST_F(KeyframeStep, MapsTheWholeWall) {
  ASSERT_TRUE(Start());
  for (const uint32_t frame : {2U, 3U}) ASSERT_EQ(core_.OnKeyframe(Frame(frame)), KeyframeOutcome::kInserted);
  const Map& map = core_.map();
  EXPECT_EQ(map.keyframes().size(), 4u);
  EXPECT_GT(map.num_landmarks(), 120u) << "of 140; the first map had 60";
  EXPECT_GT(core_.counters().creation.created, 60u);
  for (const Landmark* landmark : map.LandmarksOf(1)) {
    const uint16_t i = landmark->observations.front().feature;
    EXPECT_LT((landmark->p_world / Scale() - scene_.point(i)).norm(), 0.05) << i;
    for (const Observation& o : landmark->observations) EXPECT_EQ(o.feature, i) << "one point, one landmark";
  }
}

TEST_F(KeyframeStep, AdjustsWhatTheFrontendGotWrong) {
  ASSERT_TRUE(Start());
  ASSERT_EQ(core_.OnKeyframe(Frame(2, 0.004)), KeyframeOutcome::kInserted);
  const Eigen::Vector3d center = core_.map().At(Id(2)).T_cam_world.Center() / Scale();
  EXPECT_LT((center - Eigen::Vector3d(PlaceOf(2), 0, 0)).norm(), 0.005) << "it was 0.016 off";
}

TEST_F(KeyframeStep, MakesNothingOfWhatMoves) {
  ASSERT_TRUE(Start());
  KeyframeProposal proposal = Frame(2);
  for (uint16_t i = kKnown; i < scene_.size(); ++i) proposal.moving.push_back(i);
  ASSERT_EQ(core_.OnKeyframe(proposal), KeyframeOutcome::kInserted);
  EXPECT_LE(core_.map().num_landmarks(), size_t{kKnown});
}

TEST_F(KeyframeStep, CullsYoungLandmarksThatAreNotFound) {
  ASSERT_TRUE(Start());
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  const KeyframeProposal next = Frame(3);
  FrameEvidence evidence;
  evidence.map_id = 1;
  const LandmarkId lost = core_.map().At(Id(2)).landmarks[kKnown + 5];
  ASSERT_TRUE(lost.valid());
  evidence.items.push_back({lost, 20, 2, 0});
  core_.OnEvidence(evidence);
  ASSERT_EQ(core_.OnKeyframe(next), KeyframeOutcome::kInserted);
  EXPECT_EQ(core_.map().FindLandmark(lost), nullptr);
  EXPECT_GE(core_.counters().landmarks_culled, 1u);
}

/// A map of three keyframes that the mapper goes on from with the fourth.
class FourthKeyframe : public KeyframeStep {
 protected:
  static constexpr uint16_t kFirst = 60, kFew = 10;  // some points that all four see

  static bool IsOneOfFew(uint16_t i) { return i >= kFirst && i < kFirst + kFew; }

  FourthKeyframe() { AddKeyframes({0, 1}); }
  void AddKeyframes(const std::vector<uint32_t>& frames) {
    for (const uint32_t frame : frames) scene_.AddKeyframe(map_, frame, PlaceOf(frame), frame);
  }
  LandmarkId Add(uint64_t number, uint16_t at, const std::vector<uint32_t>& frames) {
    return scene_.AddLandmark(map_, number, at, frames);
  }
  void Continue() {
    map_.TakeDelta(MapEvent::kMapStarted, Id(2), 1);
    core_.Continue(std::move(map_));
  }

  MapEditor map_{TestCamera(), Pyramid()};
};

TEST_F(FourthKeyframe, RemovesWhoStandsWhereTheWallWasSeen) {
  for (const uint16_t i : scene_.All()) Add(100U + i, i, {0, 1});
  for (const uint16_t i : WallScene::Range(kFirst, kFirst + kFew)) {  // half as far as what he hides
    const Rigid3d T_cam_world = WallScene::At(PlaceOf(2));
    scene_.Replace(i, T_cam_world.Inverse() * (0.5 * (T_cam_world * scene_.point(i))));
  }
  AddKeyframes({2});
  std::vector<LandmarkId> person;
  for (const uint16_t i : scene_.All()) {
    if (IsOneOfFew(i)) {
      person.push_back(Add(300U + i, i, {2}));
    } else {
      map_.SetObservation(map_.At(Id(2)), i, map_.At(LandmarkId::Make(1, 100U + i)));
    }
  }
  Continue();
  ASSERT_EQ(core_.OnKeyframe(Frame(3)), KeyframeOutcome::kInserted);
  EXPECT_EQ(core_.counters().landmarks_seen_through, kFew);
  for (const LandmarkId id : person) EXPECT_EQ(core_.map().FindLandmark(id), nullptr);
}

TEST_F(FourthKeyframe, JoinsLandmarksOfOnePoint) {
  AddKeyframes({2});
  for (const uint16_t i : scene_.All()) {
    if (IsOneOfFew(i)) {
      Add(100U + i, i, {0, 1});
      Add(300U + i, i, {2});
    } else {
      Add(100U + i, i, {0, 1, 2});
    }
  }
  Continue();
  ASSERT_EQ(core_.OnKeyframe(Frame(3)), KeyframeOutcome::kInserted);
  EXPECT_EQ(core_.counters().fused.landmarks, kFew) << "observations are counted by themselves";
  for (const uint16_t i : WallScene::Range(kFirst, kFirst + kFew)) {
    EXPECT_EQ(core_.map().At(Id(3)).landmarks[i], LandmarkId::Make(1, 100U + i)) << i;
    EXPECT_EQ(core_.map().FindLandmark(LandmarkId::Make(1, 300U + i)), nullptr) << i;
  }
}

TEST_F(FourthKeyframe, AtTheEndWhatLiesAtTheLensGoes) {
  AddKeyframes({2});
  for (const uint16_t i : scene_.All()) Add(100U + i, i, {0, 1, 2});
  const LandmarkId at_lens = LandmarkId::Make(1, 105);
  map_.SetPosition(map_.At(at_lens), 0.02 * scene_.point(5));  // as keyframe 0 sees it
  Continue();
  core_.End();
  EXPECT_EQ(core_.map().FindLandmark(at_lens), nullptr);
  EXPECT_EQ(core_.counters().landmarks_culled, 1U);
}

TEST_F(KeyframeStep, RemovesWhatIsSeenToMove) {
  ASSERT_TRUE(Start());
  FrameEvidence evidence;
  evidence.map_id = 1;
  const LandmarkId moving = core_.map().At(Id(1)).landmarks[5];
  evidence.items.push_back({moving, 4, 0, 4});
  evidence.items.push_back({LandmarkId::Make(9, 9), 4, 0, 4});
  core_.OnEvidence(evidence);
  EXPECT_EQ(core_.map().FindLandmark(moving), nullptr);
  EXPECT_EQ(core_.counters().landmarks_moving_removed, 1u);
  EXPECT_EQ(core_.counters().evidence_dropped, 1u);
}

TEST_F(KeyframeStep, CullsKeyframesThatSayNothingNew) {
  core_ = MakeCore(0.9);
  ASSERT_TRUE(Start());
  for (uint32_t frame = 2; frame <= 7; ++frame) {
    KeyframeProposal proposal = Frame(frame);  // hardly farther than the one before: all see the same
    ASSERT_EQ(core_.OnKeyframe(proposal), KeyframeOutcome::kInserted);
  }
  EXPECT_GT(core_.counters().keyframes_culled, 0u);
  EXPECT_NE(core_.map().FindKeyframe(Id(0)), nullptr);
  EXPECT_TRUE(core_.map().HasKnown(Id(2)));
}

TEST_F(KeyframeStep, AnInterruptedStepStillInsertsAndCreates) {
  ASSERT_TRUE(Start());
  core_.SetInterrupt([] { return true; });
  const size_t before = said_.size();
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  EXPECT_EQ(EventsSince(before), (std::vector<MapEvent>{MapEvent::kKeyframeInserted,
                                                        MapEvent::kLandmarksCreated, MapEvent::kMapped}));
  EXPECT_EQ(core_.counters().adjustments_interrupted, 1u);
}

TEST_F(KeyframeStep, TheAdjustmentOfWholeMapsStopsWhenItIsAskedTo) {
  ASSERT_TRUE(Start());
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  int asked = 0;
  core_.SetInterrupt([] { return true; });  // a keyframe that waits does not cut it short
  core_.SetStop([&] { return ++asked > 1; });
  const size_t before = said_.size();
  core_.OnAdjustRequest({.request = 3, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 0});
  EXPECT_EQ(asked, 2) << "before the map, and after the first evaluation";
  EXPECT_EQ(EventsSince(before), (std::vector<MapEvent>{MapEvent::kMapAdjusted, MapEvent::kRequestDone}))
      << "what was reached is said, and the request is answered";
}

TEST_F(KeyframeStep, OneThatComesTwiceIsDoneOnce) {
  ASSERT_TRUE(Start());
  const KeyframeProposal proposal = Frame(2);
  ASSERT_EQ(core_.OnKeyframe(proposal), KeyframeOutcome::kInserted);
  const size_t before = said_.size();
  EXPECT_EQ(core_.OnKeyframe(proposal), KeyframeOutcome::kRepeated);
  EXPECT_EQ(said_.size(), before);
  EXPECT_EQ(core_.counters().keyframes_inserted, 1u);
  EXPECT_EQ(core_.counters().keyframes_refused, 0u);
}

TEST_F(KeyframeStep, OneThatIsRefusedIsAnsweredWithTheReason) {
  ASSERT_TRUE(Start());
  KeyframeProposal proposal = Frame(2);
  proposal.reference = Id(77);
  const KeyframeOutcome outcome = core_.OnKeyframe(proposal);
  EXPECT_EQ(outcome, KeyframeOutcome::kRefused);
  core_.Settle(proposal.id, proposal.map_id, WhyRefused(outcome));
  EXPECT_EQ(said_.back().event, MapEvent::kSettled);
  EXPECT_NE(said_.back().note.find("its reference is unknown"), std::string::npos);
  core_.Settle(Id(1), 1, WhyRefused(KeyframeOutcome::kInserted));
  EXPECT_EQ(said_.back().note, "");
}

TEST_F(KeyframeStep, AMapperThatContinuesDoesTheFirstOneAgain) {
  ASSERT_TRUE(Start());
  const KeyframeProposal proposal = Frame(2);
  ASSERT_EQ(core_.OnKeyframe(proposal), KeyframeOutcome::kInserted);
  std::vector<MapDelta> said;
  MapperCore next(MapperOptions(), TestCamera(), Pyramid(), 1,
                  [&](const MapDelta& delta) { said.push_back(delta); });
  next.Continue(Map(core_.map()));
  EXPECT_EQ(next.OnKeyframe(proposal), KeyframeOutcome::kInserted)
      << "its mapper may have ended in the middle of it";
  EXPECT_EQ(said.back().event, MapEvent::kMapped);
  EXPECT_EQ(next.OnKeyframe(proposal), KeyframeOutcome::kRepeated) << "and once is enough";
}

TEST_F(KeyframeStep, AMapperThatContinuesNumbersItsLandmarksAnew) {
  ASSERT_TRUE(Start());
  MapperCore next(MapperOptions(), TestCamera(), Pyramid(), 1, [](const MapDelta&) {});
  next.Continue(Map(core_.map()));
  ASSERT_EQ(next.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  EXPECT_EQ(next.map().HighestOrdinal(), 2);
  for (const LandmarkId id : core_.map().LandmarkIdsSorted()) EXPECT_EQ(id.epoch_ordinal(), 1);
}

TEST_F(KeyframeStep, TwoThatContinueTheSameMapNumberTheirLandmarksDifferently) {
  ASSERT_TRUE(Start());
  const auto ordinal = [&](uint64_t successor) {
    MapperCore next(MapperOptions(), TestCamera(), Pyramid(), 1, [](const MapDelta&) {});
    next.Continue(Map(core_.map()), successor);
    next.OnKeyframe(Frame(2));
    return next.map().HighestOrdinal();
  };
  EXPECT_NE(ordinal(4'611'686'018'427'387'905), ordinal(2'305'843'009'213'693'955));
  EXPECT_GE(ordinal(4'611'686'018'427'387'905), 2);
}

TEST_F(KeyframeStep, AFirstMapThatDoesNotHoldIsDroppedWithARecord) {
  InitialMap proposal = FirstMap();
  proposal.points.resize(20);
  EXPECT_FALSE(core_.OnInitialMap(proposal));
  EXPECT_EQ(said_.back().event, MapEvent::kFirstMapRefused);
  EXPECT_EQ(said_.back().about, proposal.second.id);
  EXPECT_EQ(said_.back().dropped_maps, std::vector<MapId>{1});
  EXPECT_TRUE(core_.map().keyframes().empty());
  EXPECT_EQ(core_.counters().maps_refused, 1u);
}

TEST_F(KeyframeStep, AFirstMapOfANumberThatIsTakenChangesNothing) {
  ASSERT_TRUE(Start());
  const size_t landmarks = core_.map().num_landmarks();
  InitialMap other = FirstMap();
  other.first = scene_.Propose(5, PlaceOf(5), 5, PlaceOf(5), 5);
  other.second = scene_.Propose(6, PlaceOf(6), 5, PlaceOf(5), 6);
  EXPECT_FALSE(core_.OnInitialMap(other));
  EXPECT_EQ(said_.back().event, MapEvent::kFirstMapRefused) << "it is told, though nothing has changed";
  EXPECT_EQ(said_.back().about, other.second.id);
  InitialMap again = FirstMap();
  again.second = scene_.Propose(6, PlaceOf(6), 0, PlaceOf(0), 6);
  EXPECT_FALSE(core_.OnInitialMap(again)) << "its first keyframe is known";
  EXPECT_EQ(core_.counters().maps_refused, 2u);
  EXPECT_EQ(core_.map().KeyframesOf(1).size(), 2u);
  EXPECT_EQ(core_.map().num_landmarks(), landmarks);
}

TEST_F(KeyframeStep, TheEndLeavesASavedMapToWhichNothingHasComeAsItIs) {
  ASSERT_TRUE(Start());
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  const KeyframeProposal third = Frame(3);
  const AdjustRequest at_the_end{.request = 3, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 0};
  for (const bool comes : {false, true}) {
    std::vector<MapEvent> events;
    MapperCore next(MapperOptions(), TestCamera(), Pyramid(), 1,
                    [&](const MapDelta& delta) { events.push_back(delta.event); });
    next.ContinueSaved(Map(core_.map()));
    ASSERT_TRUE(!comes || next.OnKeyframe(third) == KeyframeOutcome::kInserted);
    events.clear();
    next.OnAdjustRequest(at_the_end);
    const bool adjusts = std::ranges::find(events, MapEvent::kMapAdjusted) != events.end();
    EXPECT_EQ(adjusts, comes);
    EXPECT_EQ(events.back(), MapEvent::kRequestDone);
  }
}

TEST_F(KeyframeStep, TheEndAdjustsOnce) {
  ASSERT_TRUE(Start());
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  const size_t before = said_.size();
  core_.OnAdjustRequest({.request = 3, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 0});
  EXPECT_EQ(EventsSince(before), (std::vector<MapEvent>{MapEvent::kMapAdjusted, MapEvent::kRequestDone}));
  EXPECT_EQ(said_[before].map_id, 1U) << "which map it was is told, and not inferred";
  EXPECT_EQ(said_.back().request, 3U);
  EXPECT_FALSE(said_.back().about.has_value());
  core_.OnAdjustRequest({.request = 4, .reason = "nobody answered", .newest_stamp_ns = {}, .camera_id = 0});
  EXPECT_EQ(said_.back().request, 4U);
  EXPECT_EQ(said_.back().progress.camera, 0U);
  core_.AnswerRequest({.request = 4, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 1});
  EXPECT_EQ(said_.back().progress.camera, 1U) << "each camera counts its own requests";
  EXPECT_EQ(said_.size(), before + 4) << "they are adjusted already";
  core_.End();
  EXPECT_EQ(said_.back().event, MapEvent::kEnded);
  EXPECT_TRUE(said_.back().progress.ended);
  EXPECT_EQ(said_.size(), before + 5);
}

TEST_F(KeyframeStep, SaysOnceMoreWhatALoopCloserHasNotHeard) {
  ASSERT_TRUE(Start());
  ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
  const uint64_t version = core_.map().version();
  core_.AskAgain(Id(2), 1);
  EXPECT_EQ(said_.back().event, MapEvent::kMapped);
  EXPECT_EQ(said_.back().about, Id(2));
  EXPECT_EQ(said_.back().map_id, 1u);
  EXPECT_TRUE(said_.back().Empty()) << "nothing of the map changes by that";
  EXPECT_GT(said_.back().version, version);
}

TEST_F(KeyframeStep, AnswersARequestByItsNumberAndNothingElse) {
  ASSERT_TRUE(Start());
  core_.AnswerRequest({.request = 7, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 0});
  EXPECT_EQ(said_.back().event, MapEvent::kRequestDone);
  EXPECT_EQ(said_.back().request, 7u);
  EXPECT_FALSE(said_.back().about.has_value());
  EXPECT_FALSE(said_.back().map_id.has_value());
  EXPECT_TRUE(said_.back().Empty());
}

/// In which of the frames 1 to 5 the end has moved a keyframe.
class TheEnd : public KeyframeStep {
 protected:
  std::vector<uint32_t> MovedWith(int final_adjustment_keyframes) {
    MapperOptions options;
    options.redundant_share = 2.0;
    options.local_keyframes = 2;
    options.final_adjustment_keyframes = final_adjustment_keyframes;
    core_ = MapperCore(options, TestCamera(), Pyramid(), 1, [](const MapDelta&) {});
    EXPECT_TRUE(core_.OnInitialMap(FirstMap()));
    for (const uint32_t frame : {2u, 3u, 4u, 5u})
      EXPECT_EQ(core_.OnKeyframe(Frame(frame, 0.02)), KeyframeOutcome::kInserted);
    const Map before = core_.map();
    core_.OnAdjustRequest({.request = 3, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 0});
    std::vector<uint32_t> moved;
    for (const uint32_t frame : {1u, 2u, 3u, 4u, 5u}) {
      const Rigid3d& was = before.At(Id(frame)).T_cam_world;
      const Rigid3d& is = core_.map().At(Id(frame)).T_cam_world;
      if (was.translation != is.translation) moved.push_back(frame);
    }
    return moved;
  }
};

TEST_F(TheEnd, AMapIsAdjustedAsAWhole) { EXPECT_EQ(MovedWith(6), (std::vector<uint32_t>{1, 2, 3, 4, 5})); }

TEST_F(TheEnd, OfALargeMapOnlyTheNewestKeyframesMove) {
  EXPECT_EQ(MovedWith(2), (std::vector<uint32_t>{4, 5}));
}

/// What comes after an answered request to adjust all maps is adjusted by the next one, and by the end.
class AfterARequest : public KeyframeStep {
 protected:
  void StartAndAdjust() {
    ASSERT_TRUE(Start());
    ASSERT_EQ(core_.OnKeyframe(Frame(2)), KeyframeOutcome::kInserted);
    core_.OnAdjustRequest(Request());
    ASSERT_FALSE(AdjustedBy([this] { core_.OnAdjustRequest(Request()); })) << "once is enough";
  }
  static AdjustRequest Request() {
    return {.request = 3, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 0};
  }
  /// A first map of other frames, beside the one that there is.
  InitialMap AnotherMap() const {
    InitialMap proposal = FirstMap();
    proposal.map_id = 2;
    proposal.first = scene_.Propose(5, PlaceOf(0), 5, PlaceOf(0), 5);
    proposal.second = scene_.Propose(6, PlaceOf(1), 5, PlaceOf(0), 6);
    return proposal;
  }
  bool AdjustedBy(const std::function<void()>& ask) const {
    const size_t before = said_.size();
    ask();
    const std::vector<MapEvent> events = EventsSince(before);
    return std::ranges::find(events, MapEvent::kMapAdjusted) != events.end();
  }
};

TEST_F(AfterARequest, AFirstMapIsAdjusted) {
  StartAndAdjust();
  ASSERT_TRUE(core_.OnInitialMap(AnotherMap()));
  EXPECT_TRUE(AdjustedBy([this] { core_.OnAdjustRequest(Request()); }));
  EXPECT_FALSE(AdjustedBy([this] { core_.End(); })) << "once is enough";
}

TEST_F(AfterARequest, WhatACorrectionMovedIsAdjusted) {
  StartAndAdjust();
  core_.OnLoopAnswer(OneUp(core_.map().version()));
  EXPECT_TRUE(AdjustedBy([this] { core_.OnAdjustRequest(Request()); }));
  LoopAnswer loop = OneUp(core_.map().version(), 8);
  loop.kind = LoopAnswer::Kind::kLoop;
  loop.seen_from = Id(2);
  loop.matched = Id(1);
  core_.OnLoopAnswer(loop);
  ASSERT_EQ(core_.counters().corrections_applied, 2u);
  EXPECT_TRUE(AdjustedBy([this] { core_.End(); }));
}

TEST_F(AfterARequest, OneThatIsRefusedChangesNothing) {
  StartAndAdjust();
  core_.OnLoopAnswer(OneUp(core_.map().version() + 1));
  ASSERT_EQ(core_.counters().corrections_refused, 1u);
  EXPECT_FALSE(AdjustedBy([this] { core_.End(); }));
}

}  // namespace
}  // namespace dmslam
