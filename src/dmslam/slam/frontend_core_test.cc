// The frontend's phases: from no map to tracking, and back.
#include "dmslam/slam/frontend_core.h"

#include <gtest/gtest.h>

#include <optional>

#include "dmslam/map/testing/map_scene.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;

TEST(TrackingPhaseTest, GoesFromSearchToTracking) {
  TrackingPhase phase;
  EXPECT_EQ(phase.state(), TrackingState::kNotInitialized);
  const KeyframeId second = KeyframeId::Make(1, 7);
  phase.Propose(second);
  EXPECT_EQ(phase.state(), TrackingState::kWaitingForMap);
  EXPECT_EQ(phase.awaited_second(), second);
  EXPECT_FALSE(phase.HasMap());
  phase.BeginTrial(1000);
  EXPECT_EQ(phase.state(), TrackingState::kTrial);
  phase.OnTracked(999);
  EXPECT_EQ(phase.state(), TrackingState::kTrial);
  phase.OnTracked(1000);
  EXPECT_EQ(phase.state(), TrackingState::kTracking);
  phase.GiveUpMap();
  EXPECT_TRUE(phase.IsSearching());
}

TEST(TrackingPhaseTest, IsLostAfterAThirdOfASecond) {
  TrackingPhase phase;
  phase.BeginLost();
  phase.OnTracked(0);
  phase.OnMissing(100'000'000);
  EXPECT_EQ(phase.state(), TrackingState::kUncertain);
  phase.OnMissing(340'000'000);
  EXPECT_EQ(phase.state(), TrackingState::kLost);
  phase.OnTracked(0);
  EXPECT_EQ(phase.state(), TrackingState::kTracking);
}

TEST(TrackingPhaseTest, ImpossibleStepsAreRefused) {
  TrackingPhase phase;
  EXPECT_THROW(phase.BeginTrial(0), InvariantError);
  EXPECT_THROW(phase.OnTracked(0), InvariantError);
  phase.Propose(KeyframeId::Make(1, 1));
  EXPECT_THROW(phase.Propose(KeyframeId::Make(1, 2)), InvariantError);
  phase.BeginTrial(1000);
  EXPECT_THROW(phase.OnMissing(1), InvariantError);
}

TEST(KeyframeGateTest, OneAtATime) {
  KeyframeGate gate;
  const KeyframeId id = KeyframeId::Make(1, 50);
  EXPECT_TRUE(gate.IsOpen());
  gate.OnProposed(id, 1000);
  EXPECT_FALSE(gate.IsOpen());
  gate.OnSettled(KeyframeId::Make(1, 40), true);
  EXPECT_FALSE(gate.IsOpen()) << "an older one";
  gate.OnSettled(KeyframeId::Make(1, 60), false);
  EXPECT_FALSE(gate.IsOpen()) << "while the map grows back, newer ones were settled long ago";
  gate.OnSettled(id, false);
  EXPECT_TRUE(gate.IsOpen());
  gate.SetWithheld(true);
  EXPECT_FALSE(gate.IsOpen());
  EXPECT_EQ(gate.SinceNs(400), 600);
}

/// A frontend whose search finds a first map when it is told to; the test is the mapper.
class Phases : public ::testing::Test {
 protected:
  static constexpr size_t kPoints = 300;

  Phases() {
    scene_.AddCloud(kPoints, {0, 0, 4}, {1.6, 1.2, 0.5});
    FrontendCore::Setup setup;
    setup.camera = TestCamera();
    setup.options.keyframes_at_end = true;
    setup.run_search = [this](const FirstMapSearch&) {
      return [this](const InitializerFrame& frame) { return Search(frame); };
    };
    core_.emplace(setup);
  }

  InitializerReport Search(const InitializerFrame& frame) {
    InitializerReport report;
    report.reason = "not yet";
    if (!first_) first_ = frame;
    if (!finds_map_ || frame.index == first_->index) return report;
    report.wait = WaitReason::kNone;
    FirstMap& map = report.result.emplace();
    map.frame0 = *first_;
    map.frame1 = frame;
    map.T_1_0 = MapScene::PoseAt(0.05 * (frame.index - first_->index));
    return report;
  }

  FrontendOutput Frame(uint32_t index, bool blind = false) {
    const auto nothing = [](size_t) { return std::optional<Eigen::Vector3d>(); };
    const TrackedFrame seen = scene_.See(index, index * kFrameNs, MapScene::PoseAt(0.05 * index),
                                         blind ? MapScene::Place(nothing) : MapScene::Place());
    return core_->ProcessFeatures(index, index * kFrameNs, seen.features->set);
  }
  /// The mapper's answer to a first map of frames 0 and 1.
  void MapArrives() {
    scene_.MapAll(2);
    MapDelta delta = scene_.map().TakeDelta(MapEvent::kMapStarted, KeyframeId::Make(1, 1), 1);
    delta.progress.settled = KeyframeId::Make(1, 1);
    core_->ApplyMapDelta(delta);
  }
  /// To a map whose frames are tracked.
  void Start() {
    Frame(0);
    finds_map_ = true;
    Frame(1);
    finds_map_ = false;
    MapArrives();
  }

  template <typename Event>
  static const Event* Find(const FrontendOutput& output) {
    for (const FrontendEvent& event : output.events) {
      if (const auto* found = std::get_if<Event>(&event)) return found;
    }
    return nullptr;
  }

  MapScene scene_;
  bool finds_map_ = false;
  std::optional<InitializerFrame> first_;
  std::optional<FrontendCore> core_;
};

TEST_F(Phases, AFirstMapIsProposedAndAwaited) {
  EXPECT_EQ(Find<FramePose>(Frame(0))->reason, "not yet");
  finds_map_ = true;
  const FrontendOutput output = Frame(1);
  const auto* proposal = Find<InitialMap>(output);
  ASSERT_NE(proposal, nullptr);
  EXPECT_EQ(proposal->second.id, KeyframeId::Make(1, 1));
  EXPECT_EQ(core_->state(), TrackingState::kWaitingForMap);
  EXPECT_EQ(core_->awaited(), proposal->second.id);
  EXPECT_FALSE(Find<FramePose>(Frame(2))->HasPose());
  EXPECT_EQ(core_->state(), TrackingState::kWaitingForMap);
}

TEST_F(Phases, ARefusedProposalIsGivenUp) {
  Frame(0);
  finds_map_ = true;
  Frame(1);
  MapDelta refused;
  refused.progress.settled = KeyframeId::Make(1, 1);
  core_->ApplyMapDelta(refused);
  const FrontendOutput output = Frame(2);
  const auto* reset = Find<MapReset>(output);
  ASSERT_NE(reset, nullptr);
  EXPECT_TRUE(reset->drop);
  EXPECT_EQ(reset->map_id, 1u);
  EXPECT_EQ(core_->state(), TrackingState::kNotInitialized);
  EXPECT_FALSE(core_->awaited().valid());
}

TEST_F(Phases, TheTrialEndsInTracking) {
  Start();
  for (uint32_t frame = 2; frame < 30; ++frame) {
    const FrontendOutput output = Frame(frame);
    ASSERT_EQ(Find<MapReset>(output), nullptr) << frame << ": " << Find<MapReset>(output)->reason;
    EXPECT_EQ(core_->state(), frame < 17 ? TrackingState::kTrial : TrackingState::kTracking) << frame;
  }
  EXPECT_GT(core_->counters().tracked, 25u);
}

TEST_F(Phases, ATrialThatFailsDropsTheMapAndBeginsAnew) {
  Start();
  Frame(2);
  ASSERT_EQ(core_->state(), TrackingState::kTrial);
  const FrontendOutput output = Frame(3, true);
  const auto* reset = Find<MapReset>(output);
  ASSERT_NE(reset, nullptr);
  EXPECT_TRUE(reset->drop);
  EXPECT_EQ(core_->state(), TrackingState::kNotInitialized);
  EXPECT_EQ(Find<FramePose>(output)->map_id, 2u) << "a number that no map has had";
}

TEST_F(Phases, LostForLongItKeepsTheMapAndBeginsAnother) {
  Start();
  for (uint32_t frame = 2; frame < 30; ++frame) Frame(frame);
  ASSERT_EQ(core_->state(), TrackingState::kTracking);
  bool was_uncertain = false, was_lost = false;
  std::optional<MapReset> reset;
  uint32_t frame = 30;
  for (; frame < 300 && !reset; ++frame) {
    const FrontendOutput output = Frame(frame, true);
    if (const auto* found = Find<MapReset>(output)) reset = *found;
    was_uncertain = was_uncertain || core_->state() == TrackingState::kUncertain;
    was_lost = was_lost || core_->state() == TrackingState::kLost;
  }
  ASSERT_TRUE(reset);
  EXPECT_FALSE(reset->drop);
  EXPECT_TRUE(was_uncertain && was_lost);
  EXPECT_NEAR((frame - 30) / 30.0, 5.0, 0.1) << "seconds";
}

TEST_F(Phases, AMapThatVanishesIsGivenUp) {
  Start();
  Frame(2);
  core_->ForgetMap();
  const FrontendOutput output = Frame(3);
  ASSERT_NE(Find<MapReset>(output), nullptr);
  EXPECT_EQ(core_->state(), TrackingState::kNotInitialized);
}

TEST_F(Phases, FramesBeforeTheMapArePlacedWhenTheSequenceHasEnded) {
  Start();
  for (uint32_t frame = 2; frame < 20; ++frame) Frame(frame);
  int portions = 0;
  while (core_->GrowBack()) ++portions;
  EXPECT_EQ(portions, 1) << "frame 0: the others were tracked";
  core_->RefineRest();
  while (core_->IsRefining()) core_->RefineNext();
  while (core_->WorkAtEnd()) {
  }
  const FrontendOutput output = core_->Finish();
  EXPECT_EQ(output.events.size(), 20u);
  for (const FrontendEvent& event : output.events) {
    const auto& pose = std::get<FramePose>(event);
    EXPECT_TRUE(pose.HasPose());
    EXPECT_LT((pose.T_cam_world.Center() - Eigen::Vector3d(0.05 * pose.frame_index, 0, 0)).norm(), 0.01);
  }
}

}  // namespace
}  // namespace dmslam
