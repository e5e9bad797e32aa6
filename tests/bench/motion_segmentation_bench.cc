// The three selectors at 2000 iterations in total on the same matches (the paper's Table 1), beside OpenCV's
// findFundamentalMat with RANSAC. `iterations` is what each really made. The matches are of two frames of
// kitchen_walk2 below $DMSLAM_DATA, or made up where that is not there (the label says which).
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/dataset/image.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/map/keyframe.h"
#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/motion_segmentation/ransac.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

constexpr int kIterations = 2000;
constexpr double kConfidence = 1.0 - 1e-15;  // the nearest to 1 that findFundamentalMat takes

struct BenchPair {
  std::vector<Match> matches;
  Camera camera;
  std::string label;
};

/// 1000 matches: 700 static, 200 on a mover, 100 mismatches.
BenchPair MadeUp() {
  SyntheticPairOptions options;
  options.num_static = 700;
  options.num_moving = 200;
  options.num_mismatches = 100;
  SyntheticPair pair = MakeSyntheticPair(options, 1);
  return {std::move(pair.matches), pair.camera, "made up"};
}

/// 1000 matches of two real frames, an even choice; nothing where the data is not there. Matched without
/// window, ratio and orientation: the more are wrong, the later findFundamentalMat stops.
std::optional<BenchPair> FromRecording() {
  const char* const data = std::getenv("DMSLAM_DATA");
  const std::string folder = std::string(data ? data : "../shared/data") + "/kitchen_walk2";
  if (!std::filesystem::exists(folder + "/rgb.txt")) return std::nullopt;
  BenchPair pair{{}, SyntheticCamera(), "kitchen_walk2 264-272"};
  pair.camera.fx_px = pair.camera.fy_px = 525.505;
  TumSequence sequence(folder);
  OrbExtractorOptions options;
  options.num_features = 4000;
  OrbExtractor extractor(options);
  std::vector<std::shared_ptr<const FrameFeatures>> features;
  for (const size_t frame : {264, 272}) {
    const GrayImage image = DecodeGray(sequence.Read(frame), sequence.Name(frame));
    FeatureSet set;
    extractor.Extract({image.data.data(), image.width, image.height, image.width}, &set);
    features.push_back(MakeFrameFeatures(std::move(set), pair.camera, options.pyramid));
  }
  FeatureMatcher matcher;
  MatchingOptions matching;
  matching.use_window = matching.check_orientation = false;
  matching.max_ratio = 1.0;
  pair.matches = ChooseEvenly(MatchFrames(*features[0], *features[1], pair.camera, matching, &matcher), 1000);
  return pair;
}

const BenchPair& Pair() {
  static const BenchPair pair = [] {
    auto recorded = FromRecording();
    return recorded ? std::move(*recorded) : MadeUp();
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
  state.SetLabel(Pair().label);
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

/// The default: stop by Eq. 4. The initialiser does without the search for a rival motion.
void BM_DlrsacDefault(benchmark::State& state) { Run(state, Dlrsac(DlrsacOptions())); }

/// How many samples of seven findFundamentalMat draws at this confidence, going by the inliers it found: it
/// stops by the same formula (paper Eq. 4), whatever confidence is asked for.
int IterationsOfOpenCv(const cv::Mat& mask, double confidence) {
  const double share = cv::countNonZero(mask) / static_cast<double>(mask.total());
  const double needed = std::log(1.0 - confidence) / std::log(1.0 - std::pow(share, 7));
  return static_cast<int>(std::min(static_cast<double>(kIterations), needed));
}

void BM_OpenCvRansac(benchmark::State& state) {
  std::vector<cv::Point2f> points0, points1;
  for (const Match& match : Pair().matches) {
    points0.emplace_back(static_cast<float>(match.uv0_px.x()), static_cast<float>(match.uv0_px.y()));
    points1.emplace_back(static_cast<float>(match.uv1_px.x()), static_cast<float>(match.uv1_px.y()));
  }
  cv::setNumThreads(1);
  cv::Mat mask;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        cv::findFundamentalMat(points0, points1, cv::FM_RANSAC, 1.96, kConfidence, kIterations, mask));
  }
  state.counters["iterations"] = IterationsOfOpenCv(mask, kConfidence);
  state.counters["matches"] = static_cast<double>(points0.size());
  state.SetLabel(Pair().label);
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
