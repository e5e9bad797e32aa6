// The frontend's phases: from no map to tracking, and back.
#include "dmslam/slam/frontend_core.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include "dmslam/map/testing/map_scene.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;

/// A frontend whose search finds a first map when it is told to; the test is the mapper.
class Phases : public ::testing::Test {
 protected:
  static constexpr size_t kPoints = 300;

  /// `change`: what is different about the frontend.
  explicit Phases(const std::function<void(FrontendCore::Setup&)>& change = {}) {
    scene_.AddCloud(kPoints, {0, 0, 4}, {1.6, 1.2, 0.5});
    strange_.AddCloud(kPoints, {0, 0, 4}, {1.6, 1.2, 0.5});
    setup_.camera = TestCamera();
    setup_.extractor.num_features = 1000;  // of which a lit frame has a tenth
    setup_.options.keyframes_at_end = true;
    setup_.run_search = [this](const FirstMapSearch&) {
      return [this](const InitializerFrame& frame) { return Search(frame); };
    };
    if (change) change(setup_);
    core_.emplace(setup_);
  }

  static std::shared_ptr<const Vocabulary> ShippedVocabulary() {
    const char* source = std::getenv("DMSLAM_SOURCE_DIR");
    return std::make_shared<const Vocabulary>(
        LoadOrbVocabulary((source != nullptr ? std::string(source) : ".") + "/data/vocabulary.dmv"));
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
    return Frame(index, index * kFrameNs, blind ? MapScene::Place(nothing) : MapScene::Place());
  }
  /// The camera sways before something that nobody has seen.
  FrontendOutput Strange(uint32_t index) {
    const int64_t stamp_ns = index * kFrameNs;
    const double x = index % 2 == 0 ? 0.0 : 0.3;
    return core_->ProcessFeatures(index, stamp_ns,
                                  strange_.See(index, stamp_ns, MapScene::PoseAt(x)).features->set);
  }
  FrontendOutput Frame(uint32_t index, int64_t stamp_ns, const MapScene::Place& place) {
    const double x = 0.05 * static_cast<double>(stamp_ns) / kFrameNs;
    const TrackedFrame seen = scene_.See(index, stamp_ns, MapScene::PoseAt(x), place);
    return core_->ProcessFeatures(index, stamp_ns, seen.features->set);
  }
  /// Half of the map is hidden: a keyframe would help.
  FrontendOutput HalfHidden(uint32_t index) {
    return Frame(index, index * kFrameNs, [this](size_t point) {
      return point % 2 == 0 ? std::optional(scene_.point(point)) : std::nullopt;
    });
  }
  /// The mapper's answer to a first map of frames 0 and 1.
  void MapArrives() {
    scene_.MapAll(2);
    MapDelta delta = scene_.map().TakeDelta(MapEvent::kMapStarted, KeyframeId::Make(1, 1), 1);
    delta.progress.settled = KeyframeId::Make(1, 1);
    core_->ApplyMapDelta(delta);
  }
  /// A first map, of frames 0 and 1.
  void Propose() {
    Frame(0);
    finds_map_ = true;
    Frame(1);
  }
  /// To a map whose frames are tracked.
  void Start() {
    Propose();
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

  MapScene scene_, strange_{77};
  bool finds_map_ = false;
  std::optional<InitializerFrame> first_;
  FrontendCore::Setup setup_;
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

TEST_F(Phases, ACameraThatTurnsWithoutAMapHasARotationAndNoPose) {
  const auto turned = [](uint32_t frame) { return ExpSo3({0, 0.01 * frame, 0}); };
  for (uint32_t frame = 0; frame < 15; ++frame) {
    const TrackedFrame seen =
        scene_.See(frame, frame * kFrameNs, Rigid3d(turned(frame), Eigen::Vector3d::Zero()),
                   [this](size_t point) { return std::optional<Eigen::Vector3d>(scene_.point(point)); });
    const FrontendOutput output = core_->ProcessFeatures(frame, frame * kFrameNs, seen.features->set);
    EXPECT_FALSE(Find<FramePose>(output)->HasPose());
    const TrackingState expected = frame < 7 ? TrackingState::kNotInitialized : TrackingState::kRotationOnly;
    EXPECT_EQ(Find<FramePose>(output)->state, expected) << frame;
  }
  EXPECT_FALSE(core_->odometry().measured);
  EXPECT_LT(AngleBetween(core_->odometry().T_odom_cam.rotation, turned(14).conjugate()), 0.002);
}

TEST_F(Phases, WithoutAMapThereIsNothingToGoOnIn) {
  core_->Resume();
  EXPECT_EQ(core_->state(), TrackingState::kNotInitialized);
}

/// One that joins a system which has been running: maps are there, and the frontend made none of them.
class Resuming : public Phases {
 protected:
  Resuming() : Phases([](FrontendCore::Setup& setup) { setup.vocabulary = ShippedVocabulary(); }) {}

  /// An empty keyframe of map 7, newer than all others.
  void AddKeyframe(CameraId camera) {
    MapDelta delta;
    KeyframeState& keyframe = delta.keyframes.emplace_back();
    keyframe.id = KeyframeId::Make(1, 40, camera);
    keyframe.camera_id = camera;
    keyframe.map_id = 7;
    keyframe.stamp_ns = 40 * kFrameNs;
    keyframe.features = std::make_shared<const FeatureSet>();
    core_->ApplyMapDelta(delta);
  }
  /// In which it looks for the camera.
  std::optional<MapId> MapAfterResume() {
    core_->Resume();
    EXPECT_EQ(core_->state(), TrackingState::kLost);
    return Find<FramePose>(Frame(50, true))->map_id;
  }
};

TEST_F(Resuming, ItIsLostInTheMapAndFindsItselfInIt) {
  scene_.MapAll(20);
  core_->ApplyMapDelta(scene_.map().TakeDelta(MapEvent::kMapped, KeyframeId::Make(1, 19), 1));
  core_->Resume();
  EXPECT_EQ(core_->state(), TrackingState::kLost);
  uint32_t frame = 20;
  for (bool is_found = false; frame < 40 && !is_found; ++frame) {
    const FrontendOutput output = Frame(frame);
    EXPECT_EQ(Find<InitialMap>(output), nullptr) << "it begins no second map";
    is_found = Find<FramePose>(output)->HasPose();
    EXPECT_EQ(Find<FramePose>(output)->map_id, 1u);
  }
  EXPECT_LT(frame, 40u);
  EXPECT_EQ(core_->state(), TrackingState::kTracking);
}

TEST_F(Resuming, OfSeveralMapsItTakesThatOfItsOwnNewestKeyframe) {
  MapArrives();
  AddKeyframe(1);
  EXPECT_EQ(MapAfterResume(), 1u) << "the newest one is another camera's";
  AddKeyframe(0);
  EXPECT_EQ(MapAfterResume(), 7u);
}

TEST_F(Resuming, OneWithoutAKeyframeTakesTheNewestMap) {
  AddKeyframe(1);
  EXPECT_EQ(MapAfterResume(), 7u);
}

/// Frames 0 to 19 are a frontend's that then dies; another one has the map, and what was remembered.
class Killed : public Phases {
 protected:
  Killed() {
    setup_.remember = [this](const RememberedFrame& frame) {
      remembered_.insert_or_assign(frame.seen.id.frame_index(), frame);
    };
    core_.emplace(setup_);
    Propose();
    finds_map_ = false;
    scene_.MapAll(2);
    map_ = scene_.map().TakeDelta(MapEvent::kMapStarted, KeyframeId::Make(1, 1), 1);
    map_.progress.settled = KeyframeId::Make(1, 1);
    core_->ApplyMapDelta(map_);
    for (uint32_t frame = 2; frame < 20; ++frame) Frame(frame, frame == kBlind);
    core_.emplace(setup_);
    core_->ApplyMapDelta(map_);
    core_->Resume();
  }
  void TakeOver() {
    for (auto next = remembered_.rbegin(); next != remembered_.rend(); ++next) core_->TakeOver(next->second);
  }
  /// Frames that have a pose in the end.
  std::set<uint32_t> Told() {
    std::set<uint32_t> told;
    const auto note = [&](const FrontendOutput& output) {
      for (const FrontendEvent& event : output.events) {
        const auto* pose = std::get_if<FramePose>(&event);
        if (pose != nullptr && pose->HasPose()) told.insert(pose->frame_index);
      }
    };
    while (const auto output = core_->GrowBack()) note(*output);
    core_->RefineRest();
    while (core_->IsRefining()) core_->RefineNext();
    while (core_->WorkAtEnd()) {
    }
    note(core_->Finish());
    return told;
  }

  static constexpr uint32_t kBlind = 10;
  std::map<uint32_t, RememberedFrame> remembered_;
  MapDelta map_;
};

TEST_F(Killed, ItsFramesAreForgottenWhereNobodyRemembersThem) { EXPECT_TRUE(Told().empty()); }

TEST_F(Killed, ItsFramesGetTheirLastPoses) {
  EXPECT_EQ(remembered_.size(), 20u);
  EXPECT_FALSE(remembered_.at(kBlind).pose);
  ASSERT_TRUE(remembered_.at(5).pose);
  EXPECT_GT(remembered_.at(5).seen.matches.size(), 100u);
  TakeOver();
  const std::set<uint32_t> told = Told();
  for (uint32_t frame = 2; frame < 20; ++frame) EXPECT_EQ(told.contains(frame), frame != kBlind) << frame;
}

TEST_F(Killed, WhatHasNoPoseInTheMapIsLookedForAgain) {
  remembered_.at(7).pose->reference = KeyframeId::Make(1, 900);  // of a map that is no more
  TakeOver();
  int looked_for = 0;
  while (core_->GrowBack()) ++looked_for;
  EXPECT_EQ(looked_for, 2) << "that one and the blind one, but not the keyframes";
}

/// One that begins in a map that was saved.
class InSavedMap : public Phases {
 protected:
  explicit InSavedMap(bool localize_only = false)
      : Phases([=](FrontendCore::Setup& setup) {
          setup.vocabulary = ShippedVocabulary();
          setup.in_saved_map = true;
          setup.localize_only = localize_only;
        }) {
    scene_.MapAll(20);
    core_->ApplyMapDelta(scene_.map().TakeDelta(MapEvent::kMapped, KeyframeId::Make(1, 19), 1));
  }

  /// Frames 20 to 119: all is seen, then half of it, then what nobody has seen.
  struct Said {
    int poses = 0, evidence = 0, keyframes = 0, first_maps = 0, resets = 0;
  };
  Said Play() {
    Said said;
    for (uint32_t frame = 20; frame < 120; ++frame) {
      const FrontendOutput output = frame < 40   ? Frame(frame)
                                    : frame < 60 ? HalfHidden(frame)
                                                 : Strange(frame);
      said.poses += Find<FramePose>(output)->HasPose() ? 1 : 0;
      said.evidence += Find<FrameEvidence>(output) != nullptr ? 1 : 0;
      said.keyframes += Find<KeyframeProposal>(output) != nullptr ? 1 : 0;
      said.first_maps += Find<InitialMap>(output) != nullptr ? 1 : 0;
      said.resets += Find<MapReset>(output) != nullptr ? 1 : 0;
    }
    return said;
  }
};

TEST_F(InSavedMap, ItIsLostFromTheBeginning) { EXPECT_EQ(core_->state(), TrackingState::kLost); }

TEST_F(InSavedMap, ItFindsItselfThereAndGoesOnWithIt) {
  const Said said = Play();
  EXPECT_GT(said.poses, 20);
  EXPECT_GT(said.evidence, 0);
  EXPECT_GT(said.keyframes, 0);
  EXPECT_EQ(said.resets, 1) << "lost for long, it looks for another map";
}

class LocalizingOnly : public InSavedMap {
 protected:
  LocalizingOnly() : InSavedMap(true) {}
};

TEST_F(LocalizingOnly, ItFindsItselfThereAndAddsNothing) {
  finds_map_ = true;
  const Said said = Play();
  EXPECT_GT(said.poses, 20);
  EXPECT_EQ(said.evidence + said.keyframes + said.first_maps + said.resets, 0);
  EXPECT_FALSE(core_->GrowBack()) << "nor when the sequence has ended";
}

TEST_F(Phases, AProposalThatTheMapperRefusesIsGivenUp) {
  Propose();
  MapDelta refused;
  refused.event = MapEvent::kFirstMapRefused;
  refused.about = KeyframeId::Make(1, 7);
  core_->ApplyMapDelta(refused);
  EXPECT_EQ(Find<MapReset>(Frame(2)), nullptr) << "another one";
  refused.about = KeyframeId::Make(1, 1);
  core_->ApplyMapDelta(refused);
  const FrontendOutput output = Frame(3);
  const auto* reset = Find<MapReset>(output);
  ASSERT_NE(reset, nullptr);
  EXPECT_EQ(reset->fate, MapReset::Fate::kDrop);
  EXPECT_EQ(core_->state(), TrackingState::kNotInitialized);
}

TEST_F(Phases, AMapWhoseNumberTheProposalTookStays) {
  Propose();
  MapDelta refused;
  refused.keyframes.resize(1);  // of a map of this number that has been there before
  refused.keyframes[0].id = KeyframeId::Make(1, 40);
  refused.keyframes[0].map_id = 1;
  refused.keyframes[0].features = std::make_shared<const FeatureSet>();
  refused.event = MapEvent::kFirstMapRefused;
  refused.about = KeyframeId::Make(1, 1);
  core_->ApplyMapDelta(refused);
  const FrontendOutput output = Frame(2);
  const auto* reset = Find<MapReset>(output);
  ASSERT_NE(reset, nullptr);
  EXPECT_EQ(reset->fate, MapReset::Fate::kKeep);
}

TEST_F(Phases, AProposalThatWasSettledWithoutAMapIsGivenUp) {
  Propose();
  MapDelta settled;
  settled.progress.settled = KeyframeId::Make(1, 1);
  core_->ApplyMapDelta(settled);
  const FrontendOutput output = Frame(2);
  const auto* reset = Find<MapReset>(output);
  ASSERT_NE(reset, nullptr);
  EXPECT_EQ(reset->fate, MapReset::Fate::kDrop);
  EXPECT_EQ(reset->map_id, 1u);
  EXPECT_EQ(core_->state(), TrackingState::kNotInitialized);
  EXPECT_FALSE(core_->awaited());
}

TEST_F(Phases, TheTrialEndsInTracking) {
  Start();
  for (uint32_t frame = 2; frame < 45; ++frame) {
    const FrontendOutput output = Frame(frame);
    ASSERT_EQ(Find<MapReset>(output), nullptr) << frame << ": " << Find<MapReset>(output)->reason;
    EXPECT_EQ(core_->state(), frame < 32 ? TrackingState::kTrial : TrackingState::kTracking) << frame;
  }
  EXPECT_GT(core_->counters().tracked, 40u);
}

TEST_F(Phases, ATrialThatIsContradictedDropsTheMapAndBeginsAnew) {
  Start();
  Frame(2);
  ASSERT_EQ(core_->state(), TrackingState::kTrial);
  // Each point lies some pixels beside the place that the map gives it, in a direction of its own.
  const FrontendOutput output = Frame(3, 3 * kFrameNs, [this](size_t point) {
    const double turn = 2.4 * static_cast<double>(point);
    return std::optional<Eigen::Vector3d>(scene_.point(point) +
                                          0.06 * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0));
  });
  const auto* reset = Find<MapReset>(output);
  ASSERT_NE(reset, nullptr);
  EXPECT_EQ(reset->fate, MapReset::Fate::kDrop);
  EXPECT_EQ(Find<FramePose>(output)->map_id, 2u) << "a number that no map has had";
}

TEST_F(Phases, ATrialDuringWhichTheMapIsHiddenKeepsIt) {
  Start();
  Frame(2);
  ASSERT_EQ(core_->state(), TrackingState::kTrial);
  const FrontendOutput hidden = Frame(3, true);
  EXPECT_EQ(Find<MapReset>(hidden), nullptr);
  EXPECT_FALSE(Find<FramePose>(hidden)->HasPose());
  EXPECT_EQ(core_->state(), TrackingState::kMissing);
  EXPECT_TRUE(Find<FramePose>(Frame(4))->HasPose());
  EXPECT_EQ(core_->state(), TrackingState::kTracking);
}

TEST_F(Phases, InDarknessItIsLostHoweverLong) {
  Start();
  for (uint32_t frame = 2; frame < 30; ++frame) Frame(frame);
  for (uint32_t frame = 30; frame < 900; ++frame)
    ASSERT_EQ(Find<MapReset>(Frame(frame, true)), nullptr) << frame;
  EXPECT_EQ(core_->state(), TrackingState::kLost);
  EXPECT_EQ(Find<MapReset>(Strange(900)), nullptr) << "the light has just come back";
}

TEST_F(Phases, LostForLongInTheLightItKeepsTheMapAndLooksForAnother) {
  Start();
  for (uint32_t frame = 2; frame < 45; ++frame) Frame(frame);
  ASSERT_EQ(core_->state(), TrackingState::kTracking);
  bool was_missing = false, was_lost = false;
  std::optional<MapReset> reset;
  uint32_t frame = 45;
  for (; frame < 300 && !reset; ++frame) {
    const FrontendOutput output = Strange(frame);
    if (const auto* found = Find<MapReset>(output)) reset = *found;
    was_missing = was_missing || core_->state() == TrackingState::kMissing;
    was_lost = was_lost || core_->state() == TrackingState::kLost;
  }
  ASSERT_TRUE(reset);
  EXPECT_EQ(reset->fate, MapReset::Fate::kKeep);
  EXPECT_TRUE(was_missing && was_lost);
  EXPECT_NEAR((frame - 45) / 30.0, FrontendOptions().new_map_after_s, 0.1) << "seconds";
  EXPECT_EQ(core_->state(), TrackingState::kLost) << "it may be in the old map all the same";
}

TEST_F(Phases, WhereItsMapBecomesPartOfAnotherItGoesOnThere) {
  Start();
  for (uint32_t frame = 2; frame < 30; ++frame) Frame(frame);
  for (const auto& [id, keyframe] : scene_.map().keyframes()) scene_.map().SetMapId(keyframe, 7);
  for (size_t i = 0; i < kPoints; ++i) scene_.map().SetMapId(scene_.map().At(MapScene::IdOf(i)), 7);
  MapDelta joined = scene_.map().TakeDelta(MapEvent::kCorrected, KeyframeId::Make(1, 1), 7);
  if (core_->awaited()) joined.progress.settled = core_->awaited();
  core_->ApplyMapDelta(joined);
  std::optional<KeyframeProposal> proposal;
  for (uint32_t frame = 30; frame < 60; ++frame) {
    const FrontendOutput output = HalfHidden(frame);
    EXPECT_EQ(Find<FramePose>(output)->map_id, 7u) << frame;
    if (const auto* found = Find<KeyframeProposal>(output)) proposal = *found;
  }
  ASSERT_TRUE(proposal);
  EXPECT_EQ(proposal->map_id, 7u);
}

TEST_F(Phases, AKeyframeComesBehindItsEvidenceAndOneAtATime) {
  Start();
  const KeyframeProposal* proposal = nullptr;
  FrontendOutput output;
  uint32_t frame = 2;
  for (; frame < 30 && proposal == nullptr; ++frame) {
    output = HalfHidden(frame);
    proposal = Find<KeyframeProposal>(output);
  }
  ASSERT_NE(proposal, nullptr);
  ASSERT_GE(output.events.size(), 3u);
  const size_t last = output.events.size() - 1;
  EXPECT_TRUE(std::holds_alternative<FrameEvidence>(output.events[last - 2]));
  EXPECT_TRUE(std::holds_alternative<KeyframeProposal>(output.events[last - 1]));
  EXPECT_TRUE(std::holds_alternative<FramePose>(output.events[last])) << "the pose is the last word";
  EXPECT_EQ(proposal->id, KeyframeId::Make(1, frame - 1));
  EXPECT_GT(proposal->matches.size(), kPoints / 3);
  EXPECT_EQ(core_->awaited(), proposal->id);

  const KeyframeId awaited = proposal->id;
  for (const uint32_t end = frame + 20; frame < end; ++frame)
    EXPECT_EQ(Find<KeyframeProposal>(HalfHidden(frame)), nullptr) << "the mapper has not answered";
  EXPECT_GT(core_->counters().keyframes_withheld, 0u);
  MapDelta settled;
  settled.progress.settled = awaited;
  core_->ApplyMapDelta(settled);
  EXPECT_NE(Find<KeyframeProposal>(HalfHidden(frame)), nullptr);
}

/// How often evidence is told in two seconds of a camera with that many frames a second.
class EvidenceRate : public Phases {
 protected:
  int Told(int fps) {
    Start();
    int told = 0;
    for (uint32_t frame = 1; static_cast<int>(frame) <= 2 * fps; ++frame) {
      const int64_t stamp_ns = kFrameNs + frame * int64_t{1'000'000'000} / fps;
      const FrontendOutput output = Frame(1 + frame, stamp_ns, MapScene::Place());
      if (Find<FrameEvidence>(output) && !Find<KeyframeProposal>(output)) ++told;
    }
    return told;
  }
};

TEST_F(EvidenceRate, At30FramesASecond) { EXPECT_NEAR(Told(30), 6, 1); }
TEST_F(EvidenceRate, At60FramesASecond) { EXPECT_NEAR(Told(60), 6, 1); }

class InPortions : public Phases {
 protected:
  InPortions() : Phases([](FrontendCore::Setup& setup) { setup.catch_up_in_portions = true; }) {}
};

TEST_F(InPortions, FramesThatWaitedForTheMapAreTrackedOneByOne) {
  Frame(0);
  finds_map_ = true;
  Frame(1);
  finds_map_ = false;
  for (uint32_t frame = 2; frame < 10; ++frame) Frame(frame);
  EXPECT_FALSE(core_->IsBehind());
  MapArrives();
  EXPECT_FALSE(Find<FramePose>(Frame(10))->HasPose()) << "it waits its turn";
  ASSERT_TRUE(core_->IsBehind());
  EXPECT_NEAR(core_->seconds_behind(), 9 / 30.0, 0.01);
  for (uint32_t frame = 1; frame <= 10; ++frame) {
    ASSERT_TRUE(core_->IsBehind()) << frame;
    const FrontendOutput output = core_->CatchUp();
    ASSERT_NE(Find<FramePose>(output), nullptr);
    EXPECT_EQ(Find<FramePose>(output)->frame_index, frame);
    EXPECT_TRUE(Find<FramePose>(output)->HasPose()) << frame;
  }
  EXPECT_FALSE(core_->IsBehind());
  EXPECT_TRUE(Find<FramePose>(Frame(11))->HasPose());
}

TEST_F(InPortions, FramesThatWaitAreTrackedWhenTheMapHasGrownWithThoseBefore) {
  Frame(0);
  finds_map_ = true;
  Frame(1);
  finds_map_ = false;
  for (uint32_t frame = 2; frame < 40; ++frame) HalfHidden(frame);
  MapArrives();
  HalfHidden(40);
  KeyframeId proposed;
  while (core_->IsBehind() && !proposed.valid()) {
    EXPECT_TRUE(core_->MayCatchUp());
    const FrontendOutput output = core_->CatchUp();
    if (const auto* keyframe = Find<KeyframeProposal>(output)) proposed = keyframe->id;
  }
  ASSERT_TRUE(proposed.valid());
  ASSERT_TRUE(core_->IsBehind());
  EXPECT_FALSE(core_->MayCatchUp());
  MapDelta settled;
  settled.progress.settled = proposed;
  core_->ApplyMapDelta(settled);
  EXPECT_TRUE(core_->MayCatchUp());
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

/// Camera 1 of several; what it finds in the map is camera 0's.
class SecondCamera : public Phases {
 protected:
  SecondCamera() : Phases([](FrontendCore::Setup& setup) { setup.camera_id = 1; }) {}
};

TEST_F(SecondCamera, NumbersItsMapsAndKeyframesApartFromOthers) {
  Frame(0);
  finds_map_ = true;
  const FrontendOutput output = Frame(1);
  const auto* proposal = Find<InitialMap>(output);
  ASSERT_NE(proposal, nullptr);
  EXPECT_EQ(proposal->map_id, kMapsPerCamera + 1);
  EXPECT_EQ(proposal->first.id, KeyframeId::Make(1, 0, 1));
  EXPECT_EQ(proposal->second.id, KeyframeId::Make(1, 1, 1));
  EXPECT_EQ(proposal->second.camera_id, 1u);
  EXPECT_EQ(Find<FramePose>(output)->camera_id, 1u);
}

TEST_F(SecondCamera, AFirstMapOfAnotherDoesNotAnswerItsOwn) {
  Frame(0);
  finds_map_ = true;
  Frame(1);
  finds_map_ = false;
  MapArrives();  // of camera 0, settled and all
  EXPECT_TRUE(core_->awaited());
  EXPECT_EQ(core_->state(), TrackingState::kWaitingForMap);
}

/// The same, and it would find itself in the map of another by what it looks like.
class BesideAnother : public Phases {
 protected:
  BesideAnother()
      : Phases([](FrontendCore::Setup& setup) {
          setup.camera_id = 1;
          setup.vocabulary = ShippedVocabulary();
        }) {}

  /// Of keyframes within a second.
  void AnothersMapArrives() {
    scene_.MapAll(31, 0.01);
    core_->ApplyMapDelta(scene_.map().TakeDelta(MapEvent::kMapped, KeyframeId::Make(1, 30), 1));
  }
  /// Whether a frame has a pose that shows one of `every` points.
  bool IsFound(uint32_t index, size_t every) {
    const FrontendOutput output = Frame(index, index * kFrameNs, [&](size_t point) {
      return point % every == 0 ? std::optional(scene_.point(point)) : std::nullopt;
    });
    return Find<FramePose>(output)->HasPose();
  }
};

TEST_F(BesideAnother, APartOfAYoungMapIsNoPlaceWhileAFirstMapIsLookedFor) {
  AnothersMapArrives();
  for (uint32_t frame = 0; frame < 25; ++frame) EXPECT_FALSE(IsFound(frame, 4)) << frame;
}

TEST_F(BesideAnother, SeenAsAWholeItIsWhenItHasPredicted) {
  AnothersMapArrives();
  uint32_t frame = 0;
  while (frame < 25 && !IsFound(frame, 1)) ++frame;
  EXPECT_NEAR(frame / 30.0, 0.5, 0.1);
}

/// Else they are taken for frames of camera 0, that were elsewhere.
TEST_F(SecondCamera, TellsTheFramesThatArePlacedAtTheEndAsItsOwn) {
  for (uint32_t frame = 0; frame < 20; ++frame) Frame(frame);
  MapScene mapped(3, 1);
  mapped.AddCloud(kPoints, {0, 0, 4}, {1.6, 1.2, 0.5});
  mapped.MapAll(20);
  core_->ApplyMapDelta(mapped.map().TakeDelta(MapEvent::kMapped, KeyframeId::Make(1, 19, 1), 1));
  core_->RefineRest();
  while (core_->WorkAtEnd()) {
  }
  const FrontendOutput output = core_->Finish();
  EXPECT_GE(output.events.size(), 15u);
  for (const FrontendEvent& event : output.events) {
    const auto& pose = std::get<FramePose>(event);
    EXPECT_EQ(pose.camera_id, 1u) << pose.frame_index;
    EXPECT_EQ(pose.state, TrackingState::kLocalizedLater);
    EXPECT_LT((pose.T_cam_world.Center() - Eigen::Vector3d(0.05 * pose.frame_index, 0, 0)).norm(), 0.01);
  }
}

}  // namespace
}  // namespace dmslam
