#include "player/player_node.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/testing/node_on_bus.h"

namespace dmslam {
namespace {

constexpr uint32_t kSession = 9;

/// Ten grey frames.
class TenFrames : public FrameSource {
 public:
  size_t size() const override { return 10; }
  int64_t StampNs(size_t index) const override { return static_cast<int64_t>(index) * 33'000'000; }
  std::string Name(size_t index) const override { return "frame " + std::to_string(index); }
  EncodedImage Read(size_t) override {
    return {ImageEncoding::kGray8, 64, 48, std::vector<uint8_t>(size_t{64} * 48, 7)};
  }
};

/// A player in lock-step, on a bus where somebody listens and answers; time stands still unless it is moved.
class PlayerNodeTest : public testing::Test {
 protected:
  explicit PlayerNodeTest(PlaybackMode mode = PlaybackMode::kLockstep, std::vector<std::string> awaited = {})
      : player_port_(bus_.AddPort()), ear_(bus_.AddPort()) {
    for (const char* channel : {channels::kFrame, channels::kEndOfSequence}) ear_.Subscribe(channel);
    ear_.SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) {
      if (channel == channels::kFrame) frames_.push_back(wire::Decode<Frame>(bytes)->frame_index);
      if (channel == channels::kEndOfSequence) ++ends_;
    });
    NodeContext context = ContextOnBus(&player_port_, &now_ns_, "player");
    PlayerOptions options;
    options.sequence = "ten";
    options.session = kSession;
    options.camera = {.width_px = 64, .height_px = 48, .fx_px = 60, .fy_px = 60, .cx_px = 32, .cy_px = 24};
    options.mode = mode;
    options.awaited = std::move(awaited);
    options.encoding.encoding = FrameEncoding::kGray8;
    player_ = std::make_unique<PlayerNode>(std::move(context), options, std::make_unique<TenFrames>());
  }
  void Advance(int64_t ms, int64_t every_ms = 10) {
    for (; ms > 0; ms -= every_ms) {
      now_ns_ += every_ms * 1'000'000;
      player_->Advance();
      DeliverAll(bus_);
    }
  }
  /// Until it has played its first frame.
  void Begin() {
    for (int i = 0; i < 1000 && frames_.empty(); ++i) Advance(10);
  }
  template <typename Message>
  void Say(const Message& message) {
    dmslam::Say(ear_, message);
    DeliverAll(bus_);
  }
  void SayDone(uint32_t frame) { Say(FrameDone{.session = kSession, .frame_index = frame}); }
  void SayAllDone() { Say(SequenceDone{.session = kSession}); }

  MemoryBus bus_;
  MemoryBus::Port& player_port_;
  MemoryBus::Port& ear_;
  int64_t now_ns_ = 1'000'000'000;
  std::vector<uint32_t> frames_;
  int ends_ = 0;
  std::unique_ptr<PlayerNode> player_;
};

TEST_F(PlayerNodeTest, PlaysFrameByFrameAndTellsTheEnd) {
  Begin();
  for (uint32_t frame = 0; frame < 10; ++frame) {
    ASSERT_EQ(frames_.back(), frame);
    SayDone(frame);
    Advance(10);
  }
  Advance(300);
  EXPECT_GE(ends_, 1);
  SayAllDone();
  Advance(6000);  // no mapper says anything
  EXPECT_EQ(player_->exit_code(), 0);
}

/// In real time, where frontend and mapper may need longer than the player to begin.
class RealtimePlayerTest : public PlayerNodeTest {
 protected:
  RealtimePlayerTest() : PlayerNodeTest(PlaybackMode::kRealtime, {"mapper", "frontend"}) {}
  template <typename Status>
  void SayStatus(int64_t epoch) {
    Status status;
    status.head.session = kSession;
    status.head.health.epoch = epoch;
    Say(status);
  }
};

TEST_F(RealtimePlayerTest, TheFirstFrameWaitsUntilFrontendAndMapperWrite) {
  Advance(4000);
  SayStatus<MapperStatus>(0);
  SayStatus<FrontendStatus>(5);
  Advance(2000);
  EXPECT_TRUE(frames_.empty()) << "the mapper asks who holds a map";
  SayStatus<MapperStatus>(5);
  Advance(20);
  EXPECT_EQ(frames_.size(), 1U);
  Advance(100);
  EXPECT_EQ(frames_.size(), 4U) << "at its rate from then on";
  Advance(1000);
  EXPECT_EQ(frames_.size(), 10U);
}

TEST_F(RealtimePlayerTest, WhoIsReadyBeforeHoldsNothingBack) {
  SayStatus<MapperStatus>(5);
  SayStatus<FrontendStatus>(5);
  Advance(2550);
  EXPECT_FALSE(frames_.empty());
}

TEST_F(RealtimePlayerTest, WhoDoesNotComeIsNotWaitedForWithoutEnd) {
  SayStatus<FrontendStatus>(5);
  Advance(11'500);
  EXPECT_TRUE(frames_.empty());
  Advance(1000);
  EXPECT_FALSE(frames_.empty());
}

/// What those say who have heard another player in this session.
class PlayerOfAnotherCamera : public PlayerNodeTest {
 protected:
  void SayCamera(double fx_px, const std::string& sequence = "ten") {
    CameraInfo info;
    info.session = kSession;
    info.camera = {.width_px = 64, .height_px = 48, .fx_px = fx_px, .fy_px = 60, .cx_px = 32, .cy_px = 24};
    info.sequence = sequence;
    Say(info);
  }
};

TEST_F(PlayerOfAnotherCamera, EndsBeforeItsFirstFrame) {
  SayCamera(70);
  Advance(100);
  SayCamera(70);
  Advance(3000);
  EXPECT_EQ(player_->exit_code(), kExitMisfit);
  EXPECT_NE(player_->problem().find("its camera has fx 70, not fx 60"), std::string::npos)
      << player_->problem();
  EXPECT_TRUE(frames_.empty());
}

TEST_F(PlayerOfAnotherCamera, AnotherRecordingEndsItToo) {
  SayCamera(60, "eleven");
  Advance(100);
  SayCamera(60, "eleven");
  Advance(100);
  EXPECT_EQ(player_->exit_code(), kExitMisfit);
  EXPECT_NE(player_->problem().find("is that of eleven, and ten is another recording"), std::string::npos)
      << player_->problem();
}

TEST_F(PlayerOfAnotherCamera, WhatIsForgedOnceOrAfterAFrameWasTakenEndsNothing) {
  SayCamera(70);
  SayCamera(60);
  SayCamera(60);
  Begin();
  SayDone(0);
  SayCamera(80);
  Advance(100);
  SayCamera(80);
  Advance(100);
  EXPECT_EQ(player_->exit_code(), std::nullopt);
  EXPECT_EQ(frames_.size(), 2U);
}

TEST_F(PlayerNodeTest, OneForgedAnswerWhileItBeginsChangesNothing) {
  Advance(10);
  ASSERT_TRUE(frames_.empty()) << "it listens first";
  SayAllDone();
  SayDone(7);
  Begin();
  ASSERT_FALSE(frames_.empty());
  EXPECT_EQ(frames_.front(), 0u);
  EXPECT_EQ(ends_, 0);
  SayDone(8);  // nothing of ours has been done yet
  Advance(400);
  EXPECT_EQ(frames_.back(), 0u) << "it waits";
  SayDone(0);
  Advance(10);
  EXPECT_EQ(frames_.back(), 1u);
}

TEST_F(PlayerNodeTest, OneForgedAnswerInTheMiddleChangesNothing) {
  Begin();
  SayDone(0);
  Advance(10);
  SayDone(9);
  SayAllDone();
  Advance(400);
  EXPECT_EQ(frames_.back(), 1u);
  EXPECT_EQ(ends_, 0);
}

TEST_F(PlayerNodeTest, TwoForgedAnswersThatAreContradictedMeanwhileChangeNothing) {
  Begin();
  SayAllDone();
  Advance(100);
  SayDone(0);
  Advance(110);
  ASSERT_EQ(frames_.back(), 1u);
  SayAllDone();
  Advance(10);
  EXPECT_EQ(frames_.back(), 1u);
  EXPECT_EQ(ends_, 0);
}

/// Started again, it begins from the front; the frontend answers each repeat with what it has done.
TEST_F(PlayerNodeTest, GoesOnBehindAFrontendThatIsFurther) {
  Begin();
  SayDone(5);
  Advance(300);
  SayDone(9);  // forged
  SayDone(5);
  Advance(10);
  EXPECT_EQ(frames_.back(), 6u) << "of what is said the least counts";
}

/// Somebody forged a frame behind the last one, and the frontend took it.
TEST_F(PlayerNodeTest, EndsWhereTheFrontendIsBehindTheLastFrame) {
  Begin();
  for (uint32_t frame = 0; frame < 9; ++frame) {
    SayDone(frame);
    Advance(10);
  }
  ASSERT_EQ(frames_.back(), 9u);
  SayDone(10);
  Advance(200);
  EXPECT_EQ(ends_, 0) << "one answer may be forged";
  SayDone(10);
  Advance(300);
  EXPECT_GE(ends_, 1);
}

TEST_F(PlayerNodeTest, GoesToTheEndWhereAllIsDone) {
  Begin();
  SayAllDone();
  Advance(300);
  SayAllDone();
  Advance(10);
  EXPECT_GE(ends_, 1);
}

}  // namespace
}  // namespace dmslam
