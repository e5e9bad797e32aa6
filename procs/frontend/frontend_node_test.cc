#include "frontend/frontend_node.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/features/testing/synthetic_images.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/testing/node_on_bus.h"
#include "dmslam/settings/settings.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr uint32_t kSession = 4;
constexpr int64_t kFrameNs = 100 * kMs;  ///< between frames

/// A frontend on a bus with a player, which says what a test has it say; everything that the frontend
/// publishes is heard.
class FrontendNodeTest : public ::testing::Test {
 protected:
  FrontendNodeTest() : others_(&bus_.AddPort(), [this] { return now_ns_; }), ear_(bus_.AddPort()) {
    for (const char* channel :
         {channels::kSession, channels::kTurnRequest, channels::kFramePose, channels::kPoseView,
          channels::kOdometry, channels::kFrameTrace, channels::kFeatureView, channels::kFrameDone,
          channels::kSequenceDone, channels::kFrontendStatus})
      ear_.Subscribe(channel);
    ear_.SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) {
      heard_[channel].emplace_back(bytes.begin(), bytes.end());
    });
  }

  void Start(PlaybackMode mode, std::vector<std::string> peers = {}) {
    NodeContext context = ContextOnBus(&bus_.AddPort(), &now_ns_, "frontend");
    context.fresh_system = true;
    NodeOptions options;
    options.session = kSession;
    options.peers = std::move(peers);
    options.settings = LoadSettings("", {});
    node_ = std::make_unique<FrontendNode>(context, options, FrontendExtras());
    CameraInfo info;
    info.session = kSession;
    info.camera = TestCamera();
    info.mode = mode;
    for (int said = 0; said < 2; ++said) {
      Say(info);
      Run(200);
    }
  }
  template <typename Message>
  void Say(const Message& message) {
    dmslam::Say(others_.bus(), message);
  }
  void SayBytes(const std::string& channel, Bytes bytes) {
    dmslam::SayBytes(others_.bus(), channel, std::move(bytes));
  }
  void Run(int64_t ms = 10) {
    for (const int64_t end_ns = now_ns_ + ms * kMs; now_ns_ < end_ns; now_ns_ += 5 * kMs) {
      others_.Advance();
      DeliverAll(bus_);
      node_->Advance();
      DeliverAll(bus_);
    }
  }

  static Frame FrameAt(uint32_t index, int width_px = 640) {
    Frame frame;
    frame.session = kSession;
    frame.frame_index = index;
    frame.stamp_ns = index * kFrameNs;
    frame.width_px = width_px;
    frame.height_px = 480;
    frame.encoding = FrameEncoding::kGray8;
    frame.data = dmslam::testing::RandomRectangles(width_px, 480, 200, 1).pixels;
    return frame;
  }
  static Frame Unreadable(uint32_t index) {
    Frame frame = FrameAt(index);
    frame.encoding = FrameEncoding::kJpeg;
    frame.width_px = frame.height_px = 0;
    frame.data.resize(1000);
    return frame;
  }
  void Play(const Frame& frame) {
    Say(frame);
    Run();
  }
  void SayEnd() {
    EndOfSequence end;
    end.session = kSession;
    for (int said = 0; said < 3; ++said) {
      Say(end);
      Run(200);
    }
  }

  template <typename Message>
  size_t Count() {
    return heard_[wire::Info<Message>().channel].size();
  }
  /// What the frontend has said of this kind last.
  template <typename Message>
  Message Last() {
    const std::vector<Bytes>& heard = heard_[wire::Info<Message>().channel];
    const std::optional<Message> last =
        heard.empty() ? std::nullopt : wire::Decode<Message>(std::span<const uint8_t>(heard.back()));
    EXPECT_TRUE(last) << wire::Info<Message>().channel;
    return last.value_or(Message());
  }
  /// That takes all into account that was said before.
  FrontendStatus Status() {
    Run(1100);
    return Last<FrontendStatus>();
  }

  int64_t now_ns_ = kMs;
  MemoryBus bus_;
  Endpoint others_;
  MemoryBus::Port& ear_;
  std::map<std::string, std::vector<Bytes>> heard_;
  std::unique_ptr<FrontendNode> node_;
};

TEST_F(FrontendNodeTest, AFrameIsTrackedAndAnswered) {
  Start(PlaybackMode::kLockstep);
  EXPECT_EQ(Last<SessionStart>().session, kSession);
  Play(FrameAt(3));
  EXPECT_EQ(Last<FrameDone>().frame_index, 3U);
  EXPECT_EQ(Last<FrameDone>().stamp_ns, 3 * kFrameNs);
  EXPECT_EQ(Last<FramePose>().frame_index, 3U);
  EXPECT_EQ(Last<Odometry>().frame_index, 3U);
  EXPECT_EQ(Last<PoseView>().frame_index, 3U);
  EXPECT_EQ(Last<FrameTrace>().frame_index, 3U);
  EXPECT_GT(Last<FeatureView>().items.size(), 100U);
  const FrontendStatus status = Status();
  EXPECT_EQ(status.frames_received, 1);
  EXPECT_EQ(status.frames_processed, 1);
  EXPECT_EQ(status.frame_index, 3);
  EXPECT_GT(status.features, 100);
}

TEST_F(FrontendNodeTest, ARepeatIsAnsweredAndNotTrackedAgain) {
  Start(PlaybackMode::kLockstep);
  Play(FrameAt(3));
  for (int repeat = 0; repeat < 2; ++repeat) Play(FrameAt(3));
  EXPECT_EQ(Count<FrameDone>(), 3U);
  EXPECT_EQ(Count<FramePose>(), 1U);
  EXPECT_EQ(Status().frames_processed, 1);
}

TEST_F(FrontendNodeTest, AnImageThatCannotBeReadCostsItsPlaceAlone) {
  Start(PlaybackMode::kLockstep);
  for (uint32_t index = 0; index < 5; ++index) {
    Play(Unreadable(index));
    EXPECT_EQ(Last<FrameDone>().frame_index, index) << "the player would wait for ever";
  }
  EXPECT_EQ(Count<FramePose>(), 0U);
  Play(FrameAt(5));
  EXPECT_EQ(Last<FramePose>().frame_index, 5U);
  const FrontendStatus status = Status();
  EXPECT_EQ(status.head.health.dropped_malformed, 5);
  EXPECT_EQ(status.frames_received, 6);
  EXPECT_EQ(status.frames_processed, 1);
  EXPECT_FALSE(node_->exit_code());
}

TEST_F(FrontendNodeTest, FramesOfAnotherCameraEndItWhereNoneHasFitted) {
  Start(PlaybackMode::kLockstep);
  for (uint32_t index = 0; index < 3; ++index) {
    EXPECT_FALSE(node_->exit_code());
    Play(FrameAt(index, 320));
  }
  EXPECT_EQ(node_->exit_code(), kExitMisfit);
  EXPECT_NE(node_->problem().find("320x480"), std::string::npos) << node_->problem();
}

TEST_F(FrontendNodeTest, FramesOfAnotherCameraCostTheirPlaceAloneWhereOneHasFitted) {
  Start(PlaybackMode::kLockstep);
  Play(FrameAt(0));
  for (uint32_t index = 1; index < 6; ++index) Play(FrameAt(index, 320));
  EXPECT_FALSE(node_->exit_code());
  EXPECT_EQ(Last<FrameDone>().frame_index, 5U);
  EXPECT_EQ(Status().head.health.dropped_malformed, 5);
}

TEST_F(FrontendNodeTest, ForeignAndDamagedMessagesAreDroppedAndCounted) {
  Start(PlaybackMode::kLockstep);
  const ProcessHealth before = Status().head.health;
  Frame foreign = FrameAt(0);
  foreign.session = kSession + 1;
  Play(foreign);
  Bytes damaged = wire::Encode(FrameAt(0));
  damaged.resize(damaged.size() / 2);
  SayBytes(channels::kFrame, damaged);
  SayBytes(channels::kEndOfSequence, Bytes(5, 9));
  EndOfSequence end;
  end.session = kSession + 1;
  Say(end);
  const FrontendStatus status = Status();
  EXPECT_EQ(status.head.health.dropped_foreign - before.dropped_foreign, 2);
  EXPECT_EQ(status.head.health.dropped_malformed - before.dropped_malformed, 2);
  EXPECT_EQ(status.frames_received, 0);
  EXPECT_EQ(Count<FrameDone>(), 0U);
  Play(FrameAt(0));
  EXPECT_EQ(Count<FrameDone>(), 1U);
}

TEST_F(FrontendNodeTest, AFrameFarAheadDeafensItNot) {
  Start(PlaybackMode::kLockstep);
  Play(FrameAt(0));
  Play(FrameAt(1'000'000));
  Play(FrameAt(1));
  EXPECT_EQ(Last<FrameDone>().frame_index, 1U);
  EXPECT_EQ(Status().head.health.dropped_malformed, 1);
}

TEST_F(FrontendNodeTest, InRealTimeTheNewestOfThoseThatCameIsTracked) {
  Start(PlaybackMode::kRealtime);
  for (uint32_t index = 0; index < 3; ++index) Say(FrameAt(index));
  Run();
  EXPECT_EQ(Last<FramePose>().frame_index, 2U);
  const FrontendStatus status = Status();
  EXPECT_EQ(status.frames_received, 3);
  EXPECT_EQ(status.frames_skipped, 2);
  EXPECT_EQ(status.frames_processed, 1);
}

TEST_F(FrontendNodeTest, InRealTimeFramesWaitForOneThatTakesLong) {
  Start(PlaybackMode::kRealtime);
  for (uint32_t index = 0; index < 3; ++index) {
    Frame frame = FrameAt(index);
    frame.stamp_ns = index * 33 * kMs;
    Say(frame);
  }
  Run();
  EXPECT_EQ(Count<FramePose>(), 3U);
  EXPECT_EQ(Last<FramePose>().frame_index, 2U);
  EXPECT_EQ(Status().frames_skipped, 0);
}

TEST_F(FrontendNodeTest, TheEndOfTheSequenceIsAnsweredWhenAllIsTold) {
  Start(PlaybackMode::kLockstep);
  for (uint32_t index = 0; index < 3; ++index) Play(FrameAt(index));
  Play(Unreadable(3));
  EXPECT_EQ(Count<SequenceDone>(), 0U);
  SayEnd();
  ASSERT_GE(Count<SequenceDone>(), 1U);
  const auto done = Last<SequenceDone>();
  EXPECT_EQ(done.session, kSession);
  EXPECT_EQ(done.frames_processed, 3);
  EXPECT_EQ(done.frames_skipped, 0);
  EXPECT_EQ(node_->exit_code(), kExitDone) << "there is no mapper that could come back for the map";
}

/// ... with a mapper, which follows the frontend's stream when a test begins it, and has a map.
class FrontendWithMapperTest : public FrontendNodeTest {
 protected:
  void BeginMapper() {
    frontend_ =
        std::make_unique<StreamReader>(ReaderOfRole(kSession, StreamId::kFrontend, "frontend", "mapper"));
    others_.AddReader(frontend_.get(), "FRONTEND",
                      {channels::kSession, channels::kFramePose, channels::kTurnRequest});
    map_ = std::make_unique<StreamWriter>(WriterOfRole(kSession, StreamId::kMap, "mapper", "frontend"),
                                          Term{10, 3}, Version{});
    others_.AddWriter(map_.get(), "MAPPER", {"FRONTEND"});
  }

  void PublishMap(const MapDelta& delta) {
    map_->Publish(channels::kMap, wire::Encode(delta), now_ns_);
    Run(500);
  }

  std::unique_ptr<StreamReader> frontend_;
  std::unique_ptr<StreamWriter> map_;
};

TEST_F(FrontendWithMapperTest, InLockstepTheFirstFrameWaitsForItsReaders) {
  Start(PlaybackMode::kLockstep, {"mapper"});
  Play(FrameAt(0));
  EXPECT_EQ(Status().head.health.waiting_for, "mapper");
  EXPECT_EQ(Count<FrameDone>(), 0U);
  BeginMapper();
  Run(1500);
  EXPECT_EQ(Last<FrameDone>().frame_index, 0U);
  EXPECT_EQ(Status().head.health.waiting_for, "");
}

TEST_F(FrontendWithMapperTest, WithAnotherCameraInLockstepAFrameWaitsForItsTurn) {
  Start(PlaybackMode::kLockstep, {"mapper", "frontend1"});
  BeginMapper();
  Run(1500);
  Play(FrameAt(0));
  EXPECT_EQ(Last<TurnRequest>().frame_index, 0U);
  EXPECT_EQ(Last<TurnRequest>().time.stamp_ns, 0);
  EXPECT_EQ(Count<FramePose>(), 0U);
  MapDelta delta;
  delta.event = MapEvent::kTurn;
  delta.version = 1;
  delta.about = KeyframeId::Make(kSession, 0);
  PublishMap(delta);
  EXPECT_EQ(Count<TurnRequest>(), 1U);
  EXPECT_EQ(Last<FrameDone>().frame_index, 0U);
}

/// As after a takeover: all who held the map have it, so it is left as it is.
TEST_F(FrontendWithMapperTest, AMapThatHasEndedEndsItWithoutAFrame) {
  Start(PlaybackMode::kRealtime, {"mapper"});
  BeginMapper();
  Run(1500);
  Play(FrameAt(0));
  MapDelta delta;
  delta.event = MapEvent::kEnded;
  delta.version = 1;
  delta.progress.ended = true;
  PublishMap(delta);
  const size_t before = Count<FramePose>();
  Play(FrameAt(1));
  EXPECT_EQ(Last<SequenceDone>().frames_processed, 1);
  EXPECT_EQ(Count<FramePose>(), before);
}

}  // namespace
}  // namespace dmslam
