#include "player/end_of_play.h"

#include <gtest/gtest.h>

#include "dmslam/runtime/exit_codes.h"
#include "dmslam/wire/channels.h"

namespace dmslam {
namespace {

constexpr uint32_t kSession = 7;
constexpr int64_t kSecondNs = 1'000'000'000;

/// A player that has played all, on a clock that goes on as it is told to.
class EndOfPlayTest : public ::testing::Test {
 protected:
  void MapperSays(MapperStatus::State state, uint32_t session = kSession) {
    MapperStatus status;
    status.head.session = session;
    status.state = state;
    end_.OnStatus(channels::kMapperStatus, wire::Encode(status), kSession, now_ns_);
  }
  void FrontendSays(uint32_t session = kSession) {
    FrontendStatus status;
    status.head.session = session;
    end_.OnStatus(channels::kFrontendStatus, wire::Encode(status), kSession, now_ns_);
  }
  void Pass(double seconds) { now_ns_ += static_cast<int64_t>(seconds * 1e9); }
  std::optional<int> ExitCode(bool stopped = false) const { return end_.ExitCode(now_ns_, stopped); }

  EndOfPlay end_;
  int64_t now_ns_ = 5 * kSecondNs;
};

TEST_F(EndOfPlayTest, TheEndIsToldFiveTimesASecond) {
  EXPECT_FALSE(end_.WasSaid());
  EXPECT_TRUE(end_.IsDue(now_ns_));
  EXPECT_TRUE(end_.WasSaid());
  EXPECT_EQ(end_.due_ns(), now_ns_ + kSecondNs / 5);
  Pass(0.19);
  EXPECT_FALSE(end_.IsDue(now_ns_));
  Pass(0.02);
  EXPECT_TRUE(end_.IsDue(now_ns_));
}

TEST_F(EndOfPlayTest, OnceHeardItStaysUntilTheMapIsDone) {
  end_.IsDue(now_ns_);
  EXPECT_TRUE(end_.OnSequenceDone(now_ns_)) << "it is an answer to what was said";
  MapperSays(MapperStatus::State::kMapping);
  Pass(4);
  EXPECT_EQ(ExitCode(), std::nullopt);
  MapperSays(MapperStatus::State::kDone, kSession + 1);
  EXPECT_EQ(ExitCode(), std::nullopt) << "the mapper of another run";
  MapperSays(MapperStatus::State::kDone);
  EXPECT_EQ(ExitCode(), 0);
}

TEST_F(EndOfPlayTest, ForAMapperThatIsSilentItWaitsFiveSeconds) {
  end_.IsDue(now_ns_);
  end_.OnSequenceDone(now_ns_);
  Pass(4.9);
  EXPECT_EQ(ExitCode(), std::nullopt);
  MapperSays(MapperStatus::State::kMapping);
  Pass(4.9);
  EXPECT_EQ(ExitCode(), std::nullopt) << "it spoke meanwhile";
  Pass(0.2);
  EXPECT_EQ(ExitCode(), 0);
}

TEST_F(EndOfPlayTest, WithoutAFrontendItEndsWithAnErrorAfterAMinute) {
  end_.IsDue(now_ns_);
  Pass(50);
  FrontendSays();
  Pass(59);
  EXPECT_EQ(ExitCode(), std::nullopt) << "it may still be tracking";
  FrontendSays(kSession + 1);
  Pass(2);
  EXPECT_EQ(ExitCode(), kExitNoFrontend) << "that of another run does not count";
}

TEST_F(EndOfPlayTest, AskedToStopItWaitsTwoSecondsForAFrontend) {
  end_.IsDue(now_ns_);
  Pass(1.9);
  EXPECT_EQ(ExitCode(true), std::nullopt);
  Pass(0.2);
  EXPECT_EQ(ExitCode(true), 0);
  EXPECT_EQ(ExitCode(), std::nullopt);
}

TEST_F(EndOfPlayTest, BeforeTheEndWasSaidAnAnswerIsBelievedWhenItIsRepeated) {
  EXPECT_FALSE(end_.OnSequenceDone(now_ns_)) << "it may be forged";
  Pass(0.1);
  end_.OnFrameDone();
  Pass(0.1);
  EXPECT_FALSE(end_.OnSequenceDone(now_ns_)) << "not all was done meanwhile";
  Pass(0.2);
  EXPECT_TRUE(end_.OnSequenceDone(now_ns_));
}

}  // namespace
}  // namespace dmslam
