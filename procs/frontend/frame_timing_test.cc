#include "frontend/frame_timing.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

FrontendStatus TakeStatus(FrameTiming* timing) {
  FrontendStatus status;
  timing->TakeStatus(&status);
  return status;
}

TEST(FrameTimingTest, TellsHowLongEachStepTook) {
  FrameTiming timing;
  FrameTrace trace;
  trace.publish_us = 1'000;
  trace.begin_us = 4'000;
  trace.decoded_us = 6'000;
  trace.tracked_us = 26'000;
  trace.published_us = 31'000;
  timing.Add(trace, 12);
  const FrontendStatus status = TakeStatus(&timing);
  EXPECT_DOUBLE_EQ(status.latency_p50_ms, 30);
  EXPECT_DOUBLE_EQ(status.latency_p95_ms, 30);
  EXPECT_DOUBLE_EQ(status.latency_p99_ms, 30);
  EXPECT_DOUBLE_EQ(status.decode_ms, 2);
  EXPECT_DOUBLE_EQ(status.extract_ms, 12);
  EXPECT_DOUBLE_EQ(status.step_ms, 22);
  EXPECT_DOUBLE_EQ(status.step_p95_ms, 22);
  EXPECT_DOUBLE_EQ(status.track_ms, 8) << "what is left of the step";
}

TEST(FrameTimingTest, TheRateIsThatSinceTheLastStatus) {
  FrameTiming timing;
  EXPECT_EQ(TakeStatus(&timing).frames_processed, 0);
  for (int i = 0; i < 3; ++i) timing.Add(FrameTrace(), 0);
  EXPECT_EQ(TakeStatus(&timing).fps, 3);
  for (int i = 0; i < 2; ++i) timing.Add(FrameTrace(), 0);
  const FrontendStatus status = TakeStatus(&timing);
  EXPECT_EQ(status.fps, 2);
  EXPECT_EQ(status.frames_processed, 5);
  EXPECT_EQ(timing.frames(), 5);
  EXPECT_EQ(TakeStatus(&timing).fps, 0);
}

}  // namespace
}  // namespace dmslam
