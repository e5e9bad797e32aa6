#include "mapper/frontend_streams.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/runtime/testing/node_on_bus.h"
#include "dmslam/wire/channels.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr uint32_t kSession = 4;
constexpr int64_t kEpoch = 1000;

/// Frontends of two cameras.
class FrontendStreamsTest : public testing::Test {
 protected:
  FrontendStreamsTest() {
    for (const CameraId camera : {0, 1}) {
      auto reader =
          std::make_unique<StreamReader>(ReaderOfRole(kSession, StreamId::kFrontend, "frontend", "mapper"));
      readers_.push_back(reader.get());
      streams_.Add(std::move(reader));
      Begin(camera, kEpoch + camera);
    }
  }
  /// A frontend of that camera begins, in place of the one before.
  void Begin(CameraId camera, int64_t epoch) {
    writers_.resize(2);
    writers_[camera] = std::make_unique<StreamWriter>(
        WriterOfRole(kSession, StreamId::kFrontend, "frontend", "mapper"), Term{epoch, 5}, Version{});
  }
  void Say(CameraId camera, int count = 1) {
    TurnRequest request;
    request.camera_id = camera;
    const std::string channel = ChannelOfCamera(channels::kTurnRequest, camera);
    for (int i = 0; i < count; ++i) writers_[camera]->Publish(channel, wire::Encode(request), now_ns_);
  }
  /// Writers and readers hear each other for half a second.
  void Run() {
    for (int step = 0; step < 100; ++step) {
      for (const CameraId camera : {0, 1}) {
        if (writers_[camera]) Exchange(writers_[camera].get(), readers_[camera]);
        readers_[camera]->Advance(now_ns_);
        for (const Outgoing& said : readers_[camera]->TakeOutgoing())
          if (writers_[camera]) writers_[camera]->Receive(said.channel, *said.bytes, now_ns_);
      }
      now_ns_ += 5 * kMs;
    }
  }
  void Exchange(StreamWriter* writer, StreamReader* reader) const {
    writer->Advance(now_ns_);
    for (const Outgoing& said : writer->TakeOutgoing())
      if (!said.local) reader->Receive(said.channel, *said.bytes, now_ns_);
  }
  /// The number of the next record of a camera.
  std::optional<int64_t> Next(CameraId camera) {
    const auto record = streams_.Take(camera, [](const Record&, StreamReader*) { return false; });
    return record ? std::optional(record->version().seq) : std::nullopt;
  }

  int64_t now_ns_ = kMs;
  std::vector<StreamReader*> readers_;
  std::vector<std::unique_ptr<StreamWriter>> writers_;
  FrontendStreams streams_;
};

TEST_F(FrontendStreamsTest, WhatTheMapHoldsIsAcceptedAndNotHandedOut) {
  streams_.BeginWith(1, {kEpoch + 1, 2});
  for (const CameraId camera : {0, 1}) Say(camera, 3);
  Run();
  EXPECT_EQ(Next(0), 1);
  EXPECT_EQ(readers_[0]->accepted(), Version{}) << "not before its effect is safe";
  EXPECT_EQ(Next(1), 3);
  EXPECT_EQ(readers_[1]->accepted(), (Version{kEpoch + 1, 2}));
  EXPECT_EQ(Next(1), std::nullopt);
  streams_.Accept(1, {kEpoch + 1, 3});
  EXPECT_EQ(readers_[1]->accepted(), (Version{kEpoch + 1, 3}));
}

TEST_F(FrontendStreamsTest, ATermBeforeTheOneOfWhichTheMapHoldsSomethingIsNew) {
  streams_.BeginWith(0, {kEpoch + 7, 2});
  Say(0);
  Run();
  EXPECT_EQ(Next(0), 1);
}

TEST_F(FrontendStreamsTest, ChannelsAreCalledAsWithOneCamera) {
  Say(1);
  Run();
  const auto record = streams_.Take(1, [](const Record&, StreamReader*) { return false; });
  ASSERT_TRUE(record);
  EXPECT_EQ(record->channel, channels::kTurnRequest);
}

TEST_F(FrontendStreamsTest, WhatIsDoubtfulIsNotHandedOut) {
  Say(0, 2);
  Run();
  int asked = 0;
  const auto doubt = [&](const Record& record, StreamReader* reader) {
    ++asked;
    EXPECT_EQ(reader, readers_[0]);
    EXPECT_EQ(record.version().seq, 1);
    return true;
  };
  EXPECT_FALSE(streams_.Take(0, doubt));
  EXPECT_EQ(asked, 1) << "it is what is next, and nothing after it";
}

TEST_F(FrontendStreamsTest, TheLargestBacklogCounts) {
  Say(0, 3);
  Say(1, 5);
  Run();
  EXPECT_EQ(streams_.LargestBacklog(), 5U);
  EXPECT_EQ(Next(1), 1);
  EXPECT_EQ(Next(1), 2);
  EXPECT_EQ(Next(1), 3);
  EXPECT_EQ(streams_.LargestBacklog(), 3U);
}

TEST_F(FrontendStreamsTest, AllAreGoneWhenTheLastOneIs) {
  Say(0);
  Run();
  EXPECT_FALSE(streams_.AllAreGone(now_ns_));
  EXPECT_EQ(streams_.Epoch(0), kEpoch);
  EXPECT_EQ(streams_.Epoch(1), kEpoch + 1);
  writers_[0].reset();
  for (int i = 0; i < 3; ++i) Run();
  EXPECT_FALSE(streams_.AllAreGone(now_ns_));
  writers_[1].reset();
  for (int i = 0; i < 3; ++i) Run();
  EXPECT_TRUE(streams_.AllAreGone(now_ns_));
}

TEST_F(FrontendStreamsTest, EachEndsForItself) {
  for (const CameraId camera : {0, 1}) Say(camera, 2);
  Run();
  writers_[0]->Complete(now_ns_);
  Run();
  EXPECT_FALSE(streams_.HasEnded(0)) << "what it said is not taken";
  streams_.AcceptUnread();
  Run();
  EXPECT_TRUE(streams_.HasEnded(0));
  EXPECT_FALSE(streams_.HasEnded(1));
  EXPECT_FALSE(streams_.AllHaveEnded());
  EXPECT_EQ(readers_[1]->accepted(), (Version{kEpoch + 1, 2})) << "nobody is left waiting";
  writers_[1]->Complete(now_ns_);
  Run();
  EXPECT_TRUE(streams_.AllHaveEnded());
}

}  // namespace
}  // namespace dmslam
