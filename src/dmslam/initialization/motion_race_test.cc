#include "dmslam/initialization/motion_race.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

/// A motion to the right, or turned from there by an angle.
Rigid3d Motion(double direction_rad) {
  return Rigid3d(Eigen::Quaterniond::Identity(), {std::cos(direction_rad), std::sin(direction_rad), 0});
}

/// A map under this motion, and what it costs the views.
CandidateMap Costing(double cost, double direction_rad = 0) {
  CandidateMap candidate;
  candidate.placed.push_back({nullptr, Motion(direction_rad)});
  candidate.cost = cost;
  return candidate;
}

class MotionRaceTest : public ::testing::Test {
 protected:
  /// Whether a motion wins that costs so much, beside one that costs so many times as much.
  bool Wins(double cost, double rival_ratio) const {
    MotionRace race;
    race.Enter(Costing(cost));
    race.best->rival_ratio = rival_ratio;
    Refused refused;
    const bool wins = MotionSearch(options_, TestCamera(), 1, builder_).WinnerOf(race, &refused).has_value();
    EXPECT_EQ(wins, refused.wait == WaitReason::kNone);
    return wins;
  }

  InitializerOptions options_;
  CandidateBuilder builder_{options_, TestCamera(), {}};
};

TEST_F(MotionRaceTest, TheMotionThatCostsLeastIsBestAndTheNextIsAnother) {
  MotionRace race;
  race.Enter(Costing(0.05, 1.0));
  race.Enter(Costing(0.03, 2.0));
  race.Enter(Costing(0.01));
  race.Enter(Costing(0.04, 3.0));
  EXPECT_EQ(race.best->cost, 0.01);
  EXPECT_EQ(race.runner_up->cost, 0.03);
}

TEST_F(MotionRaceTest, OneThatIsFoundTwiceIsNoRivalOfItself) {
  MotionRace race;
  race.Enter(Costing(0.02));
  race.Enter(Costing(0.01, 0.05));
  race.Enter(Costing(0.015, 0.02));
  EXPECT_EQ(race.best->cost, 0.01);
  EXPECT_FALSE(race.runner_up);
  EXPECT_TRUE(race.HasRun(Motion(0.01)));
  EXPECT_FALSE(race.HasRun(Motion(0.5)));
}

TEST_F(MotionRaceTest, WhereTwoMotionsCostAboutTheSameNobodyWins) {
  EXPECT_FALSE(Wins(0.01, 1.29));
  EXPECT_TRUE(Wins(0.01, 1.3));
}

TEST_F(MotionRaceTest, AMotionThatExplainsNotAllViewsWellDoesNotWin) {
  EXPECT_TRUE(Wins(0.1, 2.0));
  EXPECT_FALSE(Wins(0.11, 2.0));
  EXPECT_TRUE(Wins(0.2, 3.0)) << "more is allowed where no other comes near";
  EXPECT_FALSE(Wins(0.21, 3.0));
}

}  // namespace
}  // namespace dmslam
