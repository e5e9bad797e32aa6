// What is told at the end of frames that were placed late.
#include "dmslam/refinement/last_poses.h"

#include <gtest/gtest.h>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

class LastPosesTest : public ::testing::Test {
 protected:
  LastPosesTest() : last_({}, false, {}, TestCamera()) {
    scene_.AddCloud(200, {0, 0, 4}, {1.6, 1.2, 0.5});
    scene_.MapAll(2, 0.0, kFirst, kFirst * MapScene::kStepNs);
  }

  TrackedFrame Frame(uint32_t index) const {
    TrackedFrame frame = scene_.See(index, index * MapScene::kStepNs, MapScene::PoseAt(0));
    for (size_t i = 0; i < scene_.size(); ++i) {
      frame.landmarks[i] = MapScene::IdOf(i);
      frame.classes[i] = FeatureClass::kUsed;
    }
    return frame;
  }
  FramePose Pose(uint32_t index, TrackingState state) const {
    const auto placed = PlacedPose::Of(scene_.map().FindKeyframe(First()), MapScene::PoseAt(0));
    FramePose pose;
    pose.frame_index = index;
    pose.stamp_ns = index * MapScene::kStepNs;
    pose.state = state;
    pose.map_id = MapScene::kMap;
    pose.reference = placed->reference;
    pose.T_cam_reference = placed->T_cam_reference;
    pose.T_cam_world = MapScene::PoseAt(0);
    return pose;
  }
  static KeyframeId First() { return KeyframeId::Make(MapScene::kSession, kFirst); }
  size_t NumTold() { return last_.Take(scene_.map()).size(); }

  static constexpr uint32_t kFirst = 200;
  MapScene scene_;
  LastPoses last_;
};

TEST_F(LastPosesTest, AFrameFarFromAllThatWereTrackedIsNotTold) {
  last_.Keep(Frame(kFirst), Pose(kFirst, TrackingState::kTracking));
  last_.AddPlaced(scene_.map(), Frame(20), Pose(20, TrackingState::kLocalizedLater), false);
  EXPECT_EQ(NumTold(), 0u);
}

TEST_F(LastPosesTest, UnlessALandmarkThatIsProvenConfirmsIt) {
  last_.Keep(Frame(kFirst), Pose(kFirst, TrackingState::kTracking));
  last_.AddPlaced(scene_.map(), Frame(20), Pose(20, TrackingState::kLocalizedLater), true);
  last_.AddPlaced(scene_.map(), Frame(18), Pose(18, TrackingState::kLocalizedLater), false);
  last_.AddPlaced(scene_.map(), Frame(80), Pose(80, TrackingState::kLocalizedLater), false);
  EXPECT_EQ(NumTold(), 2u) << "itself and the one beside it, and not the one two seconds later";
}

TEST_F(LastPosesTest, TellsWhereTheCameraWasInTheFrameBefore) {
  last_.Keep(Frame(kFirst + 1), Pose(kFirst + 1, TrackingState::kTracking));
  const auto before = last_.TrackedBefore(scene_.map(), MapScene::kMap, kFirst + 2);
  ASSERT_TRUE(before);
  EXPECT_EQ(before->index, kFirst + 1);
  EXPECT_LT(before->T_cam_world.translation.norm(), 1e-9);
  EXPECT_FALSE(last_.TrackedBefore(scene_.map(), MapScene::kMap, kFirst + 3)) << "a frame lies between";
  EXPECT_FALSE(last_.TrackedBefore(scene_.map(), MapScene::kMap + 1, kFirst + 2)) << "another map";
  EXPECT_FALSE(last_.TrackedBefore(scene_.map(), MapScene::kMap, kFirst)) << "it is after";
}

}  // namespace
}  // namespace dmslam
