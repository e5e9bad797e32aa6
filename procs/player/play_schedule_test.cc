#include "player/play_schedule.h"

#include <gtest/gtest.h>

#include <string>

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

/// Ten frames, 100 ms apart, of a recording that numbers them from 20.
class TenFrames : public FrameSource {
 public:
  size_t size() const override { return 10; }
  int64_t StampNs(size_t index) const override { return 7 * kMs + static_cast<int64_t>(index) * 100 * kMs; }
  std::string Name(size_t index) const override { return std::to_string(index); }
  EncodedImage Read(size_t) override { return {}; }
  uint32_t FrameIndex(size_t index) const override { return 20 + static_cast<uint32_t>(index); }
};

/// Frames 2, 3, 6 and 7: 4 and 5 are left out.
class PlayScheduleTest : public testing::Test {
 protected:
  PlaySchedule Make(double speed) const { return {&frames_, {2, 3, 6, 7}, speed}; }

  TenFrames frames_;
};

TEST_F(PlayScheduleTest, FramesAreDueAtTheRecordedRateFromTheFirstOn) {
  PlaySchedule schedule = Make(2.0);
  schedule.MakeDue(1000 * kMs);
  EXPECT_FALSE(schedule.IsDue(999 * kMs));
  EXPECT_TRUE(schedule.IsDue(1000 * kMs));
  EXPECT_EQ(schedule.Take(1004 * kMs), 2u);
  EXPECT_DOUBLE_EQ(schedule.late_ms(), 4.0);
  EXPECT_EQ(schedule.due_ns(), 1050 * kMs);
  EXPECT_EQ(schedule.Take(1050 * kMs), 3u);
  EXPECT_DOUBLE_EQ(schedule.late_ms(), 0.0);
  EXPECT_EQ(schedule.due_ns(), 1200 * kMs) << "what is left out takes its time";
  EXPECT_EQ(schedule.Take(1200 * kMs), 6u);
  EXPECT_EQ(schedule.last(), 6u);
  EXPECT_EQ(schedule.Take(1250 * kMs), 7u);
  EXPECT_TRUE(schedule.IsOver());
  EXPECT_FALSE(schedule.IsDue(2000 * kMs));
}

TEST_F(PlayScheduleTest, WithoutASpeedEachIsDueAtOnce) {
  PlaySchedule schedule = Make(0.0);
  schedule.MakeDue(1000 * kMs);
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(schedule.IsDue(1000 * kMs));
    schedule.Take(1000 * kMs);
  }
  EXPECT_TRUE(schedule.IsOver());
}

TEST_F(PlayScheduleTest, WhatWasHeldBackIsDueWhenItNeedNotWaitAnyMore) {
  PlaySchedule schedule = Make(1.0);
  schedule.MakeDue(1000 * kMs);
  schedule.MakeDueNoEarlier(900 * kMs);
  EXPECT_EQ(schedule.due_ns(), 1000 * kMs);
  schedule.MakeDueNoEarlier(3000 * kMs);
  EXPECT_EQ(schedule.due_ns(), 3000 * kMs);
  schedule.Take(3000 * kMs);
  EXPECT_EQ(schedule.due_ns(), 3100 * kMs) << "the others follow at their distance";
}

TEST_F(PlayScheduleTest, GoesOnBehindAFrameAndIsDueFromThereOn) {
  PlaySchedule schedule = Make(1.0);
  EXPECT_EQ(schedule.PositionBehind(21), 0u);
  EXPECT_EQ(schedule.PositionBehind(22), 1u);
  EXPECT_EQ(schedule.PositionBehind(25), 2u) << "one that is left out";
  EXPECT_EQ(schedule.PositionBehind(40), 4u);
  schedule.GoTo(schedule.PositionBehind(23));
  schedule.MakeDue(0);
  EXPECT_EQ(schedule.position(), 2u);
  EXPECT_EQ(schedule.last(), 3u);
  schedule.MakeDue(500 * kMs);
  EXPECT_EQ(schedule.due_ns(), 500 * kMs);
  EXPECT_EQ(schedule.Take(500 * kMs), 6u);
  EXPECT_EQ(schedule.due_ns(), 600 * kMs);
}

TEST_F(PlayScheduleTest, WhereAllHaveHadTheirTurnNothingIsMadeDue) {
  PlaySchedule schedule = Make(1.0);
  EXPECT_EQ(schedule.last(), 2u) << "of none the first";
  schedule.GoTo(schedule.size());
  EXPECT_TRUE(schedule.IsOver());
  schedule.MakeDue(500 * kMs);
  schedule.MakeDueNoEarlier(900 * kMs);
  EXPECT_FALSE(schedule.IsDue(1000 * kMs));
  EXPECT_EQ(schedule.last(), 7u);
}

}  // namespace
}  // namespace dmslam
