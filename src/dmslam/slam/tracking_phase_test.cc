#include "dmslam/slam/tracking_phase.h"

#include <gtest/gtest.h>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

TEST(TrackingPhaseTest, GoesFromSearchToTracking) {
  TrackingPhase phase;
  EXPECT_EQ(phase.state(), TrackingState::kNotInitialized);
  const KeyframeId second = KeyframeId::Make(1, 7);
  phase.Propose(second);
  EXPECT_EQ(phase.state(), TrackingState::kWaitingForMap);
  EXPECT_EQ(phase.awaited_second(), second);
  EXPECT_FALSE(phase.HasMap());
  phase.BeginTrial(1000);
  EXPECT_EQ(phase.state(), TrackingState::kTrial);
  phase.OnTracked(999);
  EXPECT_EQ(phase.state(), TrackingState::kTrial);
  phase.OnTracked(1000);
  EXPECT_EQ(phase.state(), TrackingState::kTracking);
  phase.GiveUpMap();
  EXPECT_TRUE(phase.IsSearching());
}

TEST(TrackingPhaseTest, IsLostAfterAThirdOfASecond) {
  TrackingPhase phase;
  phase.BeginLost();
  phase.OnTracked(0);
  phase.OnMissing(100'000'000);
  EXPECT_EQ(phase.state(), TrackingState::kMissing);
  phase.OnMissing(340'000'000);
  EXPECT_EQ(phase.state(), TrackingState::kLost);
  phase.OnTracked(0);
  EXPECT_EQ(phase.state(), TrackingState::kTracking);
}

TEST(TrackingPhaseTest, ImpossibleStepsAreRefused) {
  TrackingPhase phase;
  EXPECT_THROW(phase.BeginTrial(0), InvariantError);
  EXPECT_THROW(phase.OnTracked(0), InvariantError);
  phase.Propose(KeyframeId::Make(1, 1));
  EXPECT_THROW(phase.Propose(KeyframeId::Make(1, 2)), InvariantError);
  phase.GiveUpMap();
  EXPECT_THROW(phase.OnMissing(1), InvariantError);
}

}  // namespace
}  // namespace dmslam
