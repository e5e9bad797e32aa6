// The three selectors at 2000 iterations in total on the same matches (the paper's Table 1), beside OpenCV's
// findFundamentalMat with RANSAC. `iterations` is what each really made.
#include <benchmark/benchmark.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/ransac.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

constexpr int kIterations = 2000;

/// 1000 matches: 700 static, 200 on a mover, 100 mismatches.
const SyntheticPair& Pair() {
  static const SyntheticPair pair = [] {
    SyntheticPairOptions options;
    options.num_static = 700;
    options.num_moving = 200;
    options.num_mismatches = 100;
    return MakeSyntheticPair(options, 1);
  }();
  return pair;
}

/// Sampling alone: no refits, no early stop, as findFundamentalMat.
SamplingOptions Sampling(ModelKind kind) {
  SamplingOptions sampling;
  sampling.kind = kind;
  sampling.max_iterations = kIterations;
  sampling.stop_confidence = 0;
  return sampling;
}

void Run(benchmark::State& state, const StaticSelector& selector) {
  int iterations = 0;
  uint64_t seed = 0;
  for (auto _ : state) {
    const StaticSelection selection = selector.Select(Pair().matches, Pair().camera, ++seed);
    iterations = selection.iterations;
    benchmark::DoNotOptimize(selection.F);
  }
  state.counters["iterations"] = iterations;
  state.counters["matches"] = static_cast<double>(Pair().matches.size());
}

void BM_Ransac(benchmark::State& state, ModelKind kind) {
  RansacSelectorOptions options;
  options.sampling = Sampling(kind);
  Run(state, RansacSelector(options));
}

void BM_Arsac(benchmark::State& state, ModelKind kind) {
  ArsacOptions options;
  options.sampling = Sampling(kind);
  Run(state, Arsac(options));
}

void BM_DlrsacPaper(benchmark::State& state, ModelKind kind) {
  DlrsacOptions options = DlrsacOptions::Paper();
  options.sampling.kind = kind;
  Run(state, Dlrsac(options));
}

/// The default with all its parts, but without the early stop.
void BM_Dlrsac(benchmark::State& state, ModelKind kind) {
  DlrsacOptions options;
  options.sampling = Sampling(kind);
  options.sampling.refit_rounds = 3;
  Run(state, Dlrsac(options));
}

/// As the system runs it: stop by Eq. 4.
void BM_DlrsacDefault(benchmark::State& state) { Run(state, Dlrsac(DlrsacOptions())); }

void BM_OpenCvRansac(benchmark::State& state) {
  std::vector<cv::Point2f> points0, points1;
  for (const Match& match : Pair().matches) {
    points0.emplace_back(static_cast<float>(match.uv0_px.x()), static_cast<float>(match.uv0_px.y()));
    points1.emplace_back(static_cast<float>(match.uv1_px.x()), static_cast<float>(match.uv1_px.y()));
  }
  cv::setNumThreads(1);
  cv::Mat mask;
  for (auto _ : state) {
    // A confidence so near to 1 that all iterations are made whatever the inlier share.
    benchmark::DoNotOptimize(
        cv::findFundamentalMat(points0, points1, cv::FM_RANSAC, 1.96, 1.0 - 1e-15, kIterations, mask));
  }
  state.counters["iterations"] = kIterations;
  state.counters["matches"] = static_cast<double>(points0.size());
}

BENCHMARK(BM_OpenCvRansac)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Ransac, F, ModelKind::kFundamental)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Arsac, F, ModelKind::kFundamental)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_DlrsacPaper, F, ModelKind::kFundamental)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Ransac, E, ModelKind::kEssential)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Arsac, E, ModelKind::kEssential)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_DlrsacPaper, E, ModelKind::kEssential)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Dlrsac, E, ModelKind::kEssential)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_DlrsacDefault)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dmslam

BENCHMARK_MAIN();
