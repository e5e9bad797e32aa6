// Time and quality of the extractor beside cv::ORB, on pairs of real frames with true poses.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <string>
#include <vector>

#include "dmslam/features/opencv_convert.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/features/testing/kitchen_pairs.h"
#include "dmslam/util/check.h"
#include "dmslam/util/version.h"

namespace dmslam {
namespace {

double Milliseconds(const std::chrono::steady_clock::duration& d) {
  return std::chrono::duration<double, std::milli>(d).count();
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

/// Both extractors in turn on every frame, so that whatever else the machine does meets both.
void MeasureTime(const std::vector<testing::TrueFrame>& frames, const OrbExtractorOptions& options,
                 int rounds) {
  OrbExtractor extractor(options);
  const auto orb = cv::ORB::create(options.num_features);
  FeatureSet set;
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  std::vector<double> ours, theirs;
  size_t our_count = 0, their_count = 0;
  for (int round = 0; round <= rounds; ++round) {
    for (const testing::TrueFrame& frame : frames) {
      const auto start = std::chrono::steady_clock::now();
      extractor.Extract(ViewOf(frame.grey), &set);
      const auto middle = std::chrono::steady_clock::now();
      orb->detectAndCompute(frame.grey, cv::noArray(), keypoints, descriptors);
      const auto end = std::chrono::steady_clock::now();
      if (round == 0) continue;
      ours.push_back(Milliseconds(middle - start));
      theirs.push_back(Milliseconds(end - middle));
      our_count += set.size();
      their_count += keypoints.size();
    }
  }
  const double count = static_cast<double>(ours.size());
  std::printf("time   ours %.3f ms (%.0f features)  cv::ORB %.3f ms (%.0f features)  ratio of medians %.3f\n",
              Median(ours), static_cast<double>(our_count) / count, Median(theirs),
              static_cast<double>(their_count) / count, Median(ours) / Median(theirs));
}

void Print(const char* name, int gap, const testing::Quality& q) {
  std::printf(
      "gap %2d %-8s features %6.1f  repeatability %.3f  matches %6.1f  inliers %6.1f (%.3f)  median epipolar "
      "error %.3f px  coverage %.3f\n",
      gap, name, static_cast<double>(q.features) / q.pairs, q.Repeatability(),
      static_cast<double>(q.matches) / q.pairs, q.MeanInliers(), q.Precision(), q.MedianErrorPx(),
      q.MeanCoverage());
}

void MeasureQuality(const std::string& folder, const OrbExtractorOptions& options, int gap, int step) {
  testing::Quality ours, theirs;
  OrbExtractor extractor(options);
  for (int first = 0; first + gap < 1000; first += step) {
    const auto frames = testing::LoadFrames(folder, first, gap, 2);
    if (frames.size() < 2) continue;
    const testing::PairGeometry geometry(frames[0], frames[1]);
    FeatureSet set0, set1;
    extractor.Extract(ViewOf(frames[0].grey), &set0);
    extractor.Extract(ViewOf(frames[1].grey), &set1);
    testing::AddPair(testing::FromSet(set0, options.pyramid), testing::FromSet(set1, options.pyramid),
                     geometry, &ours);
    testing::AddPair(testing::FromCvOrb(frames[0].grey, options.num_features),
                     testing::FromCvOrb(frames[1].grey, options.num_features), geometry, &theirs);
  }
  Print("ours", gap, ours);
  Print("cv::ORB", gap, theirs);
}

int Main(int argc, char** argv) {
  CLI::App app{"Time and quality of the ORB extractor beside cv::ORB on pairs of frames with true poses"};
  app.set_version_flag("--version", kVersion);
  OrbExtractorOptions options;
  options.num_features = 1000;
  std::string sequence = "kitchen";
  int rounds = 10, pair_step = 50;
  bool portable = false;
  app.add_option("--sequence", sequence, "sequence below DMSLAM_DATA, with the kitchen's camera");
  app.add_option("--features", options.num_features, "features per image");
  app.add_option("--cell", options.cell_size_px, "cell size [px]");
  app.add_option("--decay", options.rank_decay, "worth of a cell's next corner");
  app.add_option("--threshold", options.fast_threshold, "FAST threshold");
  app.add_option("--min-threshold", options.min_fast_threshold, "least FAST threshold");
  app.add_option("--rounds", rounds, "rounds over the frames that are timed; 0: no timing");
  app.add_option("--pair-step", pair_step, "frames between pairs; 0: no quality");
  app.add_flag("--portable", portable, "plain C++ kernels");
  CLI11_PARSE(app, argc, argv);
  if (portable) options.simd_path = SimdPath::kPortable;
  cv::setNumThreads(1);
  const auto folder = testing::SequenceFolder(sequence);
  if (!folder)
    throw InputError("sequence " + sequence + " not found; set DMSLAM_DATA to the folder that holds it");
  if (rounds > 0) MeasureTime(testing::LoadFrames(*folder, 0, 25, 40), options, rounds);
  for (const int gap : {5, 10, 20}) {
    if (pair_step > 0) MeasureQuality(*folder, options, gap, pair_step);
  }
  return 0;
}

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) {
  try {
    return dmslam::Main(argc, argv);
  } catch (const dmslam::InputError& error) {
    std::fprintf(stderr, "extractor_quality: %s\n", error.what());
    return 1;
  }
}
