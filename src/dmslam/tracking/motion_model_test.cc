// Where the camera is expected, and where it may be.
#include "dmslam/tracking/motion_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr double kStep = 0.01;  // of the camera, per frame [map units]

/// A camera that goes sideways before a cloud of landmarks, at depth 4.
class MotionModelTest : public ::testing::Test {
 protected:
  MotionModelTest() {
    scene_.AddCloud(60, {0, 0, 4}, {1, 1, 0});
    scene_.MapAll();
  }
  MapEditor& map() { return scene_.map(); }
  static KeyframeId Kf(uint32_t k) { return KeyframeId::Make(MapScene::kSession, k); }
  static FrameTime Time(uint32_t frame, int64_t step_ns = kFrameNs) { return {frame, frame * step_ns}; }
  PlacedPose Placed(const Rigid3d& T_cam_world) { return PlacedPose::Of(map().At(Kf(0)), T_cam_world); }
  void Track(double x, const FrameTime& time, double variance = 0, bool jumped = false) {
    const Rigid3d T_cam_world = MapScene::PoseAt(x);
    model_.OnTracked(map(), Placed(T_cam_world), {T_cam_world, variance * Matrix6d::Identity()}, time,
                     jumped);
  }
  /// Tracks this frame of a camera that goes evenly.
  void TrackTo(uint32_t frame, bool jumped = false) { Track(kStep * frame, Time(frame), 0, jumped); }
  MotionModel::Prediction Predict(uint32_t frame) const { return model_.Predict(scene_.map(), Time(frame)); }
  /// Distance of the predicted camera from (x, 0, 0).
  double PredictionError(uint32_t frame, double x) const {
    return (Predict(frame).T_cam_world.value().Center() - Eigen::Vector3d(x, 0, 0)).norm();
  }
  double PredictedX(const FrameTime& time) {
    return model_.Predict(map(), time).T_cam_world.value().Center().x();
  }

  MapScene scene_;
  MotionModel model_{{}};
};

TEST_F(MotionModelTest, NothingIsKnownBeforeTheFirstPose) {
  EXPECT_FALSE(Predict(1).T_cam_world);
  TrackTo(1);
  const auto prediction = Predict(2);
  ASSERT_TRUE(prediction.T_cam_world);
  EXPECT_FALSE(prediction.prior) << "a pose alone is no motion";
}

TEST_F(MotionModelTest, GoesOnAsBefore) {
  TrackTo(1);
  TrackTo(2);
  ASSERT_TRUE(Predict(3).prior);
  EXPECT_LT(PredictionError(3, 3 * kStep), 1e-9);
}

TEST_F(MotionModelTest, AMotionOverAGapIsDividedByItsDuration) {
  TrackTo(1);
  TrackTo(3);  // a frame between was not tracked
  EXPECT_LT(PredictionError(4, 4 * kStep), 1e-9);
}

TEST_F(MotionModelTest, APredictionOverAGapGoesAsFarAsTheCamera) {
  TrackTo(1);
  TrackTo(2);
  EXPECT_LT(PredictionError(5, 5 * kStep), 1e-9);
  EXPECT_LT(PredictionError(14, 7.5 * kStep), 1e-3) << "but not on and on";
}

TEST_F(MotionModelTest, AFrameTrackedTwiceHasNotMoved) {
  TrackTo(1);
  const Rigid3d corrected = MapScene::PoseAt(kStep * 1.1);
  model_.OnTracked(map(), Placed(corrected), {corrected}, Time(1), false);
  EXPECT_LT(PredictionError(2, kStep), kStep);
}

TEST_F(MotionModelTest, AJumpIsNoMotion) {
  TrackTo(1);
  TrackTo(2, true);
  EXPECT_FALSE(Predict(3).prior);
  EXPECT_LT(PredictionError(3, 2 * kStep), 1e-9);
}

TEST_F(MotionModelTest, ThePriorFadesWithTheGap) {
  TrackTo(1);
  TrackTo(2);
  const double near = Predict(3).prior->information(0, 0), far = Predict(6).prior->information(0, 0);
  EXPECT_GT(near / far, 10.0);
  EXPECT_FALSE(Predict(8).prior) << "after a fifth of a second the motion says too little";
  EXPECT_TRUE(Predict(10).recent);
  EXPECT_FALSE(Predict(20).recent);
}

TEST_F(MotionModelTest, FollowsACorrectionOfTheMap) {
  TrackTo(1);
  TrackTo(2);
  const Rigid3d shift(Eigen::Quaterniond::Identity(), {-1.0, 0, 0});
  map().SetPose(map().At(Kf(0)), map().At(Kf(0)).T_cam_world * shift);
  EXPECT_LT(PredictionError(3, 1.0 + 3 * kStep), 1e-9);
}

TEST_F(MotionModelTest, CoastsOnWeakPosesForAWhile) {
  TrackTo(1);
  TrackTo(2);
  for (uint32_t frame = 3; frame <= 9; ++frame) {
    model_.Coast(map(), {MapScene::PoseAt(kStep * frame)}, Time(frame));
    EXPECT_TRUE(model_.IsCoasting());
    ASSERT_TRUE(Predict(frame + 1).prior);
    EXPECT_LT(PredictionError(frame + 1, kStep * (frame + 1)), 1e-9);
  }
  EXPECT_EQ(model_.last_stamp_ns(), Time(2).stamp_ns) << "a weak pose is not told";
  TrackTo(10);
  EXPECT_FALSE(model_.IsCoasting());
}

TEST_F(MotionModelTest, AJoltThatNoHandMakesIsOutOfReach) {
  TrackTo(1);
  TrackTo(2);
  const auto reachable = [&](double x) { return model_.IsReachable(map(), MapScene::PoseAt(x), Time(3)); };
  EXPECT_TRUE(reachable(3 * kStep));
  EXPECT_TRUE(reachable(3 * kStep + 0.1)) << "2.5 % of the depth beside where the motion leads";
  EXPECT_FALSE(reachable(3 * kStep + 0.3));
  const Rigid3d turned(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())),
                       MapScene::PoseAt(3 * kStep).translation);
  EXPECT_FALSE(model_.IsReachable(map(), turned, Time(3)));
}

TEST_F(MotionModelTest, WhereItsMotionIsNotKnownACameraGoesNoFasterThanACarriedOne) {
  TrackTo(1, true);
  const auto reachable = [&](double x, uint32_t frame) {
    return model_.IsReachable(map(), MapScene::PoseAt(x), Time(frame));
  };
  EXPECT_FALSE(reachable(1.0, 4)) << "a quarter of the depth in a tenth of a second";
  EXPECT_TRUE(reachable(1.0, 31));
  EXPECT_FALSE(reachable(20.0, 31));
  EXPECT_TRUE(reachable(20.0, 300)) << "where it was ten seconds ago says nothing";
}

TEST_F(MotionModelTest, APlacedPoseGoesWithItsKeyframeAndItsScale) {
  map().SetPoseAndScale(map().At(Kf(2)), map().At(Kf(2)).T_cam_world, 3.0);  // before the pose is told
  const Rigid3d T_cam_world = MapScene::PoseAt(0.3);
  const PlacedPose pose = PlacedPose::Of(map().At(Kf(2)), T_cam_world);  // 0.2 beside it
  EXPECT_LT((pose.In(map())->Center() - Eigen::Vector3d(0.3, 0, 0)).norm(), 1e-12);
  map().SetPoseAndScale(map().At(Kf(2)), MapScene::PoseAt(1.0), 2.0);
  EXPECT_LT((pose.In(map())->Center() - Eigen::Vector3d(1.4, 0, 0)).norm(), 1e-12);
}

TEST_F(MotionModelTest, APlacedPoseOutlivesItsKeyframe) {
  const PlacedPose pose = PlacedPose::Of(map().At(Kf(2)), MapScene::PoseAt(0.3));
  map().RemoveKeyframe(map().At(Kf(2)));
  ASSERT_TRUE(pose.In(map()));
  EXPECT_LT((pose.In(map())->Center() - Eigen::Vector3d(0.3, 0, 0)).norm(), 1e-12);
}

/// Of a loop, a join or an adjustment each keyframe takes a scale of its own.
TEST_F(MotionModelTest, APlacedPoseOutlivesAKeyframeOfAnotherScaleThanItsParents) {
  map().SetPoseAndScale(map().At(Kf(1)), map().At(Kf(1)).T_cam_world, 0.8);
  map().SetPoseAndScale(map().At(Kf(2)), map().At(Kf(2)).T_cam_world, 0.5);
  const PlacedPose pose = PlacedPose::Of(map().At(Kf(2)), MapScene::PoseAt(0.3));
  const auto scale_around = [&] { return map().ResolvePose(Kf(2))->scale; };
  ASSERT_EQ(scale_around(), 0.5);
  map().RemoveKeyframe(map().At(Kf(2)));
  EXPECT_LT((pose.In(map())->Center() - Eigen::Vector3d(0.3, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(scale_around(), 0.5, 1e-12);
  // What became of the parent became of everything around it.
  map().SetPoseAndScale(map().At(Kf(1)), map().At(Kf(1)).T_cam_world, 2.0);
  EXPECT_NEAR(scale_around(), 1.0, 1e-12);
  const double from_parent = 0.3 - map().At(Kf(1)).T_cam_world.Center().x();
  EXPECT_NEAR(pose.In(map())->Center().x(), 0.3 + from_parent, 1e-12);
}

TEST_F(MotionModelTest, WhereNothingIsKnownOfTheReferenceThereIsNoPose) {
  EXPECT_FALSE(PlacedPose::Of(nullptr, Rigid3d()));
  PlacedPose pose = Placed(Rigid3d());
  pose.reference = Kf(99);
  EXPECT_FALSE(pose.In(map()));
  model_.Begin(pose, Time(1));
  EXPECT_FALSE(model_.Predict(map(), Time(2)).T_cam_world);
  EXPECT_TRUE(model_.IsReachable(map(), MapScene::PoseAt(50), Time(2))) << "nothing contradicts it";
}

TEST_F(MotionModelTest, WhereTheReferenceIsCulledTheSceneIsAsDeepAsBefore) {
  const auto track = [&](double x, const FrameTime& time) {
    const PlacedPose pose = PlacedPose::Of(map().At(Kf(2)), MapScene::PoseAt(x));
    model_.OnTracked(map(), pose, {MapScene::PoseAt(x), Matrix6d::Zero()}, time, false);
  };
  track(kStep, Time(1));
  track(2 * kStep, Time(2));
  const Matrix6d before = model_.Predict(map(), Time(3)).prior.value().information;
  const Rigid3d beside = MapScene::PoseAt(3 * kStep + 0.1);
  ASSERT_TRUE(model_.IsReachable(map(), beside, Time(3)));
  map().RemoveKeyframe(map().At(Kf(2)));
  const MotionModel::Prediction after = model_.Predict(map(), Time(3));
  ASSERT_TRUE(after.prior);
  EXPECT_LT((after.prior->information - before).norm(), 1e-9 * before.norm());
  EXPECT_TRUE(model_.IsReachable(map(), beside, Time(3))) << "a fortieth of the depth beside the way";
}

TEST_F(MotionModelTest, WhereTheDepthIsNotKnownNothingFollowsButTheNewestPose) {
  Track(kStep, Time(1));
  Track(2 * kStep, Time(2));
  for (const Landmark* landmark : map().LandmarksOf(MapScene::kMap)) map().RemoveLandmark(*landmark);
  EXPECT_NEAR(PredictedX(Time(3)), 2 * kStep, 1e-9);
  EXPECT_FALSE(model_.Predict(map(), Time(3)).prior);
  EXPECT_TRUE(model_.IsReachable(map(), MapScene::PoseAt(3), Time(3)));
  Track(3 * kStep, Time(3));
  EXPECT_FALSE(model_.Predict(map(), Time(4)).prior);
}

TEST(MotionPrior, IsAsWideAsItsOptionsSay) {
  MotionModelOptions options;
  options.prior_rotation_rad = 0.02;
  options.prior_translation = 0.05;
  const PosePrior prior = MotionPrior(options, MapScene::PoseAt(1), 4.0, 3.0);
  EXPECT_EQ(prior.T_cam_world.Center().x(), 1.0);
  for (int i = 0; i < 6; ++i) {
    const double sigma = i < 3 ? 0.02 * 3 : 0.05 * 4 * 3;
    EXPECT_NEAR(1 / std::sqrt(prior.information(i, i)), sigma, 1e-12) << i;
  }
  EXPECT_EQ(prior.information.norm(), prior.information.diagonal().norm());
}

TEST_F(MotionModelTest, TheMotionGrowsWithTheMap) {
  Track(kStep, Time(1));
  Track(2 * kStep, Time(2));
  map().SetPoseAndScale(map().At(Kf(0)), Rigid3d(), 3.0);
  EXPECT_NEAR(PredictedX(Time(3)), 3 * 3 * kStep, 1e-9);
}

TEST_F(MotionModelTest, TheFrameThatComesNextIsNearEnoughAtAnyRate) {
  constexpr int64_t kSlowNs = 250'000'000;
  Track(kStep, Time(1, kSlowNs));
  Track(2 * kStep, Time(2, kSlowNs));
  const MotionModel::Prediction next = model_.Predict(map(), Time(3, kSlowNs));
  ASSERT_TRUE(next.prior);
  EXPECT_NEAR(next.T_cam_world->Center().x(), 3 * kStep, 1e-9);
  EXPECT_NEAR(next.prior->T_cam_world.Center().x(), 3 * kStep, 1e-9);
  const FrameTime after_a_gap{4, 3 * kSlowNs};
  EXPECT_FALSE(model_.Predict(map(), after_a_gap).prior) << "as long, but frames are missing between";
  Track(3 * kStep, after_a_gap);
  EXPECT_NEAR(PredictedX({5, 4 * kSlowNs}), 3 * kStep, 1e-9) << "the step over a gap so long is no motion";
}

TEST_F(MotionModelTest, WhoStandsAtAGivenPoseOrHasStoppedHasNoMotion) {
  Track(kStep, Time(1));
  Track(2 * kStep, Time(2));
  model_.Stop();
  EXPECT_NEAR(PredictedX(Time(3)), 2 * kStep, 1e-9);
  EXPECT_FALSE(model_.Predict(map(), Time(3)).prior);
  Track(3 * kStep, Time(3));
  EXPECT_TRUE(model_.Predict(map(), Time(4)).prior) << "it is known again from the next pose on";
  model_.Begin(Placed(MapScene::PoseAt(1)), Time(4));
  EXPECT_NEAR(PredictedX(Time(5)), 1.0, 1e-9);
  EXPECT_FALSE(model_.Predict(map(), Time(5)).prior);
}

TEST_F(MotionModelTest, WhoIsLostHasNoPoseAndMayBeAnywhere) {
  Track(kStep, Time(1));
  Track(2 * kStep, Time(2));
  ASSERT_TRUE(model_.last());
  EXPECT_EQ(model_.last()->reference, Kf(0));
  EXPECT_EQ(model_.last_stamp_ns(), Time(2).stamp_ns);
  EXPECT_FALSE(model_.IsReachable(map(), MapScene::PoseAt(3), Time(3)));
  model_.BeginLost();
  EXPECT_FALSE(model_.last());
  EXPECT_FALSE(model_.last_stamp_ns());
  EXPECT_FALSE(model_.Predict(map(), Time(3)).T_cam_world);
  EXPECT_FALSE(model_.Predict(map(), Time(3)).recent);
  EXPECT_TRUE(model_.IsReachable(map(), MapScene::PoseAt(3), Time(3)));
}

TEST_F(MotionModelTest, AWeakPoseLeadsOnlyFromARecentOne) {
  const FoundPose weak{MapScene::PoseAt(1), Matrix6d::Zero()};
  model_.Coast(map(), weak, Time(1));
  EXPECT_FALSE(model_.IsCoasting()) << "nothing was tracked";
  Track(kStep, Time(1));
  model_.Coast(map(), weak, Time(7));
  EXPECT_FALSE(model_.IsCoasting()) << "a fifth of a second ago";
  EXPECT_NEAR(PredictedX(Time(8)), kStep, 1e-9);
  model_.Coast(map(), weak, Time(6));
  EXPECT_TRUE(model_.IsCoasting());
  EXPECT_NEAR(model_.Predict(map(), Time(6)).T_cam_world->Center().x(), 1.0, 1e-9);
  model_.Stop();
  EXPECT_FALSE(model_.IsCoasting());
  EXPECT_NEAR(PredictedX(Time(7)), kStep, 1e-9) << "what was tracked stands";
}

TEST_F(MotionModelTest, HoweverLongWeakPosesLeadTheyAreNotTracked) {
  Track(kStep, Time(1));
  for (uint32_t frame = 2; frame < 30; ++frame) {
    model_.Coast(map(), {MapScene::PoseAt(kStep * frame), Matrix6d::Zero()}, Time(frame));
    if (frame == 10) {
      EXPECT_TRUE(model_.Predict(map(), Time(11)).recent);
    }
  }
  EXPECT_TRUE(model_.IsCoasting());
  EXPECT_FALSE(model_.Predict(map(), Time(30)).recent) << "the last tracked frame is a second old";
  EXPECT_EQ(model_.last_stamp_ns(), Time(1).stamp_ns);
}

/// Of the next pose, where the two before it are known so well.
TEST_F(MotionModelTest, APoseThatIsHardlyKnownLeavesTheNextOneOpen) {
  const auto variance = [&](double first, double second) {
    model_.BeginLost();
    Track(kStep, Time(1), first);
    Track(2 * kStep, Time(2), second);
    return 1 / model_.Predict(map(), Time(3)).prior->information(3, 3);
  };
  const double known = variance(0, 0), first_weak = variance(0.01, 0), second_weak = variance(0, 0.01);
  EXPECT_GT(first_weak, known + 0.009);
  EXPECT_GT(second_weak, known + 0.03) << "it is off by its own error, and its motion by as much again";
}

TEST_F(MotionModelTest, WeakPosesDoNotMoveWhatCanBeReachedFromTheLastTrackedOne) {
  Track(kStep, Time(1));
  Track(2 * kStep, Time(2));
  const auto aside = [](uint32_t frame) { return kStep * frame + 0.2 * (frame - 2); };
  for (uint32_t frame = 3; frame < 6; ++frame)
    model_.Coast(map(), {MapScene::PoseAt(aside(frame)), Matrix6d::Identity() * 1e-6}, Time(frame));
  const Rigid3d where_it_was = MapScene::PoseAt(2 * kStep);
  EXPECT_FALSE(model_.IsReachable(map(), where_it_was, Time(6)));
  EXPECT_TRUE(model_.IsReachableFromTracked(map(), where_it_was, Time(6)));
  EXPECT_FALSE(model_.IsReachableFromTracked(map(), MapScene::PoseAt(50), Time(6)));
}

TEST_F(MotionModelTest, TheReachGrowsWithTheFramesThatAreMissing) {
  Track(kStep, Time(1));
  Track(2 * kStep, Time(2));
  const auto reachable = [&](uint32_t frame) {
    return model_.IsReachable(map(), MapScene::PoseAt(kStep * frame + 0.4), Time(frame));
  };
  EXPECT_FALSE(reachable(3)) << "a tenth of the depth beside where the motion leads";
  EXPECT_TRUE(reachable(5));
}

}  // namespace
}  // namespace dmslam
