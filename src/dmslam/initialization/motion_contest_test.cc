#include "dmslam/initialization/motion_contest.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace dmslam {
namespace {

constexpr double kDiagonal = 800;

/// A view with a grid of matches over 640x480, and motions that explain a part of them.
class Contest {
 public:
  Contest() {
    for (int y = 10; y < 480; y += 20) {
      for (int x = 10; x < 640; x += 20) {
        Match match;
        match.index0 = static_cast<uint32_t>(view_.pair.matches.size());
        match.uv0_px = {x, y};
        view_.pair.matches.push_back(match);
      }
    }
  }
  /// Explains the matches between these columns [px].
  void Add(double left, double right) {
    Contender contender;
    contender.candidate.placed.push_back({&view_, Rigid3d(), 1.0});
    for (const Match& match : view_.pair.matches) {
      contender.support.push_back(match.uv0_px.x() >= left && match.uv0_px.x() < right ? 1 : 0);
    }
    contenders_.push_back(std::move(contender));
  }
  ContestResult Decide() { return DecideContest(std::move(contenders_), ContestOptions(), kDiagonal); }

 private:
  ReferenceView view_;
  std::vector<Contender> contenders_;
};

TEST(DecideContest, TheWidestWins) {
  Contest contest;
  contest.Add(0, 150);
  contest.Add(150, 640);
  const ContestResult result = contest.Decide();
  ASSERT_TRUE(result.winner.has_value()) << result.refused.text;
  EXPECT_EQ(result.winner->support.back(), 1);
  EXPECT_LT(result.rival_share, 0.3);
}

TEST(DecideContest, NobodyWinsWhereTwoAreAboutAsWide) {
  Contest contest;
  contest.Add(0, 300);
  contest.Add(300, 640);
  const ContestResult result = contest.Decide();
  EXPECT_FALSE(result.winner.has_value());
  EXPECT_EQ(result.refused.wait, WaitReason::kNoReconstruction);
  EXPECT_GT(result.rival_share, 0.5);
}

TEST(DecideContest, TheSameMotionTwiceIsNoRival) {
  Contest contest;
  contest.Add(0, 640);
  contest.Add(20, 640);
  EXPECT_TRUE(contest.Decide().winner.has_value());
}

TEST(DecideContest, WhatIsCompactDoesNotWin) {
  Contest contest;
  contest.Add(200, 240);
  const ContestResult result = contest.Decide();
  EXPECT_FALSE(result.winner.has_value());
  EXPECT_EQ(result.refused.wait, WaitReason::kDistributionTooSmall);
}

TEST(DecideContest, NoContenderNoWinner) {
  EXPECT_FALSE(DecideContest({}, {}, kDiagonal).winner.has_value());
}

}  // namespace
}  // namespace dmslam
