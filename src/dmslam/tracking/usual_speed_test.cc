#include "dmslam/tracking/usual_speed.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr double kDepth = 4.0;

/// A camera before a wall; what it moves is in depths of the scene.
class UsualSpeedTest : public ::testing::Test {
 protected:
  UsualSpeedTest() {
    scene_.AddCloud(50, {0, 0, kDepth}, {1.5, 1.1, 0.0});
    scene_.MapAll(2, 0.0);
  }

  PlacedPose At(double depths) const {
    const Keyframe* reference = scene_.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, 0));
    return PlacedPose::Of(*reference, MapScene::PoseAt(depths * kDepth));
  }
  /// Goes on evenly.
  void Go(double depths_per_s, double seconds, int64_t step_ns = kFrameNs) {
    for (const int64_t until_ns = now_ns_ + static_cast<int64_t>(seconds * 1e9); now_ns_ < until_ns;) {
      now_ns_ += step_ns;
      at_ += depths_per_s * static_cast<double>(step_ns) * 1e-9;
      usual_.OnPose(scene_.map(), At(at_), now_ns_);
    }
  }
  /// Whether it cannot have come so far in so much time after the pose before.
  bool IsTooFar(double depths, double seconds) const {
    return usual_.IsTooFar(scene_.map(), At(at_ + depths), now_ns_ + static_cast<int64_t>(seconds * 1e9));
  }

  MapScene scene_;
  UsualSpeed usual_;
  int64_t now_ns_ = 0;
  double at_ = 0;
};

TEST_F(UsualSpeedTest, NothingIsTooFarWhileTooLittleIsKnown) {
  Go(0.1, 1.0);
  EXPECT_FALSE(IsTooFar(5.0, 0.3));
  EXPECT_FALSE(usual_.IsTooFar(5.0, 0.3));
}

TEST_F(UsualSpeedTest, WhoHasGoneSlowlyDoesNotGoFast) {
  Go(0.3, 3.0);
  EXPECT_FALSE(IsTooFar(0.3 * 0.2, 0.2));
  EXPECT_FALSE(IsTooFar(0.3 * 1.8 * 0.2, 0.2)) << "for a moment it may go faster";
  EXPECT_TRUE(IsTooFar(0.3 * 3.0 * 0.2, 0.2));
}

TEST_F(UsualSpeedTest, WhoHasGoneFastMay) {
  Go(1.0, 3.0);
  EXPECT_FALSE(IsTooFar(0.3 * 3.0 * 0.2, 0.2));
}

TEST_F(UsualSpeedTest, WhoHasStoodMayBeginToMove) {
  Go(0.0, 3.0);
  EXPECT_FALSE(IsTooFar(0.3 * 0.2, 0.2));
  EXPECT_TRUE(IsTooFar(1.0 * 0.2, 0.2));
}

TEST_F(UsualSpeedTest, NoHurryGoesOnForLong) {
  Go(0.3, 3.0);
  EXPECT_FALSE(IsTooFar(0.35, 1.0));
  EXPECT_TRUE(IsTooFar(0.3 * 2.2, 1.0)) << "for a moment it might";
  EXPECT_FALSE(IsTooFar(0.3 * 2.2 * 0.2, 0.2));
}

TEST_F(UsualSpeedTest, AShortHurryIsNotUsual) {
  Go(0.3, 5.0);
  Go(0.55, 0.2);
  EXPECT_TRUE(IsTooFar(0.3 * 3.0 * 0.2, 0.2));
}

TEST_F(UsualSpeedTest, TheRateOfTheFramesDoesNotMatter) {
  for (const int64_t hz : {4, 10, 15, 60, 90}) {
    usual_ = UsualSpeed();
    Go(0.3, 3.0, 1'000'000'000 / hz);
    const double step_s = std::max(0.2, 1.0 / static_cast<double>(hz));
    EXPECT_FALSE(IsTooFar(0.3 * 1.8 * step_s, step_s)) << hz;
    EXPECT_TRUE(IsTooFar(0.3 * 4.0 * step_s, step_s)) << hz;
  }
}

/// Longer than the histogram counts in full.
TEST_F(UsualSpeedTest, WhatWasLongAgoIsForgotten) {
  Go(1.0, 100.0);
  Go(0.3, 40.0);
  EXPECT_TRUE(IsTooFar(0.3 * 3.0 * 0.2, 0.2));
}

TEST_F(UsualSpeedTest, AfterAJumpItIsMeasuredFromThere) {
  Go(0.3, 3.0);
  at_ += 5.0;
  Go(0.3, 0.1);
  EXPECT_FALSE(IsTooFar(0.3 * 0.1, 0.1)) << "from before the jump it is";
  Go(0.3, 0.3);
  EXPECT_TRUE(IsTooFar(0.3 * 3.0 * 0.2, 0.2)) << "once is not usual";
}

/// Most of the time it is not believed, as what is too far is not told.
TEST_F(UsualSpeedTest, WhoIsFoundAgainFarAwayTimeAfterTimeGoesFasterNow) {
  Go(0.3, 5.0);
  for (int found = 0; found < 6; ++found) {
    EXPECT_EQ(IsTooFar(1.2 * 0.2, 0.2), found < 2) << found;
    now_ns_ += 1'000'000'000;
    at_ += 1.2;
    usual_.OnPose(scene_.map(), At(at_), now_ns_);
    Go(1.2, 0.1);
  }
}

TEST_F(UsualSpeedTest, WhatWasPlacedLateIsMeasuredByTheFastestThatWasUsual) {
  Go(0.6, 30.0);
  Go(0.0, 100.0);
  EXPECT_FALSE(usual_.WasTooFar(0.6 * 0.3, 0.3));
  EXPECT_TRUE(usual_.WasTooFar(0.6 * 2.5 * 0.3, 0.3));
  EXPECT_TRUE(usual_.IsTooFar(0.6 * 0.3, 0.3));
}

TEST_F(UsualSpeedTest, FromAnotherMapNothingFollows) {
  Go(0.3, 3.0);
  const KeyframeId alone = KeyframeId::Make(MapScene::kSession, 500);
  Keyframe keyframe = *scene_.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, 0));
  keyframe.id = alone;
  keyframe.map_id = MapScene::kMap + 1;
  keyframe.parent = {};
  keyframe.T_cam_world = MapScene::PoseAt(50.0);
  scene_.map().AddKeyframe(std::move(keyframe));
  const PlacedPose there{alone, Rigid3d(), 1.0};
  EXPECT_FALSE(usual_.IsTooFar(scene_.map(), there, now_ns_ + 200'000'000));
}

TEST_F(UsualSpeedTest, WhatDoesNotFollowIsNotTooFar) {
  Go(0.3, 3.0);
  usual_.Interrupt();
  EXPECT_FALSE(IsTooFar(5.0, 0.2));
  EXPECT_TRUE(usual_.IsTooFar(5.0, 0.2)) << "what is usual stays known";
}

}  // namespace
}  // namespace dmslam
