#include "dmslam/dynamics/elders.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace dmslam {
namespace {

/// Each a hundredth of a second older than the one before.
std::vector<double> AgesS(size_t count) {
  std::vector<double> ages_s(count);
  std::iota(ages_s.begin(), ages_s.end(), 1.0);
  for (double& age : ages_s) age *= 0.01;
  return ages_s;
}

TEST(EldersTest, OfTooFewMatchesNobodyIsAnElder) {
  Elders elders({}, 4.0);
  EXPECT_FALSE(elders.FromAge(AgesS(40)));
  EXPECT_TRUE(elders.FromAge(AgesS(41)));
}

TEST(EldersTest, SwitchedOffNobodyIsAnElder) {
  Elders elders({.elders = false}, 4.0);
  EXPECT_FALSE(elders.FromAge(AgesS(300)));
}

TEST(EldersTest, TheOldestFortyOrFourTenthsAreElders) {
  Elders elders({}, 4.0);
  EXPECT_NEAR(*elders.FromAge(AgesS(60)), 0.20, 1e-9) << "beside the oldest 40 of 60";
  EXPECT_NEAR(*elders.FromAge(AgesS(300)), 1.80, 1e-9) << "beside the oldest 120 of 300";
}

TEST(EldersTest, WhoeverIsOlderThanPeopleStandIsOne) {
  Elders elders({}, 4.0);
  EXPECT_DOUBLE_EQ(*elders.FromAge(std::vector<double>(100, 60.0)), 4.0);
  EXPECT_TRUE(elders.AreTrusted(4.0));
  EXPECT_FALSE(elders.AreTrusted(3.9));
}

TEST(EldersTest, TheyDecideWhereMostOfThemAgree) {
  const Elders elders({}, 4.0);
  EXPECT_FALSE(elders.Decide(23, 40));
  EXPECT_TRUE(elders.Decide(24, 40));
}

TEST(EldersTest, TheyAreTornWhereOneMotionDoesNotExplainThem) {
  EXPECT_FALSE(Elders::AreTorn(kOneMotionChi2));
  EXPECT_TRUE(Elders::AreTorn(kOneMotionChi2 + 0.01));
}

TEST(EldersTest, AskedAgainTheyMustAgreeCloselyAndAllOfThemBeExplainedBetter) {
  const ElderFit first{2.0, 100.0};
  EXPECT_TRUE(Elders::SecondPoseCounts(first, {1.0, 99.0}));
  EXPECT_TRUE(Elders::SecondPoseCounts(first, {kOneMotionChi2, 99.0}));
  EXPECT_FALSE(Elders::SecondPoseCounts(first, {1.0, 100.0})) << "no better than the first";
  EXPECT_FALSE(Elders::SecondPoseCounts(first, {kOneMotionChi2 + 0.01, 50.0}))
      << "between two motions as well";
}

TEST(EldersTest, TheYoungRefineWhatAgreesAndNeverOutweighThem) {
  const Elders elders({}, 4.0);
  EXPECT_TRUE(elders.Admit(7.8));
  EXPECT_FALSE(elders.Admit(7.9));
  for (const int young : {100, 200, 1000}) EXPECT_LE(elders.YoungFactor(40, young) * young, 20 + 1e-9);
  EXPECT_DOUBLE_EQ(elders.YoungFactor(40, 10), 1.0);
}

}  // namespace
}  // namespace dmslam
