// The extractor and its parts beside cv::ORB, and the matcher, on real frames where they are at hand, else on
// a made-up picture. Every benchmark works through the same frames, one per iteration.
#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

#include "dmslam/features/matcher.h"
#include "dmslam/features/opencv_convert.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/features/testing/kitchen_pairs.h"
#include "dmslam/features/testing/synthetic_images.h"

namespace dmslam {
namespace {

constexpr int kFrameGap = 5;

/// Pairs of frames some frames apart: 0 and 1, 2 and 3, ...
const std::vector<cv::Mat>& Frames() {
  static const std::vector<cv::Mat> frames = [] {
    std::vector<cv::Mat> images;
    if (const auto folder = testing::SequenceFolder("kitchen")) {
      for (int first = 0; first < 1000; first += 50) {
        for (const auto& frame : testing::LoadFrames(*folder, first, kFrameGap, 2))
          images.push_back(frame.grey);
      }
    }
    if (images.empty()) images.assign(2, MatOf(testing::RandomRectangles(640, 480, 600, 1).View()));
    return images;
  }();
  return frames;
}

/// The next frame of a benchmark that has had `iteration` of them.
const cv::Mat& FrameOf(size_t iteration) { return Frames()[iteration % Frames().size()]; }

void BM_CvOrb(benchmark::State& state) {
  const auto orb = cv::ORB::create(static_cast<int>(state.range(0)));
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  size_t iteration = 0;
  for (auto _ : state) orb->detectAndCompute(FrameOf(iteration++), cv::noArray(), keypoints, descriptors);
}
BENCHMARK(BM_CvOrb)->Arg(1000)->Arg(2000)->Unit(benchmark::kMicrosecond);

void RunExtractor(benchmark::State& state, SimdPath path) {
  OrbExtractorOptions options;
  options.num_features = static_cast<int>(state.range(0));
  options.simd_path = path;
  if (!HasSimdPath(path)) {
    state.SkipWithError("this CPU lacks the instructions");
    return;
  }
  OrbExtractor extractor(options);
  FeatureSet features;
  size_t iteration = 0;
  for (auto _ : state) extractor.Extract(ViewOf(FrameOf(iteration++)), &features);
}
void BM_Extractor(benchmark::State& state) { RunExtractor(state, SimdPath::kBest); }
void BM_ExtractorSse2(benchmark::State& state) { RunExtractor(state, SimdPath::kSse2); }
void BM_ExtractorPortable(benchmark::State& state) { RunExtractor(state, SimdPath::kPortable); }
BENCHMARK(BM_Extractor)->Arg(1000)->Arg(2000)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_ExtractorSse2)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_ExtractorPortable)->Arg(1000)->Unit(benchmark::kMicrosecond);

/// The levels of a frame's pyramid.
ImagePyramid PyramidOf(const cv::Mat& frame) {
  ImagePyramid pyramid;
  pyramid.SetUp(frame.cols, frame.rows, Pyramid(), 32);
  pyramid.MakeFirst(ViewOf(frame), KernelsOn(SimdPath::kBest));
  for (size_t i = 1; i < pyramid.size(); ++i) pyramid.ShrinkInto(i, KernelsOn(SimdPath::kBest));
  return pyramid;
}

void BM_PartPyramid(benchmark::State& state) {
  ImagePyramid pyramid;
  pyramid.SetUp(Frames()[0].cols, Frames()[0].rows, Pyramid(), 32);
  size_t iteration = 0;
  for (auto _ : state) {
    pyramid.MakeFirst(ViewOf(FrameOf(iteration++)), KernelsOn(SimdPath::kBest));
    for (size_t i = 1; i < pyramid.size(); ++i) pyramid.ShrinkInto(i, KernelsOn(SimdPath::kBest));
  }
}
BENCHMARK(BM_PartPyramid)->Unit(benchmark::kMicrosecond);

std::vector<ImagePyramid> AllPyramids() {
  std::vector<ImagePyramid> pyramids;
  for (const cv::Mat& frame : Frames()) pyramids.push_back(PyramidOf(frame));
  return pyramids;
}

void BM_PartCorners(benchmark::State& state) {
  const std::vector<ImagePyramid> pyramids = AllPyramids();
  CornerDetector detector;
  std::vector<Corner> corners;
  size_t iteration = 0;
  for (auto _ : state) {
    const ImagePyramid& pyramid = pyramids[iteration++ % pyramids.size()];
    for (size_t i = 0; i < pyramid.size(); ++i) {
      detector.Detect(pyramid.level(i).image, static_cast<int>(state.range(0)), 16,
                      KernelsOn(SimdPath::kBest), &corners);
    }
  }
}
BENCHMARK(BM_PartCorners)->Arg(7)->Arg(20)->Unit(benchmark::kMicrosecond);

void BM_PartSelection(benchmark::State& state) {
  const std::vector<ImagePyramid> pyramids = AllPyramids();
  std::vector<std::vector<Corner>> corners(pyramids.size());
  CornerDetector detector;
  for (size_t i = 0; i < pyramids.size(); ++i) {
    detector.Detect(pyramids[i].level(0).image, 7, 16, KernelsOn(SimdPath::kBest), &corners[i]);
  }
  CornerSelector selector;
  std::vector<Corner> chosen;
  size_t iteration = 0;
  for (auto _ : state) selector.Select(corners[iteration++ % corners.size()], 217, 640, 480, {}, &chosen);
}
BENCHMARK(BM_PartSelection)->Unit(benchmark::kMicrosecond);

void BM_PartSmoothing(benchmark::State& state) {
  const ImagePyramid pyramid = PyramidOf(Frames()[0]);
  ImageSmoother smoother;
  PaddedImage smooth;
  for (auto _ : state) {
    for (size_t i = 0; i < pyramid.size(); ++i) {
      smoother.Smooth(pyramid.level(i).image, KernelsOn(SimdPath::kBest), &smooth);
    }
  }
}
BENCHMARK(BM_PartSmoothing)->Unit(benchmark::kMicrosecond);

/// Two frames' features, ready to match.
struct MatchPair {
  FeatureSet sets[2];
  std::vector<Eigen::Vector2d> uv_px[2];
  FeatureGrid grid;

  MatchSide Side(size_t i) const { return {sets[i].keypoints, sets[i].descriptors, uv_px[i]}; }
};

std::vector<MatchPair> MatchPairs(int num_features) {
  OrbExtractorOptions options;
  options.num_features = num_features;
  OrbExtractor extractor(options);
  std::vector<MatchPair> pairs(Frames().size() / 2);
  for (size_t p = 0; p < pairs.size(); ++p) {
    for (size_t i = 0; i < 2; ++i) {
      const cv::Mat& frame = Frames()[2 * p + i];
      extractor.Extract(ViewOf(frame), &pairs[p].sets[i]);
      for (const Keypoint& k : pairs[p].sets[i].keypoints) pairs[p].uv_px[i].emplace_back(k.x_px(), k.y_px());
    }
    pairs[p].grid.Build(pairs[p].uv_px[1], pairs[p].sets[1].keypoints, 640, 480);
  }
  return pairs;
}

void BM_MatchWindow(benchmark::State& state) {
  const std::vector<MatchPair> pairs = MatchPairs(static_cast<int>(state.range(0)));
  FeatureMatcher matcher;
  std::vector<FeatureMatch> matches;
  size_t iteration = 0, total = 0;
  for (auto _ : state) {
    const MatchPair& pair = pairs[iteration++ % pairs.size()];
    matcher.MatchWindow(pair.Side(0), pair.Side(1), pair.grid, {}, &matches);
    total += matches.size();
  }
  state.counters["matches"] = static_cast<double>(total) / static_cast<double>(iteration);
}
BENCHMARK(BM_MatchWindow)->Arg(1000)->Arg(3000)->Unit(benchmark::kMicrosecond);

void BM_MatchAll(benchmark::State& state) {
  const std::vector<MatchPair> pairs = MatchPairs(static_cast<int>(state.range(0)));
  FeatureMatcher matcher;
  std::vector<FeatureMatch> matches;
  size_t iteration = 0;
  for (auto _ : state) {
    const MatchPair& pair = pairs[iteration++ % pairs.size()];
    matcher.MatchAll(pair.Side(0), pair.Side(1), {}, &matches);
  }
}
BENCHMARK(BM_MatchAll)->Arg(1000)->Unit(benchmark::kMicrosecond);

void BM_FindMatchOfThousandProjections(benchmark::State& state) {
  const std::vector<MatchPair> pairs = MatchPairs(1000);
  FeatureMatcher matcher;
  size_t iteration = 0, found = 0;
  for (auto _ : state) {
    const MatchPair& pair = pairs[iteration++ % pairs.size()];
    for (size_t i = 0; i < pair.sets[0].size(); ++i) {
      const int octave = pair.sets[0].keypoints[i].octave;
      const SearchArea area{pair.uv_px[0][i], 15.0, octave - 1, octave + 1};
      found += matcher.FindMatch(pair.sets[0].descriptors[i], area, pair.Side(1), pair.grid, 50, 0.8) ? 1 : 0;
    }
  }
  benchmark::DoNotOptimize(found);
}
BENCHMARK(BM_FindMatchOfThousandProjections)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
