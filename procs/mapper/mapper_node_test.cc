#include "mapper/mapper_node.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/mapping/testing/wall_scene.h"
#include "dmslam/runtime/testing/node_on_bus.h"
#include "dmslam/settings/settings.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr uint32_t kSession = 4;

/// A mapper on a bus with a loop closer's stream, and whoever reads the map.
class LoopAnswersTest : public testing::Test {
 protected:
  LoopAnswersTest() : other_(&bus_.AddPort(), [this] { return now_ns_; }) {
    answers_ = std::make_unique<StreamWriter>(
        WriterOfRole(kSession, StreamId::kLoopCloser, "loopcloser", "mapper"), Term{10, 3}, Version{});
    other_.AddWriter(answers_.get(), "LOOPCLOSER", {"MAPPER"});
    map_ = std::make_unique<StreamReader>(ReaderOfRole(kSession, StreamId::kMap, "mapper", "loopcloser"));
    other_.AddReader(map_.get(), "MAPPER", {channels::kMap});

    NodeContext context = ContextOnBus(&bus_.AddPort(), &now_ns_, "mapper");
    context.fresh_system = true;
    NodeOptions options;
    options.session = kSession;
    options.settings = LoadSettings("", {});
    mapper_ = std::make_unique<MapperNode>(context, options);
    CameraInfo info;
    info.session = kSession;
    info.camera = TestCamera();
    for (int said = 0; said < 2; ++said) {
      dmslam::Say(other_.bus(), info);
      Run();
    }
  }

  void Run() {
    for (int i = 0; i < 200; ++i) {
      other_.Advance();
      mapper_->Advance();
      DeliverAll(bus_);
      now_ns_ += 5 * kMs;
    }
  }

  /// A correction as a group of three records, of keyframes that nobody knows.
  static std::vector<LoopAnswer> Correction(uint64_t id) {
    LoopAnswer answer;
    answer.keyframe = KeyframeId::Make(kSession, 9);
    answer.correction_id = id;
    answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
    for (uint32_t frame : {1, 2, 3}) answer.corrections.push_back({KeyframeId::Make(kSession, frame), {}});
    std::vector<LoopAnswer> records = wire::Split(answer, 1);
    EXPECT_EQ(records.size(), 3U);
    return records;
  }
  void Publish(const LoopAnswer& answer) {
    answers_->Publish(channels::kChecked, wire::Encode(answer), now_ns_);
  }
  /// What the mapper has said of corrections since it was last asked.
  std::vector<MapDelta> Refusals() {
    Run();
    std::vector<MapDelta> refusals;
    while (std::optional<Record> record = map_->Take()) {
      std::optional<MapDelta> delta = wire::Decode<MapDelta>(*record->bytes);
      if (delta && delta->event == MapEvent::kCorrectionRefused) refusals.push_back(std::move(*delta));
      map_->AcceptTaken();
    }
    return refusals;
  }
  void ExpectNotWhole(uint64_t id) {
    const std::vector<MapDelta> refusals = Refusals();
    ASSERT_EQ(refusals.size(), 1U);
    EXPECT_EQ(refusals[0].correction_id, id);
    EXPECT_NE(refusals[0].note.find("did not come whole"), std::string::npos) << refusals[0].note;
  }

  int64_t now_ns_ = kMs;
  MemoryBus bus_;
  Endpoint other_;
  std::unique_ptr<StreamWriter> answers_;
  std::unique_ptr<StreamReader> map_;
  std::unique_ptr<MapperNode> mapper_;
};

TEST_F(LoopAnswersTest, ACorrectionThatComesWholeIsJudgedByWhatItSays) {
  for (const LoopAnswer& record : Correction(5)) Publish(record);
  const std::vector<MapDelta> refusals = Refusals();
  ASSERT_EQ(refusals.size(), 1U) << "its keyframes are not there";
  EXPECT_EQ(refusals[0].correction_id, 5U);
  EXPECT_EQ(refusals[0].note.find("did not come whole"), std::string::npos) << refusals[0].note;
}

TEST_F(LoopAnswersTest, OneThatLacksARecordIsRefusedByNameAndTheNextOneIsHeard) {
  const std::vector<LoopAnswer> records = Correction(6);
  Publish(records[0]);
  Publish(records[2]);
  ExpectNotWhole(6);
  for (const LoopAnswer& record : Correction(7)) Publish(record);
  const std::vector<MapDelta> refusals = Refusals();
  ASSERT_EQ(refusals.size(), 1U);
  EXPECT_EQ(refusals[0].correction_id, 7U);
  EXPECT_EQ(refusals[0].note.find("did not come whole"), std::string::npos) << refusals[0].note;
}

TEST_F(LoopAnswersTest, OneWithARecordTwiceIsRefusedByName) {
  const std::vector<LoopAnswer> records = Correction(8);
  for (const size_t i : {0, 1, 1}) Publish(records[i]);
  ExpectNotWhole(8);
}

TEST_F(LoopAnswersTest, OneWhoseRecordsTellOfDifferentThingsIsRefusedByName) {
  std::vector<LoopAnswer> records = Correction(9);
  ++records[1].base_version;
  Publish(records[0]);
  Publish(records[1]);
  ExpectNotWhole(9);
}

/// ... with somebody who hears the mapper's status, and a frontend.
class MapperStatusTest : public LoopAnswersTest {
 protected:
  using State = MapperStatus::State;

  MapperStatusTest() : ear_(bus_.AddPort()) {
    ear_.Subscribe(channels::kMapperStatus);
    ear_.SetHandler([this](const std::string&, std::span<const uint8_t> bytes) {
      status_ = wire::Decode<MapperStatus>(bytes).value();
    });
  }
  void BeginFrontend() {
    frontend_ = std::make_unique<StreamWriter>(
        WriterOfRole(kSession, StreamId::kFrontend, "frontend", "mapper"), Term{10, 5}, Version{});
    other_.AddWriter(frontend_.get(), "FRONTEND", {"MAPPER"});
  }
  template <typename Message>
  void Say(const Message& message) {
    frontend_->Publish(wire::Info<Message>().channel, wire::Encode(message), now_ns_);
  }
  /// Until what was said is in the status.
  void RunOn() {
    Run();
    Run();
  }
  static InitialMap FirstMap() {
    const WallScene scene;
    InitialMap proposal;
    proposal.map_id = 1;
    proposal.first = scene.Propose(1, 0, 1, 0, 0);
    proposal.second = scene.Propose(2, 0.3, 1, 0, 1);
    for (uint16_t i = 0; i < 60; ++i) proposal.points.push_back({i, i, scene.point(i)});
    return proposal;
  }
  /// One of those of which the mapper has told.
  std::optional<LandmarkId> SomeLandmark() {
    std::optional<LandmarkId> some;
    while (const std::optional<Record> record = map_->Take()) {
      const auto delta = wire::Decode<MapDelta>(*record->bytes);
      if (delta && !delta->landmarks.empty()) some = delta->landmarks.front().id;
      map_->AcceptTaken();
    }
    return some;
  }

  MemoryBus::Port& ear_;
  std::unique_ptr<StreamWriter> frontend_;
  MapperStatus status_;
};

TEST_F(MapperStatusTest, AnAnsweredRequestIsNamedWithTheEpochOfWhoAsked) {
  BeginFrontend();
  Say(FirstMap());
  Say(AdjustRequest{.request = 3, .reason = "the end", .newest_stamp_ns = {}, .camera_id = 0});
  RunOn();
  std::optional<MapDelta> answer;
  while (const std::optional<Record> record = map_->Take()) {
    auto delta = wire::Decode<MapDelta>(*record->bytes);
    if (delta && delta->event == MapEvent::kRequestDone) answer = std::move(delta);
    map_->AcceptTaken();
  }
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->request, 3U);
  EXPECT_EQ(answer->progress.camera, 0U);
  EXPECT_EQ(answer->progress.frontend.epoch, frontend_->term().epoch);
}

TEST_F(MapperStatusTest, SaysForWhomItWaitsAndWhatIsInTheMap) {
  RunOn();
  EXPECT_EQ(status_.state, State::kWaiting);
  EXPECT_EQ(status_.head.reason, "waiting for a frontend");
  BeginFrontend();
  RunOn();
  EXPECT_EQ(status_.state, State::kMapping);
  EXPECT_EQ(status_.head.reason, "");
  EXPECT_EQ(status_.maps, 0);
  Say(FirstMap());
  RunOn();
  EXPECT_EQ(status_.maps, 1);
  EXPECT_EQ(status_.keyframes, 2);
  EXPECT_EQ(status_.moving_landmarks, 0);
  const std::optional<LandmarkId> moving = SomeLandmark();
  ASSERT_TRUE(moving);
  FrameEvidence evidence;
  evidence.map_id = 1;
  evidence.items.push_back({*moving, 1, 0, 1});
  Say(evidence);
  RunOn();
  EXPECT_EQ(status_.moving_landmarks, 1);
}

}  // namespace
}  // namespace dmslam
