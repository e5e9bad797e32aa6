// Pose optimisation runs in every frame: once its report has grown, it must not touch the heap.
#include <gtest/gtest.h>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/util/testing/allocations.h"

namespace dmslam {
namespace {

TEST(OptimizePose, SteadyStateDoesNotAllocate) {
  const SyntheticScene scene = MakeSyntheticScene({.num_cameras = 1, .num_points = 200, .noise_px = 0.5});
  std::vector<PoseObservation> observations;
  for (const auto& o : scene.observations) {
    observations.push_back({scene.points[static_cast<size_t>(o.point)], o.uv_px});
  }
  const PoseOptimizationOptions options;
  PoseOptimizationReport report;
  testing::allocations = {};
  OptimizePose(scene.camera, scene.T_cam_world[0], observations, options, report);
  EXPECT_GT(testing::allocations.count, 0);  // The counter works.
  testing::allocations = {};
  for (int k = 0; k < 10; ++k)
    OptimizePose(scene.camera, scene.T_cam_world[0], observations, options, report);
  EXPECT_EQ(testing::allocations.count, 0);
  EXPECT_TRUE(report.usable);
}

}  // namespace
}  // namespace dmslam
