#include "player/live_node.h"

#include <gtest/gtest.h>

#include <deque>
#include <optional>
#include <utility>

#include "dmslam/runtime/testing/node_on_bus.h"

namespace dmslam {
namespace {

/// What a fake camera has in store.
struct Store {
  std::deque<LiveFrame> frames;
  bool ended = false;
  std::string away;
};

class FakeCamera : public LiveSource {
 public:
  explicit FakeCamera(Store* store) : store_(store) {}
  int fd() const override { return -1; }
  std::optional<LiveFrame> Take() override {
    if (store_->frames.empty()) return std::nullopt;
    LiveFrame frame = std::move(store_->frames.front());
    store_->frames.pop_front();
    return frame;
  }
  bool ended() const override { return store_->ended && store_->frames.empty(); }
  int64_t dropped() const override { return 3; }
  std::string away() const override { return store_->away; }

 private:
  Store* store_;
};

LiveFrame Picture(uint32_t index, int64_t stamp_ns) {
  LiveFrame frame{index, stamp_ns, {ImageEncoding::kGray8, 8, 4, {}}};
  frame.image.bytes.assign(32, static_cast<uint8_t>(index));
  return frame;
}

/// A node with a camera, on a bus where somebody listens; time stands still unless it is moved.
class LiveNodeTest : public testing::Test {
 protected:
  LiveNodeTest() : player_port_(bus_.AddPort()), ear_(bus_.AddPort()) {
    for (const char* channel :
         {channels::kFrame, channels::kCameraInfo, channels::kEndOfSequence, channels::kPlayerStatus})
      ear_.Subscribe(channel);
    ear_.SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) {
      if (channel == channels::kFrame) frames_.push_back(*wire::Decode<Frame>(bytes));
      if (channel == channels::kCameraInfo) infos_.push_back(*wire::Decode<CameraInfo>(bytes));
      if (channel == channels::kPlayerStatus) status_ = *wire::Decode<PlayerStatus>(bytes);
      if (channel == channels::kEndOfSequence) ends_.push_back(*wire::Decode<EndOfSequence>(bytes));
    });
  }
  LiveNode Make(size_t frames = SIZE_MAX, std::optional<uint32_t> behind = std::nullopt) {
    NodeContext context = ContextOnBus(&player_port_, &now_ns_, "player");
    context.fresh_system = true;
    PlayerOptions options;
    options.sequence = "rtsp://user:secret@robot/stream";
    options.session = 9;
    options.camera = {.width_px = 64, .height_px = 48, .fx_px = 60, .fy_px = 60, .cx_px = 32, .cy_px = 24};
    options.frames = frames;
    options.behind = behind;
    options.encoding.encoding = FrameEncoding::kGray8;
    return LiveNode(std::move(context), options, std::make_unique<FakeCamera>(&store_));
  }
  void Advance(LiveNode& node, int64_t by_ns = 10'000'000) {
    now_ns_ += by_ns;
    node.Advance();
    DeliverAll(bus_);
  }
  template <typename Message>
  void Say(const Message& message) {
    dmslam::Say(ear_, message);
    DeliverAll(bus_);
  }

  /// Frames .06 s apart, each of which the frontend answers with what it has done already.
  void PlayRefused(LiveNode& node, const FrameDone& done, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
      store_.frames = {Picture(static_cast<uint32_t>(frames_.size()), 100 + 100 * static_cast<int64_t>(i))};
      Advance(node, 60'000'000);
      Say(done);
    }
  }

  MemoryBus bus_;
  MemoryBus::Port& player_port_;
  MemoryBus::Port& ear_;
  int64_t now_ns_ = 1'000'000'000;
  Store store_;
  std::vector<Frame> frames_;
  std::vector<CameraInfo> infos_;
  std::vector<EndOfSequence> ends_;
  PlayerStatus status_;
};

TEST_F(LiveNodeTest, GoesOnBehindTheFramesOfARunThatDied) {
  LiveNode node = Make(1, 41);
  Advance(node);
  store_.frames = {Picture(2, 100)};
  for (int i = 0; i < 3; ++i) Advance(node);
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].frame_index, 44u);
  ASSERT_FALSE(ends_.empty());
  EXPECT_EQ(ends_[0].frames_published, 43) << "the 42 before it count";
}

TEST_F(LiveNodeTest, PublishesWhatComesUntilEnoughAndThenItsEnd) {
  LiveNode node = Make(2);
  Advance(node);
  ASSERT_EQ(infos_.size(), 1u);
  EXPECT_EQ(infos_[0].sequence, "robot/stream") << "no password travels";
  EXPECT_EQ(infos_[0].mode, PlaybackMode::kRealtime);
  EXPECT_TRUE(frames_.empty());
  store_.frames = {Picture(0, 100), Picture(4, 200), Picture(5, 300)};
  for (int i = 0; i < 4; ++i) Advance(node);
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_EQ(frames_[0].session, 9u);
  EXPECT_EQ(frames_[0].frame_index, 0u);
  EXPECT_EQ(frames_[1].frame_index, 4u) << "the index counts what the camera delivered";
  EXPECT_EQ(frames_[1].stamp_ns, 200);
  EXPECT_EQ(frames_[1].data, std::vector<uint8_t>(32, 4));
  ASSERT_FALSE(ends_.empty());
  EXPECT_EQ(ends_[0].frames_published, 2);
  EXPECT_EQ(ends_[0].frames_missing, 3);
  EXPECT_EQ(ends_[0].last_frame_index, 4);
  EXPECT_FALSE(node.exit_code().has_value());
  Say(SequenceDone{0, 9});
  Advance(node, 6'000'000'000);  // no mapper says anything
  EXPECT_EQ(node.exit_code(), 0);
}

/// One forged message: the player is neither ended by it nor sent to the end of what a session can hold.
TEST_F(LiveNodeTest, OneForgedAnswerChangesNothing) {
  LiveNode node = Make();
  Advance(node);
  store_.frames = {Picture(0, 100)};
  Advance(node);
  ASSERT_EQ(frames_.size(), 1u);
  Say(FrameDone{9, frames_[0].frame_index, frames_[0].stamp_ns});
  Say(FrameDone{9, 1'000'000, 3'600'000'000'000});
  Say(SequenceDone{0, 9});
  store_.frames = {Picture(1, 200)};
  Advance(node);
  ASSERT_EQ(frames_.size(), 2u);
  EXPECT_EQ(frames_[1].frame_index, 1u);
  EXPECT_EQ(frames_[1].stamp_ns, 200);
  EXPECT_TRUE(ends_.empty());
  Advance(node, 200'000'000);
  Say(SequenceDone{0, 9});  // a frontend that has ended says it for every frame
  Advance(node);
  EXPECT_FALSE(ends_.empty());
}

TEST_F(LiveNodeTest, EndsWithItsCamera) {
  LiveNode node = Make();
  store_.frames = {Picture(0, 100)};
  store_.ended = true;
  for (int i = 0; i < 3; ++i) Advance(node);
  EXPECT_EQ(frames_.size(), 1u);
  EXPECT_FALSE(ends_.empty());
  Advance(node, 61'000'000'000);
  EXPECT_EQ(node.exit_code(), 5) << "nobody has heard it";
  EXPECT_NE(node.problem().find("no frontend"), std::string::npos);
}

TEST_F(LiveNodeTest, WaitsAsLongAsItsFrontendIsAlive) {
  LiveNode node = Make();
  store_.frames = {Picture(0, 100)};
  store_.ended = true;
  FrontendStatus status;
  status.head.session = 9;
  for (int i = 0; i < 200; ++i) {
    Advance(node, 1'000'000'000);
    Say(status);
  }
  EXPECT_FALSE(node.exit_code().has_value()) << "it finds the last poses of a long sequence";
  status.head.session = 8;
  for (int i = 0; i < 70; ++i) {
    Advance(node, 1'000'000'000);
    Say(status);
  }
  EXPECT_EQ(node.exit_code(), 5) << "another session's is nobody";
}

TEST_F(LiveNodeTest, ToldToStopItSaysTheEndAndDoesNotWaitLong) {
  LiveNode node = Make();
  store_.frames = {Picture(0, 100)};
  Advance(node);
  node.Stop();
  Advance(node);
  EXPECT_FALSE(ends_.empty());
  EXPECT_FALSE(node.exit_code().has_value());
  Advance(node, 3'000'000'000);
  EXPECT_EQ(node.exit_code(), 0);
}

/// The frontend is further, and says so to each frame that it refuses.
TEST_F(LiveNodeTest, StartedAgainItGoesOnBehindTheFramesBefore) {
  LiveNode node = Make();
  Advance(node);
  PlayRefused(node, {9, 41, 0}, 4);
  Say(FrameDone{8, 500, 0});  // another session
  store_.frames = {Picture(4, 500)};
  Advance(node);
  ASSERT_EQ(frames_.size(), 5u);
  EXPECT_EQ(frames_[4].frame_index, 46u) << "the number counts what the camera delivered";
}

TEST_F(LiveNodeTest, StartedAgainOnAClockThatIsBehindItDoesNotGoBackInTime) {
  LiveNode node = Make();
  Advance(node);
  PlayRefused(node, {9, 41, 60'000'000'000}, 4);
  store_.frames = {Picture(4, 1'000'000'000), Picture(5, 1'100'000'000)};
  Advance(node);
  Advance(node);
  ASSERT_EQ(frames_.size(), 6u);
  EXPECT_GT(frames_[4].stamp_ns, 60'000'000'000);
  EXPECT_LT(frames_[4].stamp_ns, 60'100'000'000);
  EXPECT_EQ(frames_[5].stamp_ns - frames_[4].stamp_ns, 100'000'000)
      << "what passed between frames stays as it was";
}

/// What is said before it has played anything, or once, or among true answers, leads it nowhere.
TEST_F(LiveNodeTest, OneForgedAnswerToAPlayerThatBeginsChangesNothing) {
  LiveNode node = Make();
  Advance(node);
  Say(SequenceDone{0, 9});
  Say(FrameDone{9, 1'000'000, 3'600'000'000'000});
  store_.frames = {Picture(0, 100)};
  Advance(node);
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_[0].frame_index, 0u);
  Say(FrameDone{9, 1'000'000, 3'600'000'000'000});
  PlayRefused(node, {9, 41, 2'000'000}, 4);
  store_.frames = {Picture(5, 3'000'000)};
  Advance(node);
  EXPECT_EQ(frames_.back().frame_index, 47u) << "behind what the frontend has said";
  EXPECT_LT(frames_.back().stamp_ns, 1'000'000'000) << "not an hour ahead";
  EXPECT_TRUE(ends_.empty());
}

TEST_F(LiveNodeTest, SaysThatTheCameraIsAwayAndWaits) {
  LiveNode node = Make();
  store_.frames = {Picture(0, 100)};
  Advance(node);
  store_.away = "/dev/video0: delivers no more frames";
  Advance(node, 2'000'000'000);
  Advance(node, 2'000'000'000);
  EXPECT_EQ(status_.head.reason, "the camera is away");
  EXPECT_TRUE(ends_.empty());
  EXPECT_FALSE(node.exit_code().has_value());
  store_.away.clear();
  store_.frames = {Picture(1, 300)};
  Advance(node, 2'000'000'000);
  EXPECT_EQ(frames_.size(), 2u);
  EXPECT_EQ(status_.head.reason, "");
}

}  // namespace
}  // namespace dmslam
