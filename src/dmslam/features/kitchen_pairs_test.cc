// Real frames with true poses: the extractor must not be worse than cv::ORB.
#include "dmslam/features/testing/kitchen_pairs.h"

#include <gtest/gtest.h>

#include "dmslam/features/opencv_convert.h"

namespace dmslam::testing {
namespace {

TEST(KitchenPairs, RepeatsAndMatchesAtLeastAsWellAsCvOrb) {
  const auto folder = SequenceFolder("kitchen");
  if (!folder) GTEST_SKIP() << "no kitchen sequence; set DMSLAM_DATA to the folder that holds it";
  constexpr int kFeatures = 1000;
  OrbExtractorOptions options;
  options.num_features = kFeatures;
  OrbExtractor extractor(options);
  Quality ours, theirs;
  for (int first = 50; first < 1000; first += 190) {
    for (const int gap : {5, 10}) {
      const std::vector<TrueFrame> frames = LoadFrames(*folder, first, gap, 2);
      ASSERT_EQ(frames.size(), 2U);
      const PairGeometry geometry(frames[0], frames[1]);
      FeatureSet sets[2];
      for (size_t i = 0; i < 2; ++i) extractor.Extract(ViewOf(frames[i].grey), &sets[i]);
      const Pyramid& pyramid = extractor.options().pyramid;
      AddPair(FromSet(sets[0], pyramid), FromSet(sets[1], pyramid), geometry, &ours);
      AddPair(FromCvOrb(frames[0].grey, kFeatures), FromCvOrb(frames[1].grey, kFeatures), geometry, &theirs);
    }
  }
  EXPECT_GE(ours.Repeatability(), theirs.Repeatability());
  EXPECT_GE(ours.MeanInliers(), theirs.MeanInliers());
  EXPECT_GE(ours.Precision(), theirs.Precision());
  EXPECT_GE(ours.MeanCoverage(), theirs.MeanCoverage());
  EXPECT_LE(ours.MedianErrorPx(), 0.8 * theirs.MedianErrorPx());
}

}  // namespace
}  // namespace dmslam::testing
