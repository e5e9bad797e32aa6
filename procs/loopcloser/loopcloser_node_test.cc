#include "loopcloser/loopcloser_node.h"

#include <gtest/gtest.h>

#include <memory>
#include <span>
#include <string>
#include <utility>

#include "dmslam/loops/testing/ring_room.h"
#include "dmslam/runtime/testing/node_on_bus.h"
#include "dmslam/settings/settings.h"

namespace dmslam {
namespace {

using dmslam::testing::Room;
using State = LoopcloserStatus::State;

constexpr int64_t kMs = 1'000'000;
constexpr uint32_t kSession = 4;

/// A loop closer on a bus with a mapper's stream; somebody hears its status and its answers.
class LoopcloserStatusTest : public ::testing::Test {
 protected:
  LoopcloserStatusTest() : mapper_(&bus_.AddPort(), [this] { return now_ns_; }), ear_(bus_.AddPort()) {
    for (const char* channel : {channels::kLoopcloserStatus, channels::kChecked}) ear_.Subscribe(channel);
    ear_.SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) {
      if (channel == channels::kLoopcloserStatus) status_ = wire::Decode<LoopcloserStatus>(bytes).value();
      if (channel == channels::kChecked) answer_ = wire::Decode<LoopAnswer>(bytes).value();
    });
    NodeContext context = ContextOnBus(&bus_.AddPort(), &now_ns_, "loopcloser");
    context.now_ns = [this] { return now_ns_ += 1000; };  // work takes time
    context.fresh_system = true;
    NodeOptions options;
    options.session = kSession;
    options.settings = LoadSettings("", {});
    node_ = std::make_unique<LoopcloserNode>(context, options, dmslam::testing::ShippedVocabulary());
  }

  /// Long enough for a status, unless it is less.
  void Run(int64_t ms = 1100) {
    for (const int64_t end_ns = now_ns_ + ms * kMs; now_ns_ < end_ns; now_ns_ += 5 * kMs) {
      mapper_.Advance();
      node_->Advance();
      DeliverAll(bus_);
    }
  }
  void SayCamera() {
    CameraInfo info;
    info.session = kSession;
    info.camera = room_.map().camera();
    for (int said = 0; said < 2; ++said) {
      dmslam::Say(mapper_.bus(), info);
      Run(200);
    }
  }
  void BeginMap() {
    writer_ = std::make_unique<StreamWriter>(WriterOfRole(kSession, StreamId::kMap, "mapper", "loopcloser"),
                                             Term{10, 3}, Version{});
    mapper_.AddWriter(writer_.get(), "MAPPER", {"LOOPCLOSER"});
  }
  void Publish(MapDelta change) {
    for (const MapDelta& record : wire::Split(std::move(change)))
      writer_->Publish(channels::kMap, wire::Encode(record), now_ns_);
  }
  /// The end of the room's map.
  MapDelta End() const {
    MapDelta delta;
    delta.event = MapEvent::kEnded;
    delta.version = room_.map().version() + 1;
    delta.progress.ended = true;
    return delta;
  }

  int64_t now_ns_ = kMs;
  Room room_{{}};
  MemoryBus bus_;
  Endpoint mapper_;
  MemoryBus::Port& ear_;
  std::unique_ptr<StreamWriter> writer_;
  LoopcloserStatus status_;
  LoopAnswer answer_;
  std::unique_ptr<LoopcloserNode> node_;
};

TEST_F(LoopcloserStatusTest, SaysWhatItDoesAndForWhomItWaits) {
  Run();
  EXPECT_EQ(status_.state, State::kStarting);
  EXPECT_EQ(status_.head.reason, "waiting for a camera");
  SayCamera();
  Run();
  EXPECT_EQ(status_.state, State::kWaiting);
  EXPECT_EQ(status_.head.reason, "waiting for a mapper");
  BeginMap();
  Run();
  EXPECT_EQ(status_.state, State::kWatching);
  EXPECT_EQ(status_.head.reason, "");
  for (int k = 0; k < dmslam::testing::kKeyframes && answer_.kind == LoopAnswer::Kind::kNone; ++k) {
    Publish(room_.Next());
    Run(50);
  }
  ASSERT_EQ(answer_.kind, LoopAnswer::Kind::kLoop);
  Run();
  EXPECT_EQ(status_.state, State::kCorrecting) << "the mapper has not said what it makes of it";
  EXPECT_EQ(status_.loops_closed, 1);
  EXPECT_TRUE(status_.last_loop_keyframe);
  Publish(room_.SayOf(answer_, MapEvent::kCorrected));
  Run();
  EXPECT_EQ(status_.state, State::kWatching);
  Publish(End());
  Run();
  EXPECT_EQ(status_.state, State::kDone);
}

TEST_F(LoopcloserStatusTest, TellsHowLongQueriesTakeAndWhatWaits) {
  SayCamera();
  BeginMap();
  Run();
  for (int k = 0; k < 5; ++k) Publish(room_.Next());
  Run();
  EXPECT_EQ(status_.replica_version, 5);
  EXPECT_EQ(status_.indexed_keyframes, 5);
  EXPECT_EQ(status_.keyframes_checked, 5);
  EXPECT_EQ(status_.last_keyframe, Room::IdOf(4));
  EXPECT_EQ(status_.keyframe_queue, 0);
  EXPECT_GT(status_.query_p50_ms, 0);
  EXPECT_GE(status_.query_p95_ms, status_.query_p50_ms);
  EXPECT_GT(status_.check_p50_ms, status_.query_p50_ms);
  EXPECT_GE(status_.check_p95_ms, status_.check_p50_ms);
  EXPECT_TRUE(status_.vocabulary_checksum);

  for (int k = 0; k < 3; ++k) Publish(room_.Next());
  mapper_.Advance();
  DeliverAll(bus_);
  now_ns_ += 1000 * kMs;
  node_->Advance();  // a status is due as soon as it has worked on the first one
  DeliverAll(bus_);
  EXPECT_EQ(status_.keyframes_checked, 6);
  EXPECT_EQ(status_.keyframe_queue, 2);
  EXPECT_GE(status_.head.health.queue_peak, 3);
}

}  // namespace
}  // namespace dmslam
