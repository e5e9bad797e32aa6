// Learns the comparisons of the descriptor from photographs and prints them as the table that the extractor
// includes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "dmslam/console/command_line.h"
#include "dmslam/features/opencv_convert.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"
#include "pattern_learner.h"

namespace dmslam {
namespace {

std::vector<std::string> ImagesIn(const std::string& folder) {
  if (!std::filesystem::is_directory(folder))
    throw InputError(folder + ": no such folder; give one with photographs");
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

/// A small turn, change of size, slant and shift around the middle.
cv::Matx23d RandomWarp(const cv::Size& size, Random* random) {
  const double angle = random->Uniform(-0.3, 0.3), scale = std::exp(random->Uniform(-0.2, 0.2));
  const double stretch = std::exp(random->Uniform(-0.1, 0.1)), shear = random->Uniform(-0.15, 0.15);
  const cv::Matx22d turn(std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle));
  const cv::Matx22d shape(scale * stretch, shear, 0.0, scale / stretch);
  const cv::Matx22d A = turn * shape;
  const cv::Vec2d middle(0.5 * size.width, 0.5 * size.height);
  const cv::Vec2d shift = middle - A * middle + cv::Vec2d(random->Uniform(-1, 1), random->Uniform(-1, 1));
  return {A(0, 0), A(0, 1), shift[0], A(1, 0), A(1, 1), shift[1]};
}

cv::Mat ChangedImage(const cv::Mat& image, const cv::Matx23d& warp, Random* random) {
  cv::Mat changed;
  cv::warpAffine(image, changed, warp, image.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  const double gain = random->Uniform(0.8, 1.2), offset = random->Uniform(-10, 10);
  for (int y = 0; y < changed.rows; ++y) {
    for (int x = 0; x < changed.cols; ++x) {
      const double value = gain * changed.at<uint8_t>(y, x) + offset + 2.5 * random->Gaussian();
      changed.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(value);
    }
  }
  return changed;
}

/// Corners found in both images at the same place (to 1.5 pixels of their level) and about the same size.
void AddPairs(const cv::Mat& image, Random* random, OrbExtractor* extractor, std::vector<PatchPair>* pairs) {
  const cv::Matx23d warp = RandomWarp(image.size(), random);
  const cv::Mat changed = ChangedImage(image, warp, random);
  const double growth = std::sqrt(std::abs(warp(0, 0) * warp(1, 1) - warp(0, 1) * warp(1, 0)));
  const Pyramid& pyramid = extractor->options().pyramid;
  FeatureSet set0, set1;
  extractor->Extract(ViewOf(image), &set0);
  extractor->Extract(ViewOf(changed), &set1);
  const auto patches0 = CutPatches(ViewOf(image), set0, pyramid);
  const auto patches1 = CutPatches(ViewOf(changed), set1, pyramid);
  for (size_t i = 0; i < set0.size(); ++i) {
    const Keypoint& k0 = set0.keypoints[i];
    const cv::Vec2d place = warp * cv::Vec3d(k0.x_px(), k0.y_px(), 1.0);
    for (size_t j = 0; j < set1.size(); ++j) {
      const Keypoint& k1 = set1.keypoints[j];
      const double size = pyramid.Scale(k1.octave), size_ratio = pyramid.Scale(k0.octave) * growth / size;
      const bool same_size = size_ratio > 0.88 && size_ratio < 1.13;
      if (same_size && std::hypot(place[0] - k1.x_px(), place[1] - k1.y_px()) < 1.5 * size) {
        pairs->push_back({patches0[i], patches1[j]});
        break;
      }
    }
  }
}

struct Arguments {
  std::string folder;
  int num_images = 80;
  PatternLearnerOptions options;
};

void Declare(CommandLine& app, Arguments& a) {
  app.SetVersion(BuildVersion());
  app.AddOption("folder", a.folder, "folder of photographs").Required();
  app.AddOption("--images", a.num_images, "how many of them, evenly spread over the folder").Positive();
  app.AddOption("--candidates", a.options.num_candidates, "random tests to choose from").InRange(512, 100000);
  app.AddOption("--sigma", a.options.sigma_px, "spread of their points [px]").InRange(1.0, 50.0);
  app.AddOption("--seed", a.options.seed, "seed");
}

void Learn(const Arguments& a) {
  OrbExtractorOptions extractor_options;
  extractor_options.num_features = 400;
  extractor_options.pyramid.levels = 5;
  const std::vector<std::string> files = ImagesIn(a.folder);
  OrbExtractor extractor(extractor_options);
  std::vector<PatchPair> pairs;
  const size_t step = std::max<size_t>(1, files.size() / static_cast<size_t>(a.num_images));
  for (size_t i = 0; i < files.size(); i += step) {
    const cv::Mat image = cv::imread(files[i], cv::IMREAD_GRAYSCALE);
    Random random(DeriveSeed(a.options.seed, i, "warp"));
    if (!image.empty()) AddPairs(image, &random, &extractor, &pairs);
  }
  std::fprintf(stderr, "%zu corners seen twice\n", pairs.size());
  for (const BriefTest& test : LearnPattern(pairs, a.options)) {
    std::printf("{%d, %d, %d, %d},\n", test.x0, test.y0, test.x1, test.y1);
  }
}

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) {
  dmslam::CommandLine app(
      "Learns the extractor's comparisons from photographs; prints the table that brief_pattern.cc includes",
      "learn_brief_pattern");
  dmslam::Arguments arguments;
  dmslam::Declare(app, arguments);
  return app.Run(argc, argv, [&] { dmslam::Learn(arguments); });
}
