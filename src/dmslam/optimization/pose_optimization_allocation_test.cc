// Pose optimisation runs in every frame: once its report has grown, it must not touch the heap.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/pose_optimization.h"

namespace {
int allocations = 0;
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

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
  allocations = 0;
  OptimizePose(scene.camera, scene.T_cam_world[0], observations, options, report);
  EXPECT_GT(allocations, 0);  // The counter works.
  allocations = 0;
  for (int k = 0; k < 10; ++k)
    OptimizePose(scene.camera, scene.T_cam_world[0], observations, options, report);
  EXPECT_EQ(allocations, 0);
  EXPECT_TRUE(report.usable);
}

}  // namespace
}  // namespace dmslam
