#include "dmslam/dynamics/chance_matches.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

TEST(ChanceMatches, FewThatFitBadlyAreSuspected) {
  ChanceMatches chance({});
  EXPECT_FALSE(chance.Suspects(0.05, 10.0)) << "nothing is known of what is usual";
  for (int frame = 0; frame < 30; ++frame) chance.OnTracked(0.3, 0.6, frame * kSecond / 30);
  EXPECT_TRUE(chance.Suspects(0.08, 1.5));
  EXPECT_FALSE(chance.Suspects(0.08, 0.7)) << "few, but they fit";
  EXPECT_FALSE(chance.Suspects(0.3, 1.5)) << "they fit badly, but are many: the map is young";
}

TEST(ChanceMatches, ASuspicionIsClearedByMuchOrByWhatFits) {
  ChanceMatches chance({});
  EXPECT_TRUE(chance.Clears(0.01, 9.0)) << "there is none";
  for (int frame = 0; frame < 30; ++frame) chance.OnTracked(0.3, 0.6, frame * kSecond / 30);
  EXPECT_TRUE(chance.Clears(0.2, 1.5));
  EXPECT_TRUE(chance.Clears(0.05, 0.5));
  EXPECT_FALSE(chance.Clears(0.08, 0.75)) << "no longer suspected, but not cleared";
  EXPECT_FALSE(chance.Suspects(0.08, 0.75));
}

TEST(ChanceMatches, WhatIsUsualIsTheCamerasOwn) {
  ChanceMatches blurred({});
  for (int frame = 0; frame < 30; ++frame) blurred.OnTracked(0.3, 2.0, frame * kSecond / 30);
  EXPECT_FALSE(blurred.Suspects(0.08, 2.4));
  for (int frame = 30; frame < 180; ++frame) blurred.OnTracked(0.3, 0.6, frame * kSecond / 30);
  EXPECT_TRUE(blurred.Suspects(0.08, 2.4)) << "it has become sharp";
}

TEST(ChanceMatches, FramesThatFindLittleAreNotUsual) {
  ChanceMatches chance({});
  for (int frame = 0; frame < 30; ++frame) chance.OnTracked(0.3, 0.6, frame * kSecond / 30);
  for (int frame = 30; frame < 300; ++frame) chance.OnTracked(0.1, 2.0, frame * kSecond / 30);
  EXPECT_TRUE(chance.Suspects(0.1, 2.0));
}

}  // namespace
}  // namespace dmslam
