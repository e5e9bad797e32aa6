// Every step of the system on real frames: 400 frames of kitchen below $DMSLAM_DATA are tracked and mapped
// once by the cores alone, on one thread, and cv::ORB extracts each frame beside them. Times are CPU times of
// that thread. The benchmarks report what was measured: the time is the mean, the quantiles are counters.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <string>
#include <vector>

#include "core_loop.h"
#include "dmslam/camera/camera.h"
#include "dmslam/features/opencv_convert.h"
#include "dmslam/features/testing/kitchen_pairs.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/util/check.h"

namespace dmslam::bench {
namespace {

constexpr int kFrames = 400;
constexpr int64_t kFrameNs = 33'333'333;
constexpr int kOrbFeatures = 1000;

struct Series {
  std::string name;
  std::vector<double> values_ms;

  double Quantile(double q) const {
    std::vector<double> sorted = values_ms;
    std::sort(sorted.begin(), sorted.end());
    return sorted[std::min(sorted.size() - 1, static_cast<size_t>(q * static_cast<double>(sorted.size())))];
  }
};

/// One run over the frames with so many features.
std::vector<Series> Measure(const std::vector<testing::TrueFrame>& frames, int num_features) {
  Settings settings;
  settings.Set("features.count", std::to_string(num_features));
  const Camera camera = LoadCamera(FindDataFolder("config") + "/kitchen.yaml");
  CoreLoop loop(settings, camera, LoadVocabulary(""));
  const auto orb = cv::ORB::create(kOrbFeatures);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  std::string of = "/";
  of += std::to_string(num_features);
  Series frontend{"FrontendStep" + of, {}}, orb_times{"CvOrbBeside" + of, {}},
      landmarks{"KeyframeToLandmarks" + of, {}}, adjusted{"KeyframeToAdjusted" + of, {}},
      check{"LoopCheck" + of, {}}, replica{"ReplicaUpdateOfKeyframe" + of, {}},
      search{"FirstMapSearch" + of, {}};
  for (size_t i = 0; i < frames.size(); ++i) {
    const Stopwatch watch;
    orb->detectAndCompute(frames[i].grey, cv::noArray(), keypoints, descriptors);
    const double orb_ms = watch.ms();
    const StepTimes times = loop.StepImage(static_cast<uint32_t>(i), static_cast<int64_t>(i) * kFrameNs + 1,
                                           ViewOf(frames[i].grey));
    const TrackingState state = loop.frontend().state();
    if (loop.frontend().IsSearching()) search.values_ms.push_back(times.frontend);
    if (state != TrackingState::kTracking && state != TrackingState::kTrial) continue;
    orb_times.values_ms.push_back(orb_ms);
    frontend.values_ms.push_back(times.frontend);
    if (!times.keyframe) continue;
    landmarks.values_ms.push_back(times.to_landmarks);
    adjusted.values_ms.push_back(times.to_adjusted);
    check.values_ms.push_back(times.check);
    replica.values_ms.push_back(times.replica_update);
  }
  return {frontend, orb_times, search, landmarks, adjusted, check, replica};
}

void Report(benchmark::State& state, const Series& series) {
  size_t next = 0;
  for (auto _ : state) state.SetIterationTime(series.values_ms[next++ % series.values_ms.size()] * 1e-3);
  state.counters["p50_ms"] = series.Quantile(0.5);
  state.counters["p95_ms"] = series.Quantile(0.95);
  state.counters["p99_ms"] = series.Quantile(0.99);
  state.counters["max_ms"] = series.Quantile(1.0);
}

int Main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  const auto folder = testing::SequenceFolder("kitchen");
  if (!folder) throw InputError("sequence kitchen not found; set DMSLAM_DATA to the folder that holds it");
  const std::vector<testing::TrueFrame> frames = testing::LoadFrames(*folder, 0, 1, kFrames);
  std::vector<Series> all;
  for (const int num_features : {1000, 2000}) {
    for (Series& series : Measure(frames, num_features)) {
      if (!series.values_ms.empty()) all.push_back(std::move(series));
    }
  }
  for (const Series& series : all) {
    benchmark::RegisterBenchmark(("BM_" + series.name).c_str(),
                                 [&series](benchmark::State& s) { Report(s, series); })
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond)
        ->Iterations(static_cast<int64_t>(series.values_ms.size()));
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace dmslam::bench

int main(int argc, char** argv) {
  try {
    return dmslam::bench::Main(argc, argv);
  } catch (const dmslam::InputError& error) {
    std::fprintf(stderr, "tracking_bench: %s\n", error.what());
    return 1;
  }
}
