#include "collector/durations.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

TEST(DurationHistogram, QuantilesAreTrueToOnePercent) {
  DurationHistogram histogram;
  for (int i = 1000; i > 0; --i) histogram.Add(0.1 * i);
  EXPECT_EQ(histogram.count(), 1000U);
  for (const double q : {0.01, 0.5, 0.95, 0.99}) {
    EXPECT_NEAR(histogram.Quantile(q), 100.0 * q + 0.1, 0.01 * 100.0 * q) << q;
  }
  EXPECT_NEAR(histogram.Quantile(1.0), 100.0, 1.0);
}

TEST(DurationHistogram, WhatTakesNoTimeTakesNone) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.Quantile(0.5), 0.0) << "of none";
  for (const double ms : {0.0, -3.0, 0.0, 7.0}) histogram.Add(ms);
  EXPECT_EQ(histogram.Quantile(0.5), 0.0);
  EXPECT_NEAR(histogram.Quantile(0.99), 7.0, 0.07);
}

TEST(DurationHistogram, WhatTakesLongerThanTwoHoursCountsAsThat) {
  DurationHistogram histogram;
  for (const double ms : {3.6e6, 3e12}) histogram.Add(ms);
  EXPECT_NEAR(histogram.Quantile(0.0), 3.6e6, 3.6e4);
  EXPECT_NEAR(histogram.Quantile(0.99), 6.9e6, 1e5);
}

TEST(DurationHistory, KnowsEachPartOfALongRun) {
  DurationHistory history;
  constexpr int kFrames = 108'000, kQuarter = kFrames / 4;  // an hour
  for (int frame = 0; frame < kFrames; ++frame) history.Add(4 * frame < 3 * kFrames ? 5.0 : 9.0);
  EXPECT_EQ(history.All().count(), static_cast<size_t>(kFrames));
  EXPECT_NEAR(history.Between(0.5, 0.75).Quantile(0.9), 5.0, 0.05);
  EXPECT_NEAR(history.Between(0.75, 1.0).Quantile(0.5), 9.0, 0.09);
  const auto quarter = static_cast<double>(history.Between(0.25, 0.5).count());
  EXPECT_NEAR(quarter, kQuarter, 0.05 * kQuarter);
}

TEST(DurationHistory, OfAShortRunEachDurationIsAPartOfItsOwn) {
  DurationHistory history;
  for (const double ms : {1.0, 2.0, 3.0, 4.0}) history.Add(ms);
  EXPECT_NEAR(history.Between(0.25, 0.5).Quantile(0.5), 2.0, 0.02);
  EXPECT_EQ(history.Between(0.25, 0.5).count(), 1U);
}

}  // namespace
}  // namespace dmslam
