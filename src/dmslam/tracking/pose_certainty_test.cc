#include "dmslam/tracking/pose_certainty.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr double kDepth = 4.0;
constexpr double kWide = 0.3, kNarrow = 0.005;  // between keyframes [map units]
constexpr uint32_t kKeyframes = 4;

KeyframeId Id(uint32_t k) { return KeyframeId::Make(MapScene::kSession, k); }

/// A cloud that keyframes have seen, each so far to the right of the one before, and a camera before it.
class ObservedCloud {
 public:
  explicit ObservedCloud(double step, const PoseErrorModel& model = {}) : estimator_(model) {
    scene_.AddCloud(kPoints, {0, 0, kDepth}, {1.0, 1.0, 0.5});
    scene_.MapAll(kKeyframes, step);
  }

  /// The frame sees all points from `x`, and finds its pose by them.
  void See(uint32_t index, double x, int64_t stamp_ns = -1) {
    frame_ = scene_.See(index, stamp_ns < 0 ? index * kFrameNs : stamp_ns, MapScene::PoseAt(x));
    frame_.T_cam_world = frame_.T_cam_world * T_world_map_.Inverse();
    for (size_t i = 0; i < kPoints; ++i) frame_.landmarks[i] = MapScene::IdOf(i);
    solver_.Solve(scene_.map(), {}, &judge_, &frame_);
    basis_ = solver_.basis();
  }
  std::optional<PoseCertainty> Estimate(bool follows = true, uint32_t reference = 0) {
    const PlacedPose pose = PlacedPose::Of(*scene_.map().FindKeyframe(Id(reference)), frame_.T_cam_world);
    return estimator_.Estimate(scene_.map(), frame_, pose, basis_, follows);
  }
  std::optional<PoseCertainty> SeeAndEstimate(uint32_t index, double x) {
    See(index, x);
    return Estimate();
  }
  /// The whole map, as after a loop.
  void MoveMap(const Rigid3d& T_after_before) {
    for (uint32_t k = 0; k < kKeyframes; ++k) {
      const Keyframe& keyframe = scene_.map().At(Id(k));
      scene_.map().SetPose(keyframe, keyframe.T_cam_world * T_after_before.Inverse());
    }
    for (size_t i = 0; i < kPoints; ++i) {
      const Landmark& landmark = scene_.map().At(MapScene::IdOf(i));
      scene_.map().SetPosition(landmark, T_after_before * landmark.p_world);
    }
    T_world_map_ = T_after_before * T_world_map_;
  }
  /// One more keyframe sees all points.
  void AddKeyframe(double x) {
    Keyframe keyframe = scene_.map().At(Id(0));
    keyframe.id = Id(100);
    keyframe.T_cam_world = MapScene::PoseAt(x);
    keyframe.parent = Id(0);
    keyframe.features = scene_.See(100, 0, keyframe.T_cam_world).features;
    const Keyframe& added = scene_.map().AddKeyframe(std::move(keyframe));
    for (uint16_t i = 0; i < kPoints; ++i)
      scene_.map().SetObservation(added, i, scene_.map().At(MapScene::IdOf(i)));
  }

  static constexpr size_t kPoints = 150;
  PoseCertaintyEstimator& estimator() { return estimator_; }
  PoseBasis& basis() { return basis_; }
  const MapScene& scene() const { return scene_; }

 private:
  MapScene scene_;
  MotionJudge judge_{{}, TestCamera()};
  PoseSolver solver_{kChiSquared2Dof};
  PoseCertaintyEstimator estimator_;
  TrackedFrame frame_;
  PoseBasis basis_;
  Rigid3d T_world_map_;  ///< how the map has moved since it was made
};

double PositionVariance(const Matrix6d& covariance) { return covariance.topLeftCorner<3, 3>().trace(); }

// ---- What a pose rests on ----

TEST(PoseCertaintyTest, LandmarksThatWereSeenFromOnePlaceLeaveItLessCertain) {
  ObservedCloud wide(kWide), narrow(kNarrow);
  const auto certain = wide.SeeAndEstimate(1, 0.1), uncertain = narrow.SeeAndEstimate(1, 0.1);
  ASSERT_TRUE(certain && uncertain);
  EXPECT_GT(uncertain->position_share, 3 * certain->position_share);
  EXPECT_GT(uncertain->rotation_rad, certain->rotation_rad);
}

TEST(PoseCertaintyTest, ALandmarkThatIsSeenAnewIsKnownAnew) {
  ObservedCloud camera(kNarrow);
  const auto before = camera.SeeAndEstimate(1, 0.1);
  camera.AddKeyframe(1.0);
  const auto after = camera.SeeAndEstimate(2, 0.1);
  ASSERT_TRUE(before && after);
  EXPECT_LT(after->position_share, before->position_share / 3);
}

TEST(PoseCertaintyTest, LargeResidualsLeaveItLessCertain) {
  ObservedCloud camera(kWide);
  camera.See(1, 0.1);
  camera.basis().mean_chi2 = 0.5;
  const auto quiet = camera.Estimate();
  camera.basis().mean_chi2 = 8.0;
  const auto noisy = camera.Estimate();
  ASSERT_TRUE(quiet && noisy);
  EXPECT_GT(PositionVariance(noisy->covariance), 3 * PositionVariance(quiet->covariance));
}

TEST(PoseCertaintyTest, MatchesThatDoNotAgreeSayNothing) {
  ObservedCloud camera(kWide);
  camera.See(1, 0.1);
  const auto all = camera.Estimate();
  std::vector<char> inliers(camera.basis().inliers.begin(), camera.basis().inliers.end());
  for (size_t i = 0; i < inliers.size(); ++i) {
    const LandmarkId id = camera.basis().matches[i].landmark->id;
    if (camera.scene().point(id.number() - 1).z() > kDepth) inliers[i] = 0;
  }
  camera.basis().inliers = inliers;
  const auto near = camera.Estimate();
  ASSERT_TRUE(all && near);
  EXPECT_NEAR(all->depth, kDepth, 0.1);
  EXPECT_NEAR(near->depth, kDepth - 0.25, 0.1) << "the median of those that agree";
}

TEST(PoseCertaintyTest, FarFromItsReferenceItIsToldLessCertain) {
  ObservedCloud camera(kWide, {.drift = 0.05});
  camera.See(1, 0.9);
  const auto from_afar = camera.Estimate(true, 0), from_near = camera.Estimate(true, 3);
  ASSERT_TRUE(from_afar && from_near);
  EXPECT_GT(from_afar->position_share, 1.5 * from_near->position_share);
}

TEST(PoseCertaintyTest, WhereNothingDeterminesThePoseThereIsNone) {
  ObservedCloud camera(kWide);
  ASSERT_TRUE(camera.SeeAndEstimate(1, 0.1));
  camera.See(2, 0.1);
  camera.basis().information = Matrix6d::Zero();
  EXPECT_FALSE(camera.Estimate());
  const auto next = camera.SeeAndEstimate(3, 0.1);
  ASSERT_TRUE(next);
  EXPECT_FALSE(next->step) << "of a frame whose pose is not known no step is told";
}

// ---- The step from the frame before ----

TEST(PoseStepTest, IsKnownBetterThanThePosesAtItsEnds) {
  ObservedCloud camera(kNarrow);
  const auto first = camera.SeeAndEstimate(1, 0.10), second = camera.SeeAndEstimate(2, 0.11);
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(first->step);
  ASSERT_TRUE(second->step);
  EXPECT_EQ(second->step->from, 1U);
  EXPECT_LT(PositionVariance(second->step->covariance), PositionVariance(second->covariance) / 10);
}

TEST(PoseStepTest, ThereIsNoneOverALongTime) {
  for (const int64_t gap_ns : {400'000'000, 600'000'000}) {
    ObservedCloud camera(kWide);
    camera.See(1, 0.1, 0);
    camera.Estimate();
    camera.See(2, 0.1, gap_ns);
    EXPECT_EQ(camera.Estimate()->step.has_value(), gap_ns < 500'000'000);
  }
}

TEST(PoseStepTest, ThereIsNoneWhereThePoseWasFoundAnew) {
  ObservedCloud camera(kWide);
  camera.SeeAndEstimate(1, 0.1);
  camera.See(2, 0.1);
  EXPECT_FALSE(camera.Estimate(false)->step);
  EXPECT_TRUE(camera.SeeAndEstimate(3, 0.1)->step);
}

TEST(PoseStepTest, ThereIsNoneWhereTheMapHasTurnedMeanwhile) {
  for (const double turn : {0.005, 0.1}) {
    ObservedCloud camera(kWide);
    camera.SeeAndEstimate(1, 0.1);
    camera.MoveMap(Rigid3d(ExpSo3({0, 0, turn}), Eigen::Vector3d::Zero()));
    EXPECT_EQ(camera.SeeAndEstimate(2, 0.1)->step.has_value(), turn < 0.02) << turn;
  }
}

TEST(PoseStepTest, ThereIsNoneFromAMapThatIsGone) {
  ObservedCloud camera(kWide);
  camera.SeeAndEstimate(1, 0.1);
  camera.estimator().Forget();
  EXPECT_FALSE(camera.SeeAndEstimate(2, 0.1)->step);
}

// ---- Poses that move as no camera does ----

TEST(PoseJumpsTest, LeaveItLessCertainWhateverItsLandmarksSay) {
  ObservedCloud steady(kWide), jumping(kWide);
  for (uint32_t frame = 1; frame < 6; ++frame) {
    const auto even = steady.SeeAndEstimate(frame, 0.1);
    const auto uneven = jumping.SeeAndEstimate(frame, frame % 2 == 0 ? 0.1 : 0.2);
    ASSERT_TRUE(even && uneven);
    if (frame < 4) continue;
    EXPECT_GT(PositionVariance(uneven->covariance), 10 * PositionVariance(even->covariance));
    EXPECT_LT(uneven->position_share, 1.5 * even->position_share);
  }
}

TEST(PoseJumpsTest, AreNoneWhereTheMapHasMovedAway) {
  ObservedCloud camera(kWide);
  for (uint32_t frame = 1; frame < 4; ++frame) camera.SeeAndEstimate(frame, 0.1);
  const auto before = camera.SeeAndEstimate(4, 0.1);
  camera.MoveMap(Rigid3d(ExpSo3({0, 0, 0.1}), {0.5, 0, 0}));
  for (uint32_t frame = 5; frame < 8; ++frame) {
    const auto after = camera.SeeAndEstimate(frame, 0.1);
    ASSERT_TRUE(before && after);
    EXPECT_LT(PositionVariance(after->covariance), 1.5 * PositionVariance(before->covariance)) << frame;
  }
}

}  // namespace
}  // namespace dmslam
