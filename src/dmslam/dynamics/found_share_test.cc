#include "dmslam/dynamics/found_share.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

TEST(FoundShare, IsSmallWhereSomebodyHidesTheMap) {
  FoundShare share(TestCamera());
  for (int x = 8; x < 640; x += 16) {
    for (int y = 8; y < 480; y += 16) share.Add({x, y}, x < 320);
  }
  EXPECT_GT(share.Around({100, 240}), 0.9);
  EXPECT_EQ(share.Around({500, 240}), 0.0);
  EXPECT_NEAR(share.Around({320, 240}), 1.0 / 3,
              0.1);  // the edge of who hides it: one of three columns is seen
}

TEST(FoundShare, OneChanceMatchAmongHiddenLandmarksDoesNotRaiseIt) {
  FoundShare share(TestCamera());
  for (int i = 0; i < 20; ++i) share.Add({300 + i, 200}, false);
  share.Add({310, 205}, true);
  EXPECT_LT(share.Around({310, 205}), 0.05);
}

TEST(FoundShare, ALandmarkThatStandsAloneIsNotCalledHidden) {
  FoundShare share(TestCamera());
  share.Add({10, 470}, true);
  EXPECT_DOUBLE_EQ(share.Around({10, 470}), 0.5);
}

TEST(FoundShare, PlacesAtTheBorderAndBeyondBelongToTheOutermostCells) {
  FoundShare share(TestCamera());
  share.Add({-3, -3}, true);
  share.Add({700, 500}, false);
  EXPECT_DOUBLE_EQ(share.Around({0, 0}), 0.5);
  EXPECT_DOUBLE_EQ(share.Around({639, 479}), 0.0);
}

}  // namespace
}  // namespace dmslam
