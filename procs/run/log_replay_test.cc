#include "run/log_replay.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kSecondNs = 1'000'000'000;

TEST(LogReplayTest, PlaysTheCameraAtItsRateAndTheEndAtOnce) {
  const LogReplay replay = {"a.log", "udpm://239.255.76.67:20001?ttl=0", 0.5};
  EXPECT_EQ(PlayCamera(replay),
            (std::vector<std::string>{
                "lcm-logplayer", "-s", "0.500000", "-l", "udpm://239.255.76.67:20001?ttl=0", "-e",
                ".*DMSLAM_PLAYER_(CAMERA_INFO|FRAME|GROUND_TRUTH|END_OF_SEQUENCE)$", "a.log"}));
  const std::vector<std::string> end = PlayEnd(replay);
  EXPECT_EQ(end[2], "1000.000000");
  EXPECT_EQ(end[6], ".*DMSLAM_PLAYER_END_OF_SEQUENCE$");
}

TEST(ReplayEndTest, PlaysTheEndAgainUntilTheFrontendHasEnded) {
  ReplayEnd end;
  EXPECT_EQ(end.due_ns(), INT64_MAX) << "the log is still played";
  end.Begin(10 * kSecondNs);
  EXPECT_EQ(end.Next(10 * kSecondNs), ReplayEnd::Step::kNone);
  EXPECT_EQ(end.Next(end.due_ns()), ReplayEnd::Step::kPlayAgain);
  EXPECT_EQ(end.Next(end.due_ns()), ReplayEnd::Step::kPlayAgain);
  end.Finish();
  EXPECT_EQ(end.due_ns(), INT64_MAX);
}

TEST(ReplayEndTest, TellsAFrontendThatNeverHearsTheEndToFinish) {
  ReplayEnd end;
  end.Begin(0);
  int repeats = 0;
  while (end.Next(end.due_ns()) == ReplayEnd::Step::kPlayAgain) ++repeats;
  EXPECT_EQ(repeats, 14);
  EXPECT_EQ(end.due_ns(), INT64_MAX) << "once";
}

}  // namespace
}  // namespace dmslam
