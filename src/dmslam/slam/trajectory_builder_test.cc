#include "dmslam/slam/trajectory_builder.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/replica.h"

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
  builder_.OnMapReset({1, true, "", 0});
  const TrajectoryBuilder::Trajectories built = builder_.Build();
  EXPECT_TRUE(built.final.empty());
  EXPECT_TRUE(built.online.empty());
  EXPECT_EQ(builder_.frame_poses().size(), 1U) << "the frame is counted all the same";
}

TEST_F(TrajectoryOfTwoMaps, AFrameOfADroppedMapThatIsPlacedLaterHasThatPose) {
  builder_.OnFramePose(PoseIn(1, TrackingState::kTracking, 0.5));
  builder_.OnMapReset({1, true, "", 0});
  builder_.OnFramePose(PoseIn(2, TrackingState::kLocalizedLater, 1.0));
  const TrajectoryBuilder::Trajectories built = builder_.Build();
  ASSERT_EQ(built.final.size(), 1U);
  EXPECT_NEAR(built.final[0].T_world_cam.translation.x(), -8.0, 1e-12);
  EXPECT_TRUE(built.online.empty()) << "it was not there when the image came";
}

TEST_F(TrajectoryOfTwoMaps, PosesOfOtherMapsAndOfOneThatIsKeptStay) {
  builder_.OnFramePose(PoseIn(2, TrackingState::kTracking, 0.5));
  builder_.OnMapReset({1, true, "", 0});
  builder_.OnMapReset({2, false, "", 0});
  EXPECT_EQ(builder_.Build().final.size(), 1U);
}

}  // namespace
}  // namespace dmslam
