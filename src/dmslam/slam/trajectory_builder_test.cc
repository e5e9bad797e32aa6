#include "dmslam/slam/trajectory_builder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/geometry/uncertain_pose.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/replica.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// Frame 3 was tracked in map 1, beside its keyframe 0. Map 1 was dropped, and map 2 has frame 0 as a
/// keyframe again, elsewhere.
class TrajectoryOfTwoMaps : public testing::Test {
 protected:
  TrajectoryOfTwoMaps() {
    MapEditor map(TestCamera(), Pyramid());
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, 0);
    keyframe.map_id = 2;
    keyframe.T_cam_world.translation = Eigen::Vector3d(7.0, 0.0, 0.0);
    keyframe.features = MakeFrameFeatures(FeatureSet(), map.camera(), map.pyramid());
    map.AddKeyframe(std::move(keyframe));
    builder_.SetMap(Replica(std::move(map)));
  }

  static FramePose PoseIn(MapId map_id, TrackingState state, double x) {
    FramePose pose;
    pose.frame_index = 3;
    pose.stamp_ns = 100;
    pose.map_id = map_id;
    pose.state = state;
    pose.reference = KeyframeId::Make(1, 0);
    pose.T_cam_reference.translation = Eigen::Vector3d(x, 0.0, 0.0);
    return pose;
  }

  TrajectoryBuilder builder_{TestCamera(), Pyramid()};
};

TEST_F(TrajectoryOfTwoMaps, PosesOfADroppedMapDoNotComeBackWithAKeyframeOfTheSameNumber) {
  builder_.OnFramePose(PoseIn(1, TrackingState::kTracking, 0.5));
  builder_.OnMapReset({1, MapReset::Fate::kDrop, "", 0});
  const TrajectoryBuilder::Trajectories built = builder_.Build();
  EXPECT_TRUE(built.final.empty());
  EXPECT_TRUE(built.online.empty());
  EXPECT_FALSE(built.map_id.has_value()) << "no frame lies in any";
  EXPECT_TRUE(built.keyframes.empty());
  ASSERT_EQ(builder_.frame_poses().size(), 1U) << "the frame is counted all the same";
  const FramePose& left = builder_.frame_poses().begin()->second;
  EXPECT_FALSE(left.HasPose() || HasPose(left.state)) << "its state says why it has no pose";
}

TEST_F(TrajectoryOfTwoMaps, FramesOfSeveralCamerasAreToldApart) {
  FramePose other = PoseIn(2, TrackingState::kTracking, 2.0);
  other.camera_id = 1;
  builder_.OnFramePose(PoseIn(2, TrackingState::kTracking, 1.0));
  builder_.OnFramePose(other);
  ASSERT_EQ(builder_.Build().final.size(), 2U);
  ASSERT_EQ(builder_.Build(1).final.size(), 1U);
  EXPECT_NEAR(builder_.Build(0).final[0].T_world_cam.translation.x(), -8.0, 1e-12);
  EXPECT_NEAR(builder_.Build(1).final[0].T_world_cam.translation.x(), -9.0, 1e-12);
  EXPECT_EQ(builder_.Build(0).keyframes.size(), 1U);
  EXPECT_TRUE(builder_.Build(1).keyframes.empty());
  MapReset reset;
  reset.map_id = 2;
  reset.fate = MapReset::Fate::kDrop;
  reset.camera_id = 1;
  builder_.OnMapReset(reset);
  EXPECT_TRUE(builder_.Build(1).final.empty());
  EXPECT_EQ(builder_.Build(0).final.size(), 1U) << "the other camera has not given it up";
}

TEST_F(TrajectoryOfTwoMaps, AFrameOfADroppedMapThatIsPlacedLaterHasThatPose) {
  builder_.OnFramePose(PoseIn(1, TrackingState::kTracking, 0.5));
  builder_.OnMapReset({1, MapReset::Fate::kDrop, "", 0});
  builder_.OnFramePose(PoseIn(2, TrackingState::kLocalizedLater, 1.0));
  const TrajectoryBuilder::Trajectories built = builder_.Build();
  ASSERT_EQ(built.final.size(), 1U);
  EXPECT_NEAR(built.final[0].T_world_cam.translation.x(), -8.0, 1e-12);
  EXPECT_TRUE(built.online.empty()) << "it was not there when the image came";
}

TEST_F(TrajectoryOfTwoMaps, PosesOfOtherMapsAndOfOneThatIsKeptStay) {
  builder_.OnFramePose(PoseIn(2, TrackingState::kTracking, 0.5));
  builder_.OnMapReset({1, MapReset::Fate::kDrop, "", 0});
  builder_.OnMapReset({2, MapReset::Fate::kKeep, "", 0});
  EXPECT_EQ(builder_.Build().final.size(), 1U);
}

/// Frames 10 and 20 became keyframes that were lost with all processes; frame 20 was told relative to 10's,
/// frame 10 relative to keyframe 0, which is left.
TEST_F(TrajectoryOfTwoMaps, FramesOfLostKeyframesAreToldOverTheFramesThatBecameThem) {
  const auto add = [this](uint32_t frame, uint32_t reference, double x, double scale) {
    FramePose pose = PoseIn(2, TrackingState::kTracking, x);
    pose.frame_index = frame;
    pose.stamp_ns = frame;
    pose.reference = KeyframeId::Make(1, reference);
    pose.reference_scale = scale;
    builder_.OnFramePose(pose);
  };
  add(10, 0, 1.0, 1.0);
  add(20, 10, 1.0, 1.0);
  add(21, 20, 1.0, 2.0);  // the world had grown to twice its size since keyframe 20 was made
  add(31, 30, 1.0, 1.0);  // nobody knows where frame 30 was
  EXPECT_EQ(builder_.Build().final.size(), 1U);
  builder_.BridgeLostKeyframes();
  const TrajectoryBuilder::Trajectories built = builder_.Build();
  ASSERT_EQ(built.final.size(), 3U);
  EXPECT_NEAR(built.final[0].T_world_cam.translation.x(), -8.0, 1e-12);
  EXPECT_NEAR(built.final[1].T_world_cam.translation.x(), -9.0, 1e-12);
  EXPECT_NEAR(built.final[2].T_world_cam.translation.x(), -9.5, 1e-12);
}

/// Frame 40 was told when keyframe 0 had half of its present scale, and the keyframe that it became began
/// with that.
TEST_F(TrajectoryOfTwoMaps, ALostKeyframeBeganWithTheScaleOfItsReference) {
  for (const uint32_t frame : {40U, 41U}) {
    FramePose pose = PoseIn(2, TrackingState::kTracking, 1.0);
    pose.frame_index = frame;
    pose.stamp_ns = frame;
    pose.reference = KeyframeId::Make(1, frame == 40 ? 0 : 40);
    pose.reference_scale = 0.5;
    builder_.OnFramePose(pose);
  }
  builder_.BridgeLostKeyframes();
  const TrajectoryBuilder::Trajectories built = builder_.Build();
  ASSERT_EQ(built.final.size(), 2U);
  const double step = built.final[1].T_world_cam.translation.x() - built.final[0].T_world_cam.translation.x();
  EXPECT_NEAR(std::abs(step), 2.0, 1e-12) << "one unit of that time is two now";
}

TEST_F(TrajectoryOfTwoMaps, FramesToldOverOneAnotherStayWithoutAPlace) {
  for (const uint32_t frame : {10U, 11U}) {
    FramePose pose = PoseIn(2, TrackingState::kTracking, 1.0);
    pose.frame_index = frame;
    pose.reference = KeyframeId::Make(1, 21 - frame);
    builder_.OnFramePose(pose);
  }
  builder_.BridgeLostKeyframes();
  EXPECT_TRUE(builder_.Build().final.empty());
}

TEST_F(TrajectoryOfTwoMaps, AFrameIsNotToldOverOneOfAnotherMap) {
  FramePose lost = PoseIn(2, TrackingState::kTracking, 1.0);
  lost.frame_index = 10;
  builder_.OnFramePose(lost);
  FramePose pose = PoseIn(1, TrackingState::kTracking, 1.0);
  pose.frame_index = 11;
  pose.reference = KeyframeId::Make(1, 10);
  builder_.OnFramePose(pose);
  builder_.BridgeLostKeyframes();
  EXPECT_EQ(builder_.Build().final.size(), 1U);
}

/// A map becomes part of another that is turned, moved, and half as large.
TEST(TrajectoryOfJoinedMaps, PosesToldInAMapGoWithIt) {
  MapEditor map(TestCamera(), Pyramid());
  const auto add = [&](uint32_t frame, MapId map_id, const Rigid3d& T_cam_world) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, frame);
    keyframe.map_id = map_id;
    keyframe.T_cam_world = T_cam_world;
    keyframe.features = MakeFrameFeatures(FeatureSet(), map.camera(), map.pyramid());
    map.AddKeyframe(std::move(keyframe));
  };
  add(1, 1, Rigid3d());
  const Rigid3d then(ExpSo3(Eigen::Vector3d(0.1, 0.2, 0.3)), Eigen::Vector3d(1, 2, 3));
  add(2, 2, then);
  TrajectoryBuilder builder(TestCamera(), Pyramid());
  builder.OnMapDelta(map.TakeDelta(MapEvent::kMapped, std::nullopt, std::nullopt));
  const auto tell = [&](uint32_t frame) {
    FramePose pose;
    pose.frame_index = frame;
    pose.stamp_ns = frame;
    pose.map_id = 2;
    pose.state = TrackingState::kTracking;
    pose.reference = KeyframeId::Make(1, 2);
    pose.T_cam_reference.translation = Eigen::Vector3d(0.5, 0.0, frame);
    pose.T_cam_world = pose.T_cam_reference * then;
    builder.OnFramePose(pose);
  };
  tell(3);
  tell(4);
  const Sim3d S_1_2(ExpSo3(Eigen::Vector3d(0, 0.4, 0)), Eigen::Vector3d(5, 0, 1), 0.5);
  map.SetPoseAndScale(map.At(KeyframeId::Make(1, 2)), (Sim3d(then) * S_1_2.Inverse()).ToRigid(), S_1_2.scale);
  map.SetMapId(map.At(KeyframeId::Make(1, 2)), 1);
  builder.OnMapDelta(map.TakeDelta(MapEvent::kCorrected, KeyframeId::Make(1, 2), 1));
  tell(5);
  const TrajectoryBuilder::Trajectories built = builder.Build();
  EXPECT_EQ(built.map_id, 1u);
  EXPECT_TRUE(built.other_maps.empty());
  ASSERT_EQ(built.online.size(), 3u) << "the one told before its frontend heard of it is no other";
  ASSERT_EQ(built.final.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d difference =
        built.online[i].T_world_cam.translation - built.final[i].T_world_cam.translation;
    EXPECT_LT(difference.norm(), 1e-12) << i;
  }
}

/// A camera that was carried along the x axis of map 2, told by frames that see it badly along y: their
/// features went with their frontend.
class PosesOfADeadFrontend : public TrajectoryOfTwoMaps {
 protected:
  static constexpr uint32_t kFrames = 90;
  static double TrueX(uint32_t frame) { return std::sin(0.05 * frame); }

  static FramePose Told(uint32_t frame, double error_y) {
    FramePose pose = PoseIn(2, TrackingState::kTracking, TrueX(frame));
    pose.frame_index = frame;
    pose.stamp_ns = 33'333'333 * int64_t{frame};
    pose.T_cam_reference.translation.y() = error_y;
    Vector6d sigma = Vector6d::Constant(1e-3);
    sigma(1) = 0.02;
    pose.covariance = UpperTriangle(sigma.cwiseAbs2().asDiagonal().toDenseMatrix());
    return pose;
  }
  void TellAll() {
    Random random(1);
    for (uint32_t frame = 0; frame < kFrames; ++frame)
      builder_.OnFramePose(Told(frame, random.Uniform(-0.03, 0.03)));
  }
  /// Root mean square of y in the end.
  double ErrorAlongY() const {
    double sum = 0;
    for (const StampedPose& pose : builder_.Build().final)
      sum += std::pow(pose.T_world_cam.translation.y(), 2);
    return std::sqrt(sum / kFrames);
  }
};

TEST_F(PosesOfADeadFrontend, AreJoinedWithTheMotionOfTheCamera) {
  TellAll();
  const TrajectoryBuilder::Trajectories told = builder_.Build();
  const double before = ErrorAlongY();
  std::set<TrajectoryBuilder::FrameName> all;
  for (uint32_t frame = 0; frame < kFrames; ++frame) all.insert({0, frame});
  builder_.JoinPosesOf(all);
  const TrajectoryBuilder::Trajectories joined = builder_.Build();
  ASSERT_EQ(joined.final.size(), kFrames);
  EXPECT_GT(before, 0.015);
  EXPECT_LT(ErrorAlongY(), 0.6 * before);
  for (uint32_t frame = 0; frame < kFrames; ++frame) {
    EXPECT_NEAR(joined.final[frame].T_world_cam.translation.x(), -7.0 - TrueX(frame), 5e-3) << frame;
    EXPECT_EQ(joined.online[frame].T_world_cam.translation, told.online[frame].T_world_cam.translation);
  }
}

TEST_F(PosesOfADeadFrontend, OthersAndThoseThatWerePlacedBetterStayAsTheyAre) {
  TellAll();
  FramePose better = Told(20, 0.001);
  better.state = TrackingState::kLocalizedLater;
  builder_.OnFramePose(better);
  const TrajectoryBuilder::Trajectories before = builder_.Build();
  std::set<TrajectoryBuilder::FrameName> some;
  for (uint32_t frame = 0; frame < 40; ++frame) some.insert({0, frame});
  builder_.JoinPosesOf(some);
  const TrajectoryBuilder::Trajectories after = builder_.Build();
  for (uint32_t frame = 0; frame < kFrames; ++frame) {
    const bool same =
        after.final[frame].T_world_cam.translation == before.final[frame].T_world_cam.translation;
    EXPECT_EQ(same, frame >= 40 || frame == 20) << frame;
  }
}

}  // namespace
}  // namespace dmslam
