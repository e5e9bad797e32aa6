#include "dmslam/slam/feature_stage.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace dmslam {
namespace {

/// Two such images, and the points that they have in common, fit into one record (1 MiB).
constexpr double kMostForFirstMap = 9000;

OrbExtractorOptions WithMoreFeatures(OrbExtractorOptions options, double factor) {
  options.num_features =
      static_cast<int>(std::lround(std::min(factor * options.num_features, kMostForFirstMap)));
  return options;
}

}  // namespace

FeatureStage::FeatureStage(const OrbExtractorOptions& options, double first_map_factor)
    : extractor_(options),
      first_map_extractor_(WithMoreFeatures(options, first_map_factor)),
      wanted_(options.num_features) {}

FeatureSet FeatureStage::Extract(const GrayView& image, bool for_first_map) {
  const auto start = std::chrono::steady_clock::now();
  FeatureSet features;
  (for_first_map ? first_map_extractor_ : extractor_).Extract(image, &features);
  last_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return features;
}

}  // namespace dmslam
