#include "dmslam/tracking/odometry.h"

#include <gtest/gtest.h>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr double kFrameS = 1e-9 * kFrameNs, kStep = 0.01, kTurn = 0.005;

/// A camera that goes on evenly through a map that is corrected under way.
class OdometerTest : public ::testing::Test {
 protected:
  OdometerTest() {
    scene_.AddCloud(60, {0, 0, 4}, {1, 1, 0.5});
    scene_.MapAll();
  }

  static FrameTime Time(uint32_t frame) { return {frame, 1'000'000'000 + frame * kFrameNs}; }
  /// In the world before all corrections.
  static Rigid3d TrueCamWorld(uint32_t frame) {
    const Twist twist{{kStep / kFrameS, 0, 0.2 * kStep / kFrameS}, {0, kTurn / kFrameS, 0}};
    Rigid3d T_world_cam;
    for (uint32_t k = 0; k < frame; ++k) T_world_cam = Carry(T_world_cam, twist, kFrameS);
    return T_world_cam.Inverse();
  }
  /// In the map as it is now.
  Rigid3d CamWorld(uint32_t frame) const {
    return (Sim3d(TrueCamWorld(frame)) * corrected_.Inverse()).ToRigid();
  }
  void Correct(const Sim3d& S) {
    corrected_ = S * corrected_;
    for (uint32_t k = 0; k < 4; ++k) {
      const Keyframe& keyframe = scene_.map().At(KeyframeId::Make(MapScene::kSession, k));
      scene_.map().SetPoseAndScale(keyframe, (Sim3d(keyframe.T_cam_world) * S.Inverse()).ToRigid(), S.scale);
    }
  }
  void Track(uint32_t frame, bool follows = true) {
    odometer_.Predict(Time(frame));
    const KeyframeId reference = KeyframeId::Make(MapScene::kSession, frame % 4);
    odometer_.OnTracked(scene_.map(), Time(frame),
                        PlacedPose::Of(scene_.map().At(reference), CamWorld(frame)), CamWorld(frame),
                        std::nullopt, follows);
  }
  const OdometryState& state() const { return odometer_.state(); }
  /// How far the pose in the map is from correction times pose in odom.
  double Mismatch(uint32_t frame) const {
    const Sim3d T_map_cam = state().map_from_odom * Sim3d(state().T_odom_cam);
    const Rigid3d T_world_cam = CamWorld(frame).Inverse();
    return (T_map_cam.translation - T_world_cam.translation).norm() +
           AngleBetween(T_map_cam.rotation, T_world_cam.rotation);
  }

  MapScene scene_;
  Sim3d corrected_;
  Odometer odometer_;
};

TEST_F(OdometerTest, ALoopCorrectionMovesTheMapAndNotTheWay) {
  Rigid3d last;
  for (uint32_t frame = 0; frame < 40; ++frame) {
    if (frame == 20) Correct(Sim3d(ExpSo3({0.1, 0.3, 0}), {0.5, -0.2, 1.0}, 1.25));
    if (frame == 30) Correct(Sim3d(ExpSo3({0, -0.1, 0}), {0, 0.3, 0}, 0.9));
    Track(frame);
    EXPECT_LT(Mismatch(frame), 1e-7) << frame;
    EXPECT_EQ(state().segment, 1u);
    const Rigid3d step = last.Inverse() * state().T_odom_cam;
    const Rigid3d truth = TrueCamWorld(frame > 0 ? frame - 1 : 0) * TrueCamWorld(frame).Inverse();
    EXPECT_LT((step.translation - truth.translation).norm(), 1e-9) << frame;
    EXPECT_LT(AngleBetween(step.rotation, truth.rotation), 1e-7) << frame;
    last = state().T_odom_cam;
  }
  EXPECT_NEAR(state().map_from_odom.scale, 1.25 * 0.9, 1e-12);
}

TEST_F(OdometerTest, AMapThatBecomesPartOfAnotherMovesTheMapAndNotTheWay) {
  for (uint32_t frame = 0; frame < 10; ++frame) Track(frame);
  const Rigid3d before = state().T_odom_cam;
  Correct(Sim3d(ExpSo3({0, 1.0, 0}), {3, 0, 0}, 2.0));
  for (uint32_t k = 0; k < 4; ++k)
    scene_.map().SetMapId(scene_.map().At(KeyframeId::Make(MapScene::kSession, k)), 7);
  Track(10);
  EXPECT_EQ(state().map_id, MapId{7});
  EXPECT_LT((state().T_odom_cam.translation - before.translation).norm(), 2 * kStep);
  EXPECT_LT(Mismatch(10), 1e-7);
  EXPECT_EQ(state().segment, 1u);
}

TEST_F(OdometerTest, TheVelocityPredicts) {
  for (uint32_t frame = 0; frame < 10; ++frame) Track(frame);
  ASSERT_TRUE(state().velocity);
  EXPECT_NEAR(state().velocity->angular_rad_per_s.y(), kTurn / kFrameS, 1e-6);
  const Rigid3d T_9_12 = TrueCamWorld(9) * TrueCamWorld(12).Inverse();
  const Rigid3d predicted =
      state().T_odom_cam.Inverse() * Carry(state().T_odom_cam, *state().velocity, 3 * kFrameS);
  EXPECT_LT((predicted.translation - T_9_12.translation).norm(), 1e-3 * kStep);
}

TEST_F(OdometerTest, WhatIsNotSeenIsCarriedOnAndThenHeld) {
  for (uint32_t frame = 0; frame < 10; ++frame) Track(frame);
  odometer_.Predict(Time(12));
  EXPECT_FALSE(state().measured);
  const Rigid3d T_9_12 = TrueCamWorld(9) * TrueCamWorld(12).Inverse();
  EXPECT_NEAR(state().T_odom_cam.translation.norm(),
              (TrueCamWorld(0) * TrueCamWorld(9).Inverse() * T_9_12).translation.norm(), 1e-4);
  Track(13);  // a short gap is bridged by what was measured
  EXPECT_EQ(state().segment, 1u);
  EXPECT_TRUE(state().measured);
  for (uint32_t frame = 14; frame < 60; ++frame) odometer_.Predict(Time(frame));
  EXPECT_FALSE(state().velocity);
  const Rigid3d held = state().T_odom_cam;
  Track(60, false);  // found again elsewhere
  EXPECT_EQ(state().segment, 2u);
  EXPECT_LT((state().T_odom_cam.translation - held.translation).norm(), 1e-12) << "it never jumps";
  EXPECT_LT(Mismatch(60), 1e-7);
}

TEST_F(OdometerTest, ATurnThatIsMeasuredGoesOn) {
  for (uint32_t frame = 0; frame < 10; ++frame) Track(frame);
  const Rigid3d before = state().T_odom_cam;
  Eigen::Quaterniond R_now_9;
  for (uint32_t frame = 10; frame < 60; ++frame) {
    odometer_.Predict(Time(frame));
    R_now_9 = ExpSo3({0, 0.02 * (frame - 9), 0});
    odometer_.OnTurned(Time(9).stamp_ns, R_now_9);
  }
  EXPECT_FALSE(state().measured);
  EXPECT_EQ(state().segment, 1u);
  EXPECT_LT(AngleBetween(state().T_odom_cam.rotation, before.rotation * R_now_9.conjugate()), 1e-9);
}

TEST_F(OdometerTest, ATurnThatBeginsWhereNothingIsKnownIsASegmentOfItsOwn) {
  odometer_.Predict(Time(0));
  EXPECT_FALSE(state().segment);
  odometer_.OnTurned(Time(0).stamp_ns, ExpSo3({0, 0.1, 0}));
  EXPECT_EQ(state().segment, 1u);
  odometer_.OnTurned(Time(0).stamp_ns, ExpSo3({0, 0.2, 0}));
  EXPECT_EQ(state().segment, 1u);
  EXPECT_NEAR(AngleBetween(state().T_odom_cam.rotation, Eigen::Quaterniond::Identity()), 0.2, 1e-9);
  odometer_.OnTurned(Time(5).stamp_ns, ExpSo3({0, 0.1, 0}));
  EXPECT_EQ(state().segment, 2u);
  EXPECT_NEAR(AngleBetween(state().T_odom_cam.rotation, Eigen::Quaterniond::Identity()), 0.3, 1e-9);
  Track(6, false);
  EXPECT_EQ(state().segment, 3u);
  EXPECT_LT(Mismatch(6), 1e-7);
}

TEST_F(OdometerTest, AFrameThatIsTrackedAfterAllIsWhereTurnsBegin) {
  odometer_.OnTurned(Time(5).stamp_ns, ExpSo3({0, 0.1, 0}));
  Track(5, false);
  const Rigid3d tracked = state().T_odom_cam;
  odometer_.Predict(Time(6));
  odometer_.OnTurned(Time(5).stamp_ns, ExpSo3({0, 0.02, 0}));
  EXPECT_EQ(state().segment, 2u);
  EXPECT_NEAR(AngleBetween(state().T_odom_cam.rotation, tracked.rotation), 0.02, 1e-9);
}

}  // namespace
}  // namespace dmslam
