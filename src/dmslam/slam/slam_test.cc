// The whole SLAM on features of a cloud of points: poses beside the true ones, and the same ones again.
#include "dmslam/slam/slam.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "dmslam/geometry/similarity.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr uint32_t kFrames = 90;

/// The camera goes 1.2 to the right in 3 s, and up and down a little.
Rigid3d TruthAt(uint32_t frame) {
  Rigid3d T_cam_world = MapScene::PoseAt(1.2 * frame / kFrames);
  T_cam_world.translation.y() = 0.1 * std::sin(0.1 * frame);
  return T_cam_world;
}

Slam::Setup TestSetup() {
  Slam::Setup setup;
  setup.frontend.camera = TestCamera();
  setup.frontend.extractor.num_features = 1000;  // of which a lit frame has a tenth
  setup.frontend.seed = 1;
  return setup;
}

TrajectoryBuilder::Trajectories RunOn(const MapScene& scene, Slam* slam) {
  const auto all = [&scene](size_t point) { return std::optional(scene.point(point)); };
  for (uint32_t frame = 0; frame < kFrames; ++frame) {
    const TrackedFrame seen = scene.See(frame, frame * kFrameNs, TruthAt(frame), all);
    const FramePose pose = slam->ProcessFeatures(frame, frame * kFrameNs, seen.features->set);
    EXPECT_EQ(pose.frame_index, frame);
  }
  return slam->Finish();
}

TEST(SlamTest, PosesAreRightAndTheSameAgain) {
  MapScene scene;
  scene.AddCloud(700, {0.6, 0, 4}, {3.0, 1.8, 1.5});
  Slam slam(TestSetup());
  const auto trajectories = RunOn(scene, &slam);
  ASSERT_EQ(trajectories.final.size(), kFrames) << slam.frontend().counters().tracked << " tracked";
  EXPECT_GE(trajectories.online.size(), kFrames / 2);
  EXPECT_GT(slam.map().keyframes().size(), 2u);

  std::vector<Eigen::Vector3d> found, truth;
  for (uint32_t frame = 0; frame < kFrames; ++frame) {
    found.push_back(trajectories.final[frame].T_world_cam.translation);
    truth.push_back(TruthAt(frame).Center());
  }
  const std::optional<Sim3d> truth_from_found = AlignSim3(found, truth);
  ASSERT_TRUE(truth_from_found);
  for (uint32_t frame = 0; frame < kFrames; ++frame)
    EXPECT_LT((*truth_from_found * found[frame] - truth[frame]).norm(), 0.01) << frame;

  Slam other(TestSetup());
  const auto again = RunOn(scene, &other).final;
  ASSERT_EQ(again.size(), kFrames);
  for (uint32_t frame = 0; frame < kFrames; ++frame)
    EXPECT_EQ(FormatPose(again[frame]), FormatPose(trajectories.final[frame])) << frame;
}

TEST(SlamTest, WithoutAMapThereIsNoTrajectory) {
  Slam slam(TestSetup());
  for (uint32_t frame = 0; frame < 3; ++frame)
    EXPECT_FALSE(slam.ProcessFeatures(frame, frame * kFrameNs, FeatureSet()).HasPose());
  EXPECT_TRUE(slam.Finish().final.empty());
}

}  // namespace
}  // namespace dmslam
