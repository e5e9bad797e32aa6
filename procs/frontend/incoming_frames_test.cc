#include "frontend/incoming_frames.h"

#include <gtest/gtest.h>

#include "frontend/camera_turns.h"

namespace dmslam {
namespace {

using Verdict = IncomingFrames::Verdict;

constexpr int64_t kMs = 1'000'000;

ReceivedFrame At(uint32_t index, int64_t stamp_ns) {
  ReceivedFrame received;
  received.frame.frame_index = index;
  received.frame.stamp_ns = stamp_ns;
  return received;
}
/// Of 10 Hz.
ReceivedFrame At(uint32_t index) { return At(index, index * 100 * kMs); }

FrontendStatus StatusOf(const IncomingFrames& frames) {
  FrontendStatus status;
  frames.Fill(&status);
  return status;
}

TEST(IncomingFramesTest, ANewerOneTakesThePlaceOfTheOneThatWaits) {
  IncomingFrames frames;
  EXPECT_FALSE(StatusOf(frames).frame_index);
  for (uint32_t index : {0, 1, 2}) EXPECT_EQ(frames.Hear(At(index), 0), Verdict::kWaits);
  EXPECT_EQ(frames.Hear(At(2), 0), Verdict::kKnown);
  EXPECT_EQ(frames.Take().frame.frame_index, 2U);
  EXPECT_FALSE(frames.waiting());
  EXPECT_EQ(StatusOf(frames).frames_received, 3);
  EXPECT_EQ(StatusOf(frames).frames_skipped, 2);
  EXPECT_EQ(StatusOf(frames).frame_index, 2);
}

TEST(IncomingFramesTest, InRealTimeThoseOfATenthOfASecondWaitInOrder) {
  IncomingFrames frames;
  for (uint32_t index = 0; index < 4; ++index) frames.Hear(At(index, index * 33 * kMs), 0);
  EXPECT_EQ(frames.Hear(At(2, 2 * 33 * kMs), 0), Verdict::kKnown);
  for (uint32_t index = 0; index < 4; ++index) EXPECT_EQ(frames.Take().frame.frame_index, index);
  EXPECT_EQ(StatusOf(frames).frames_skipped, 0);
}

TEST(IncomingFramesTest, InRealTimeTheNewestIsLeftOfMore) {
  IncomingFrames frames;
  for (uint32_t index = 0; index < 5; ++index) frames.Hear(At(index, index * 33 * kMs), 0);
  EXPECT_EQ(frames.Take().frame.frame_index, 4U);
  EXPECT_FALSE(frames.waiting());
  EXPECT_EQ(StatusOf(frames).frames_skipped, 4);
}

TEST(IncomingFramesTest, InRealTimeNoneThatWaitsGoesBack) {
  IncomingFrames frames;
  frames.Hear(At(9, 500 * kMs), 0);
  frames.Hear(At(3, 33 * kMs), 0);  // nobody knows yet which of the two is right
  EXPECT_EQ(frames.Take().frame.frame_index, 3U);
  EXPECT_FALSE(frames.waiting());
  frames.Hear(At(6, 66 * kMs), 0);
  EXPECT_EQ(frames.Hear(At(5, 70 * kMs), 0), Verdict::kKnown);
  EXPECT_EQ(frames.Hear(At(7, 60 * kMs), 0), Verdict::kKnown);
  EXPECT_EQ(frames.Take().frame.frame_index, 6U);
  EXPECT_FALSE(frames.waiting());
}

TEST(IncomingFramesTest, InLockstepOneWaits) {
  IncomingFrames frames;
  frames.SetMode(PlaybackMode::kLockstep);
  frames.Hear(At(0, 0), 0);
  frames.Hear(At(1, kMs), 0);
  EXPECT_EQ(frames.Take().frame.frame_index, 1U);
  EXPECT_FALSE(frames.waiting());
}

TEST(IncomingFramesTest, ARepeatIsAnsweredWhenTheNewestIsSettled) {
  IncomingFrames frames;
  frames.SetMode(PlaybackMode::kLockstep);
  frames.Hear(At(3), 0);
  frames.Take();
  EXPECT_TRUE(frames.in_work());
  EXPECT_EQ(frames.Hear(At(3), 0), Verdict::kKnown);
  frames.Settle();
  EXPECT_EQ(frames.Hear(At(3), 0), Verdict::kOld);
  EXPECT_EQ(frames.Hear(At(2), 0), Verdict::kOld);
  EXPECT_FALSE(frames.IsNew(At(3).frame));
  EXPECT_TRUE(frames.IsNew(At(4).frame));
  EXPECT_FALSE(frames.waiting());
}

TEST(IncomingFramesTest, InRealTimeNoFrameIsTakenWhoseStampDoesNotIncrease) {
  for (const PlaybackMode mode : {PlaybackMode::kRealtime, PlaybackMode::kLockstep}) {
    IncomingFrames frames;
    frames.SetMode(mode);
    frames.Hear(At(3), 0);
    const int64_t stamp_ns = frames.Take().frame.stamp_ns;
    frames.Settle();
    EXPECT_EQ(frames.Hear(At(4, stamp_ns), 0),
              mode == PlaybackMode::kRealtime ? Verdict::kOld : Verdict::kWaits);
  }
}

TEST(IncomingFramesTest, ANumberBeyondWhatASessionCanHoldIsRefused) {
  IncomingFrames frames;
  EXPECT_EQ(frames.Hear(At(CameraTurns::kTheEnd, 0), 0), Verdict::kOutOfRange);
  EXPECT_EQ(frames.Hear(At(CameraTurns::kTheEnd - 1, 0), 0), Verdict::kWaits);
}

TEST(IncomingFramesTest, OneFarAheadWaitsWhenOthersGoOnThere) {
  IncomingFrames frames;
  frames.Hear(At(0), 0);
  frames.Take();
  frames.Settle();
  EXPECT_EQ(frames.Hear(At(5000), 0), Verdict::kFarAhead);
  EXPECT_EQ(frames.Hear(At(5001), 50 * kMs), Verdict::kFarAhead);
  EXPECT_EQ(frames.Hear(At(5002), 100 * kMs), Verdict::kWaits);
  EXPECT_EQ(StatusOf(frames).frames_received, 2);
}

/// Nothing can contradict a leap while the player waits.
TEST(IncomingFramesTest, InLockstepNoLeapIsBelievedWhileOneIsInWork) {
  for (const PlaybackMode mode : {PlaybackMode::kRealtime, PlaybackMode::kLockstep}) {
    IncomingFrames frames;
    frames.SetMode(mode);
    frames.Hear(At(0), 0);
    frames.Take();
    frames.Hear(At(5000), 0);
    EXPECT_EQ(frames.Hear(At(5001), 100 * kMs),
              mode == PlaybackMode::kRealtime ? Verdict::kWaits : Verdict::kFarAhead);
  }
}

TEST(IncomingFramesTest, AFrameTakesTheEndBack) {
  IncomingFrames frames;
  const auto say_end = [&](int64_t now_ns) { frames.OnEnd(EndOfSequence(), now_ns); };
  frames.Hear(At(0), 0);
  say_end(0);
  frames.Hear(At(0), 50 * kMs);
  say_end(100 * kMs);
  EXPECT_FALSE(frames.IsOver(100 * kMs));
  say_end(200 * kMs);
  EXPECT_TRUE(frames.IsOver(200 * kMs));
}

TEST(IncomingFramesTest, GoesOnBehindWhatAFrontendBeforeItHad) {
  IncomingFrames frames;
  frames.Hear(At(4), 0);
  frames.GoOnBehind(7);
  EXPECT_FALSE(frames.waiting()) << "the player begins from the front";
  EXPECT_EQ(frames.Hear(At(7), 0), Verdict::kOld);
  EXPECT_EQ(frames.Hear(At(5000), 0), Verdict::kWaits) << "no stamp tells that it is far ahead";
  frames.GoOnBehind(8);
  EXPECT_TRUE(frames.waiting());
}

}  // namespace
}  // namespace dmslam
