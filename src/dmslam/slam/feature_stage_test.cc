#include "dmslam/slam/feature_stage.h"

#include <gtest/gtest.h>

#include "dmslam/features/gray_pixels.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// Squares of random brightness: more corners than anybody asks for.
GrayPixels Squares(int width = 480, int height = 360) {
  constexpr int kSide = 12;
  Random random(3);
  GrayPixels image(width, height);
  for (int y = 0; y < image.height; y += kSide) {
    for (int x = 0; x < image.width; x += kSide) {
      const auto grey = static_cast<uint8_t>(random.Below(256));
      for (int j = 0; j < kSide; ++j) {
        for (int i = 0; i < kSide; ++i) image.at(x + i, y + j) = grey;
      }
    }
  }
  return image;
}

OrbExtractorOptions Wanting(int num_features) {
  OrbExtractorOptions options;
  options.num_features = num_features;
  return options;
}

FeatureSet ExtractedBy(const OrbExtractorOptions& options, const GrayPixels& image) {
  FeatureSet features;
  OrbExtractor(options).Extract(image.View(), &features);
  return features;
}

void ExpectSameFeatures(const FeatureSet& a, const FeatureSet& b) {
  EXPECT_EQ(a.keypoints, b.keypoints);
  EXPECT_EQ(a.descriptors, b.descriptors);
}

TEST(FeatureStage, MoreFeaturesAreTakenWhileAFirstMapIsLookedFor) {
  const GrayPixels image = Squares();
  FeatureStage stage(Wanting(101), 2.5);
  EXPECT_EQ(stage.wanted(), 101) << "once there is a map";
  const FeatureSet first_map = stage.Extract(image.View(), true);
  EXPECT_EQ(first_map.size(), 253U) << "252.5, rounded";
  ExpectSameFeatures(first_map, ExtractedBy(Wanting(253), image));
  const FeatureSet later = stage.Extract(image.View(), false);
  EXPECT_EQ(later.size(), 101U);
  ExpectSameFeatures(later, ExtractedBy(Wanting(101), image));
}

TEST(FeatureStage, OfAFirstMapNoMoreThanTwoImagesOfARecordHold) {
  const GrayPixels image = Squares(1920, 1080);
  FeatureStage stage(Wanting(8000), 2.0);
  EXPECT_EQ(stage.Extract(image.View(), true).size(), 9000U);
}

TEST(FeatureStage, TheOtherOptionsHoldForBoth) {
  const GrayPixels image = Squares();
  OrbExtractorOptions options = Wanting(100);
  options.pyramid.levels = 1;
  FeatureStage stage(options, 2.0);
  for (const bool for_first_map : {true, false}) {
    const FeatureSet features = stage.Extract(image.View(), for_first_map);
    EXPECT_GT(features.size(), 0U);
    for (const Keypoint& keypoint : features.keypoints) EXPECT_EQ(keypoint.octave, 0);
  }
}

TEST(FeatureStage, SaysHowLongTheLastImageTook) {
  const GrayPixels image = Squares();
  FeatureStage stage(Wanting(100), 2.0);
  EXPECT_EQ(stage.last_ms(), 0);
  stage.Extract(image.View(), false);
  EXPECT_GT(stage.last_ms(), 0);
}

}  // namespace
}  // namespace dmslam
