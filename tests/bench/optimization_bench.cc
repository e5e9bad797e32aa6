// Local bundle adjustment, pose optimisation and essential graph, on synthetic data of the sizes that the
// system meets.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/bundle_adjustment.h"
#include "dmslam/optimization/essential_graph.h"
#include "dmslam/optimization/pose_optimization.h"
#include "local_bundle.h"

namespace dmslam {
namespace {

void BM_LocalBundle(benchmark::State& state) {
  const BundleProblem start = MakeLocalBundle(20, 2000, static_cast<int>(state.range(0)));
  int iterations = 0;
  for (auto _ : state) {
    BundleProblem problem = start;
    const BundleReport report = AdjustBundle({}, problem);
    iterations = report.iterations;
    benchmark::DoNotOptimize(report.final_cost);
  }
  state.counters["observations"] = static_cast<double>(start.observations.size());
  state.counters["iterations"] = iterations;
}
BENCHMARK(BM_LocalBundle)->Arg(4)->Arg(6)->Arg(10)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void BM_OptimizePose(benchmark::State& state) {
  const SyntheticScene scene = MakeSyntheticScene(
      {.seed = 5, .num_cameras = 1, .num_points = static_cast<int>(state.range(0)), .noise_px = 0.7});
  std::vector<PoseObservation> observations;
  Random random(6);
  for (const auto& o : scene.observations) {
    PoseObservation observation{scene.points[static_cast<size_t>(o.point)], o.uv_px};
    if (random.Below(10) == 0) observation.uv_px += Eigen::Vector2d(20, 10);
    observations.push_back(observation);
  }
  const Rigid3d start = RandomPose(random, 0.01, 0.03) * scene.T_cam_world[0];
  PoseOptimizationReport report;
  for (auto _ : state) {
    OptimizePose(scene.camera, start, observations, {}, report);
    benchmark::DoNotOptimize(report.T_cam_world);
  }
  state.counters["iterations"] = report.iterations;
  state.counters["inliers"] = report.num_inliers;
}
BENCHMARK(BM_OptimizePose)->Arg(300)->Arg(1000)->Unit(benchmark::kMicrosecond);

/// Two turns on a ring with drift in rotation and scale: every keyframe is tied to the four before it, and on
/// the second turn to one of the first.
EssentialGraphProblem MakeDriftedRings(int num_keyframes) {
  EssentialGraphProblem problem;
  std::vector<Sim3d> truth;
  Random random(7);
  for (int i = 0; i < num_keyframes; ++i) {
    const double angle = 2.0 * 6.283185307179586 * i / num_keyframes;
    const Eigen::Quaterniond rotation = ExpSo3({0.0, angle, 0.0});
    truth.emplace_back(
        rotation, rotation * Eigen::Vector3d(-10.0 * std::sin(angle), 0.0, -10.0 * std::cos(angle)), 1.0);
  }
  problem.S_cam_world.push_back(truth[0]);
  for (int i = 1; i < num_keyframes; ++i) {
    const auto n = static_cast<size_t>(i);
    Vector7d drift;
    drift << 3e-4 * random.Gaussian(), 3e-4, 3e-4 * random.Gaussian(), 0.0, 0.0, 0.0, 3e-4;
    problem.S_cam_world.push_back(ExpSim3(drift) * truth[n] * truth[n - 1].Inverse() *
                                  problem.S_cam_world[n - 1]);
    for (int back = 1; back <= std::min(4, i); ++back) {
      const Sim3d& earlier = problem.S_cam_world[n - static_cast<size_t>(back)];
      problem.edges.push_back({i - back, i, problem.S_cam_world[n] * earlier.Inverse(), 1.0});
    }
    const int half = num_keyframes / 2;
    if (i >= half && i % 10 == 0) {
      problem.edges.push_back({i - half, i, truth[n] * truth[static_cast<size_t>(i - half)].Inverse(), 1.0});
    }
  }
  return problem;
}

void BM_EssentialGraph(benchmark::State& state) {
  const EssentialGraphProblem start = MakeDriftedRings(static_cast<int>(state.range(0)));
  EssentialGraphReport report;
  for (auto _ : state) {
    EssentialGraphProblem problem = start;
    report = OptimizeEssentialGraph({}, problem);
  }
  state.counters["edges"] = static_cast<double>(start.edges.size());
  state.counters["iterations"] = report.iterations;
  state.counters["cost_ratio"] = report.final_cost / report.initial_cost;
}
BENCHMARK(BM_EssentialGraph)->Arg(300)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dmslam

BENCHMARK_MAIN();
