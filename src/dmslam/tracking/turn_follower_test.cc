// Which way a camera looks that has no place.
#include "dmslam/tracking/turn_follower.h"

#include <gtest/gtest.h>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr double kFrameS = 1e-9 * kFrameNs;

/// A camera in the middle of points that lie all around, 2 to 6 away.
class TurnFollowerTest : public ::testing::Test {
 protected:
  TurnFollowerTest() {
    Random random(11);
    for (int i = 0; i < 4000; ++i) {
      const double azimuth_rad = random.Uniform(-M_PI, M_PI), distance = random.Uniform(2, 6);
      const double height = distance * random.Uniform(-0.5, 0.5);
      scene_.AddPoint({distance * std::sin(azimuth_rad), height, distance * std::cos(azimuth_rad)});
    }
  }
  /// What it sees at a time; the first `moving` points go aside with 0.5 a second.
  TrackedFrame See(int frame, const Rigid3d& T_cam_world, size_t moving = 0) const {
    return scene_.See(static_cast<uint32_t>(frame), frame * kFrameNs, T_cam_world, [&](size_t point) {
      const Eigen::Vector3d gone(point < moving ? 0.5 * frame * kFrameS : 0.0, 0, 0);
      return std::optional<Eigen::Vector3d>(scene_.point(point) + gone);
    });
  }
  static Rigid3d TurnedAt(int frame, double rad_per_s) {
    return Rigid3d(ExpSo3({0, rad_per_s * frame * kFrameS, 0}), Eigen::Vector3d::Zero());
  }

  MapScene scene_;
  TurnFollower follower_{scene_.map().camera()};
};

TEST_F(TurnFollowerTest, FollowsFarBeyondThePictureThatItBeganWith) {
  constexpr double kRadPerS = 0.8;
  for (int frame = 0; frame <= 90; ++frame) {
    follower_.Follow(See(frame, TurnedAt(frame, kRadPerS)));
    EXPECT_EQ(follower_.IsMeasured(), frame >= 7) << frame;
  }
  EXPECT_EQ(follower_.begun_ns(), 0);
  EXPECT_LT(AngleBetween(follower_.R_now_begun(), TurnedAt(90, kRadPerS).rotation), 0.01);
}

TEST_F(TurnFollowerTest, FollowsAFastTurn) {
  constexpr double kRadPerS = 2.0;
  for (int frame = 0; frame <= 10; ++frame) follower_.Follow(See(frame, TurnedAt(frame, kRadPerS)));
  EXPECT_TRUE(follower_.IsMeasured());
  EXPECT_EQ(follower_.begun_ns(), 0);
  EXPECT_LT(AngleBetween(follower_.R_now_begun(), TurnedAt(10, kRadPerS).rotation), 0.01);
}

TEST_F(TurnFollowerTest, SomebodyInThePictureDoesNotTurnIt) {
  for (int frame = 0; frame <= 30; ++frame) follower_.Follow(See(frame, TurnedAt(frame, 0.3), 1000));
  EXPECT_TRUE(follower_.IsMeasured());
  EXPECT_LT(AngleBetween(follower_.R_now_begun(), TurnedAt(30, 0.3).rotation), 0.01);
}

TEST_F(TurnFollowerTest, ACameraThatMovesIsNoTurn) {
  for (int frame = 0; frame <= 60; ++frame) {
    follower_.Follow(See(frame, MapScene::PoseAt(0.6 * frame * kFrameS)));
    EXPECT_FALSE(follower_.IsMeasured()) << frame;
  }
}

TEST_F(TurnFollowerTest, BeginsAnewWhereThePictureIsAnother) {
  for (int frame = 0; frame <= 10; ++frame) follower_.Follow(See(frame, TurnedAt(frame, 0.5)));
  ASSERT_TRUE(follower_.IsMeasured());
  follower_.Follow(See(11, TurnedAt(100, 0.5)));
  EXPECT_FALSE(follower_.IsMeasured());
  EXPECT_EQ(follower_.begun_ns(), 11 * kFrameNs);
  follower_.Follow(See(30, TurnedAt(100, 0.5)));
  EXPECT_EQ(follower_.begun_ns(), 30 * kFrameNs) << "what happened meanwhile is not known";
}

}  // namespace
}  // namespace dmslam
