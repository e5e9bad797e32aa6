// What a frontend does when no frame follows, step by step and in one go.
#include "dmslam/slam/sequence_end.h"

#include <gtest/gtest.h>

#include <optional>
#include <variant>

#include "dmslam/map/testing/map_scene.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using Phase = SequenceEnd::Phase;
using testing::MapScene;

constexpr int64_t kSecond = 1'000'000'000;
constexpr int64_t kFrameNs = 33'333'333;
constexpr uint32_t kFrames = 20;
constexpr CameraId kCamera = 3;
constexpr int64_t kEpoch = 1'000'000;

/// A frontend that has seen a sequence without finding a first map, and may be given one.
class SequenceEndTest : public ::testing::Test {
 protected:
  SequenceEndTest() : core_(CoreSetup()) {
    scene_.AddCloud(700, {0, 0, 4}, {1.6, 1.2, 0.5});
    const auto all = [this](size_t point) { return std::optional(scene_.point(point)); };
    for (uint32_t frame = 0; frame < kFrames; ++frame) {
      const TrackedFrame seen = scene_.See(frame, frame * kFrameNs, MapScene::PoseAt(0.05 * frame), all);
      core_.ProcessFeatures(frame, frame * kFrameNs, seen.features->set);
    }
  }

  static FrontendCore::Setup CoreSetup() {
    FrontendCore::Setup setup;
    setup.camera = TestCamera();
    setup.extractor.num_features = 1000;  // of which a lit frame has a tenth
    setup.seed = 1;
    setup.run_search = [](FirstMapSearch) {
      return [](const InitializerFrame&) { return InitializerReport(); };
    };
    return setup;
  }

  void MapArrives() {
    scene_.MapAll(kFrames);
    core_.ApplyMapDelta(
        scene_.map().TakeDelta(MapEvent::kMapped, KeyframeId::Make(MapScene::kSession, kFrames - 1), 1));
  }

  /// Until the phase is done.
  SequenceEnd::Worked WorkOn(SequenceEnd* end) {
    const Phase phase = end->phase();
    SequenceEnd::Worked worked;
    while (end->Is(phase)) {
      worked = SequenceEnd::Work(phase, &core_);
      end->OnWorked(worked.is_done);
    }
    return worked;
  }

  MapScene scene_;
  FrontendCore core_;
};

TEST_F(SequenceEndTest, GoesStepByStep) {
  SequenceEnd end(true, kCamera);
  EXPECT_THROW(end.OnWorked(true), InvariantError) << "frames may come";
  EXPECT_THROW(SequenceEnd::Work(end.phase(), &core_), InvariantError);
  end.OnEndHeard();
  end.OnEndHeard();  // the player repeats it
  EXPECT_TRUE(end.Is(Phase::kGrowingBack));
  EXPECT_FALSE(end.AppliesAllRecords());
  WorkOn(&end);
  EXPECT_TRUE(end.Is(Phase::kAwaitingAdjustedMap));
  EXPECT_FALSE(end.Ask(core_.map(), 0, std::nullopt, kEpoch)) << "there is no map";
  EXPECT_FALSE(end.Waits(core_));
  WorkOn(&end);
  EXPECT_TRUE(end.Is(Phase::kRefining));
  EXPECT_THROW(end.OnTold(), InvariantError) << "nothing is known yet";
  WorkOn(&end);
  EXPECT_TRUE(end.Is(Phase::kJoining));
  EXPECT_TRUE(WorkOn(&end).output.events.empty());
  EXPECT_TRUE(end.Is(Phase::kTelling));
  EXPECT_THROW(end.OnWorked(true), InvariantError);
  end.OnTold();
  EXPECT_TRUE(end.Is(Phase::kDone));
  EXPECT_TRUE(end.AppliesAllRecords());
}

TEST_F(SequenceEndTest, AMapperThatDoesNotAnswerIsAskedAgain) {
  MapArrives();
  SequenceEnd end(true, kCamera);
  end.OnEndHeard();
  end.OnAnswer({kCamera, kEpoch, 0});
  EXPECT_FALSE(end.Ask(core_.map(), 0, 7, kEpoch)) << "the map may still grow";
  end.OnWorked(true);
  EXPECT_TRUE(end.Waits(core_)) << "nobody had asked";
  const auto request = end.Ask(core_.map(), kSecond, 7, kEpoch);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->request, 1u);
  EXPECT_EQ(request->newest_stamp_ns, 7);
  EXPECT_EQ(request->camera_id, kCamera);
  EXPECT_TRUE(end.AppliesAllRecords());
  EXPECT_FALSE(end.Ask(core_.map(), 2 * kSecond, 7, kEpoch));
  EXPECT_EQ(end.Ask(core_.map(), 12 * kSecond, 7, kEpoch)->request, 2u);
  end.OnAnswer({kCamera, kEpoch, 1});
  end.OnAnswer({kCamera, kEpoch, 3});
  end.OnAnswer({kCamera + 1, kEpoch, 2});
  EXPECT_TRUE(end.Waits(core_)) << "another question was answered";
  end.OnAnswer({kCamera, kEpoch, 2});
  EXPECT_FALSE(end.Waits(core_));
  EXPECT_FALSE(end.Ask(core_.map(), 30 * kSecond, 7, kEpoch));
}

TEST_F(SequenceEndTest, AnAnswerToTheFrontendBeforeIsNone) {
  MapArrives();
  SequenceEnd end(true, kCamera);
  end.OnEndHeard();
  end.OnWorked(true);
  ASSERT_EQ(end.Ask(core_.map(), 0, 7, kEpoch)->request, 1u);
  end.OnAnswer({kCamera, kEpoch - 1, 1});
  EXPECT_TRUE(end.Waits(core_)) << "that one had counted from 1 as well";
  end.OnAnswer({kCamera, kEpoch, 1});
  EXPECT_FALSE(end.Waits(core_));
}

TEST_F(SequenceEndTest, WithoutAMapperNothingGrowsAndNobodyIsAsked) {
  MapArrives();
  SequenceEnd end(false, kCamera);
  end.OnEndHeard();
  EXPECT_TRUE(end.Is(Phase::kAwaitingAdjustedMap));
  EXPECT_FALSE(end.Ask(core_.map(), 0, 7, kEpoch));
  EXPECT_FALSE(end.Waits(core_));
}

TEST_F(SequenceEndTest, WhoHandsOverTellsThePosesOfItsFramesInTheMapAsItIs) {
  MapArrives();
  SequenceEnd end(true, kCamera);
  end.OnHandOver();
  EXPECT_TRUE(end.HandsOver());
  EXPECT_FALSE(end.Ask(core_.map(), 0, 7, kEpoch)) << "the mapper has other things to do";
  EXPECT_FALSE(end.Waits(core_));
  WorkOn(&end);
  WorkOn(&end);
  end.OnHandOver();
  EXPECT_TRUE(end.Is(Phase::kJoining)) << "it is asked for again, and nothing begins anew";
  EXPECT_EQ(WorkOn(&end).output.events.size(), kFrames);
  end.OnTold();
  EXPECT_TRUE(end.Is(Phase::kHandedOver)) << "the sequence is not over";
}

TEST_F(SequenceEndTest, WhoIsAskedWhileItRefinesLeavesTheEndToTheNextOne) {
  SequenceEnd end(true, kCamera);
  end.OnEndHeard();
  WorkOn(&end);
  WorkOn(&end);
  ASSERT_TRUE(end.Is(Phase::kRefining));
  end.OnHandOver();
  EXPECT_TRUE(end.Is(Phase::kRefining)) << "nothing is done twice";
  WorkOn(&end);
  WorkOn(&end);
  end.OnTold();
  EXPECT_TRUE(end.Is(Phase::kHandedOver));
}

TEST_F(SequenceEndTest, WhoIsDoneHasNothingToHandOver) {
  SequenceEnd end(true, kCamera);
  end.OnMapEnded();
  end.OnHandOver();
  EXPECT_FALSE(end.HandsOver());
  EXPECT_TRUE(end.Is(Phase::kDone));
}

TEST_F(SequenceEndTest, AMapThatEndsMeanwhileLeavesNothingToHandOver) {
  MapArrives();
  SequenceEnd end(true, kCamera);
  end.OnHandOver();
  ASSERT_TRUE(end.HandsOver());
  end.OnMapEnded();
  EXPECT_FALSE(end.HandsOver());
  EXPECT_TRUE(end.Is(Phase::kDone));
}

TEST_F(SequenceEndTest, InOneGoItTellsTheLastPosesInTheAdjustedMap) {
  MapArrives();
  int requests = 0;
  size_t poses = 0, poses_before = 0;
  const auto tell = [&](const FrontendOutput& output) {
    for (const FrontendEvent& event : output.events) {
      if (const auto* keyframe = std::get_if<KeyframeProposal>(&event)) {
        MapDelta settled;
        settled.progress.settled = keyframe->id;
        core_.ApplyMapDelta(settled);
      }
      poses += std::holds_alternative<FramePose>(event) ? 1 : 0;
    }
  };
  const auto adjust = [&](const AdjustRequest& request) {
    EXPECT_EQ(request.newest_stamp_ns, (kFrames - 1) * kFrameNs);
    ++requests;
    poses_before = poses;
  };
  FinishSequence(&core_, (kFrames - 1) * kFrameNs, {tell, adjust});
  EXPECT_EQ(requests, 1);
  EXPECT_EQ(poses_before, 0u) << "last poses are told last";
  EXPECT_GE(poses, 15u);
  EXPECT_FALSE(core_.IsRefining());
}

}  // namespace
}  // namespace dmslam
