#include "dmslam/features/orb_extractor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "dmslam/features/gray_pixels.h"
#include "dmslam/features/subpixel.h"
#include "dmslam/features/testing/allocation_counter.h"
#include "dmslam/features/testing/synthetic_images.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using testing::RandomRectangles;
using testing::Turned;

/// The tests expect what this many features give.
OrbExtractorOptions ThousandFeatures() {
  OrbExtractorOptions options;
  options.num_features = 1000;
  return options;
}

FeatureSet Extract(const GrayPixels& image, const OrbExtractorOptions& options = ThousandFeatures()) {
  FeatureSet features;
  OrbExtractor(options).Extract(image.View(), &features);
  return features;
}

TEST(OrbExtractor, FindsTheCornersOfASquare) {
  const Pyramid pyramid = Pyramid().OfImages(200, 160);
  GrayPixels image(200, 160, 60);
  for (int y = 50; y < 110; ++y) {
    for (int x = 60; x < 140; ++x) image.at(x, y) = 200;
  }
  const FeatureSet features = Extract(image);
  const double corners[4][2] = {{60, 50}, {139, 50}, {60, 109}, {139, 109}};
  for (const auto& corner : corners) {
    double nearest = 1e9;
    for (const Keypoint& k : features.keypoints) {
      if (k.octave == 0) nearest = std::min(nearest, std::hypot(k.x_px() - corner[0], k.y_px() - corner[1]));
    }
    EXPECT_LT(nearest, 2.5 * pyramid.Sigma(0));  // scores around a perfect corner are equal: the first counts
  }
  for (const Keypoint& k : features.keypoints) {
    double nearest = 1e9;
    for (const auto& corner : corners)
      nearest = std::min(nearest, std::hypot(k.x_px() - corner[0], k.y_px() - corner[1]));
    EXPECT_LT(nearest, 4.0 * pyramid.Sigma(k.octave)) << "a keypoint away from every corner";
  }
}

TEST(OrbExtractor, OrientationPointsToTheBrightSide) {
  GrayPixels image(120, 120, 40);
  for (int y = 60; y < 120; ++y) {
    for (int x = 60; x < 120; ++x) image.at(x, y) = 220;  // bright towards +x +y: an eighth of a turn
  }
  OrbExtractorOptions options = ThousandFeatures();
  options.pyramid.levels = 1;
  const FeatureSet features = Extract(image, options);
  ASSERT_GE(features.size(), 1U);
  for (const Keypoint& k : features.keypoints) EXPECT_NEAR(k.angle, 32, 3);
}

TEST(OrbExtractor, GivesTheNumberAskedAndUniqueKeypoints) {
  const FeatureSet features = Extract(RandomRectangles(640, 480, 600, 1));
  EXPECT_EQ(features.size(), 1000U);
  EXPECT_EQ(features.descriptors.size(), 1000U);
  std::set<Keypoint> unique(features.keypoints.begin(), features.keypoints.end());
  EXPECT_EQ(unique.size(), 1000U);
  std::array<int, 8> per_octave{};
  for (const Keypoint& k : features.keypoints) ++per_octave[k.octave];
  for (size_t i = 0; i < 8; ++i) {
    const double share =
        std::pow(1 / 1.2, static_cast<double>(i)) * (1 - 1 / 1.2) / (1 - std::pow(1 / 1.2, 8));
    EXPECT_NEAR(per_octave[i], 1000 * share, 0.25 * 1000 * share) << "octave " << i;
  }
}

TEST(OrbExtractor, FindsInASmallImageWhatTheImageTwiceAsLargeShows) {
  const GrayPixels small = RandomRectangles(320, 240, 150, 4);
  PaddedImage from, to;
  from.Resize(320, 240);
  for (int y = 0; y < 240; ++y) std::copy_n(small.View().row(y), 320, from.row(y));
  ImageResizer(320, 240, 640, 480).Resize(from, KernelsOn(SimdPath::kBest), &to);
  OrbExtractor extractor(ThousandFeatures());
  FeatureSet found, enlarged;
  extractor.Extract(small.View(), &found);
  extractor.Extract(to.View(), &enlarged);
  ASSERT_GT(found.size(), 500U);
  EXPECT_EQ(found.descriptors, enlarged.descriptors);
  ASSERT_EQ(found.size(), enlarged.size());
  for (size_t i = 0; i < found.size(); ++i) {
    const Keypoint &a = found.keypoints[i], &b = enlarged.keypoints[i];
    EXPECT_EQ(a.octave, b.octave);
    EXPECT_NEAR(2 * (a.x_px() + 0.5), b.x_px() + 0.5, 0.1);
    EXPECT_NEAR(2 * (a.y_px() + 0.5), b.y_px() + 0.5, 0.1);
  }
}

TEST(Pyramid, EnlargesSmallImagesToTwiceTheirSizeAtMost) {
  const auto finest_px = [](int width, int height) { return Pyramid().OfImages(width, height).finest_px; };
  EXPECT_EQ(finest_px(640, 480), 1.0);
  EXPECT_EQ(finest_px(1226, 370), 1.0);
  EXPECT_EQ(finest_px(600, 450), 1.0) << "too little to be worth it";
  EXPECT_NEAR(finest_px(480, 360), 0.75, 1e-12);
  EXPECT_EQ(finest_px(320, 240), 0.5);
  EXPECT_EQ(finest_px(80, 60), 0.5);
  EXPECT_EQ(Pyramid().OfImages(320, 240).Sigma(0), 0.5);
  EXPECT_EQ(Pyramid().OfImages(320, 240).SigmaSquared(0), 0.25);
  EXPECT_EQ(Pyramid().OfImages(320, 240).Scale(1), 1.2) << "of two levels";
}

TEST(Pyramid, ReachesAsFarInLargeImages) {
  const auto num_levels = [](int width, int height) { return Pyramid().OfImages(width, height).NumLevels(); };
  EXPECT_EQ(num_levels(320, 240), 8);
  EXPECT_EQ(num_levels(640, 480), 8);
  EXPECT_EQ(num_levels(1226, 370), 8) << "its shorter side is no longer";
  EXPECT_EQ(num_levels(1280, 960), 12);
  EXPECT_EQ(num_levels(1920, 1080), 12);
  EXPECT_EQ(Pyramid().OfImages(1280, 960).OfImages(1280, 960).NumLevels(), 12) << "said twice";
  EXPECT_EQ(Pyramid().OfImages(1280, 960).SearchScale(4), 1.0);
  EXPECT_EQ(Pyramid().OfImages(1280, 960).SearchScale(5), 1.2);
  EXPECT_EQ(Pyramid().OfImages(640, 480).SearchScale(1), 1.2);
  EXPECT_EQ((Pyramid{.levels = 14}.OfImages(1280, 960).NumLevels()), 16);
}

TEST(OrbExtractor, LooksAsCoarselyAtALargeImageAsAtASmallOne) {
  const GrayPixels small = RandomRectangles(640, 480, 250, 2);
  GrayPixels large(2 * small.width, 2 * small.height);
  for (int y = 0; y < large.height; ++y) {
    for (int x = 0; x < large.width; ++x) large.at(x, y) = small.at(x / 2, y / 2);
  }
  const auto coarsest = [](const FeatureSet& set, int from) {
    return std::count_if(set.keypoints.begin(), set.keypoints.end(),
                         [&](const Keypoint& k) { return k.octave >= from; });
  };
  const auto found = coarsest(Extract(small), 6);
  ASSERT_GT(found, 50);
  EXPECT_GT(coarsest(Extract(large), 10), found / 3) << "as many features share more levels";
}

TEST(OrbExtractor, DescriptorsTurnWithTheImage) {
  const GrayPixels image = RandomRectangles(400, 400, 250, 2);
  const FeatureSet upright = Extract(image);
  for (const double degrees : {20.0, 90.0, 145.0}) {
    const double radians = degrees * std::numbers::pi / 180.0;
    const FeatureSet turned = Extract(Turned(image, radians));
    int repeated = 0, alike = 0;
    double turn_error = 0.0;
    for (size_t i = 0; i < upright.size(); ++i) {
      const double dx = upright.keypoints[i].x_px() - 199.5, dy = upright.keypoints[i].y_px() - 199.5;
      const double x = std::cos(radians) * dx - std::sin(radians) * dy + 199.5;
      const double y = std::sin(radians) * dx + std::cos(radians) * dy + 199.5;
      for (size_t j = 0; j < turned.size(); ++j) {
        const Keypoint& k = turned.keypoints[j];
        if (k.octave != upright.keypoints[i].octave || std::hypot(k.x_px() - x, k.y_px() - y) > 1.0) continue;
        ++repeated;
        if (HammingDistance(upright.descriptors[i], turned.descriptors[j]) <= 50) ++alike;
        const int turn =
            (k.angle - upright.keypoints[i].angle - static_cast<int>(std::lround(degrees / 360 * 256))) & 255;
        turn_error += std::min(turn, 256 - turn);
        break;
      }
    }
    EXPECT_GT(repeated, 250) << degrees;
    EXPECT_GT(alike, 0.8 * repeated) << degrees;
    EXPECT_LT(turn_error / repeated, 8.0) << degrees;
  }
}

TEST(OrbExtractor, KeypointsSpreadOverTheImage) {
  // Strong corners on the left, weak ones on the right: with rank_decay the right side gets its share.
  GrayPixels image = RandomRectangles(640, 480, 900, 3);
  for (int y = 0; y < 480; ++y) {
    for (int x = 320; x < 640; ++x) image.at(x, y) = static_cast<uint8_t>(96 + image.at(x, y) / 4);
  }
  const auto share_on_the_right = [&](double rank_decay) {
    OrbExtractorOptions options = ThousandFeatures();
    options.rank_decay = rank_decay;
    const FeatureSet features = Extract(image, options);
    int right = 0;
    for (const Keypoint& k : features.keypoints) right += k.x_px() > 330 ? 1 : 0;
    return static_cast<double>(right) / static_cast<double>(features.size());
  };
  EXPECT_LT(share_on_the_right(1.0), 0.1);
  EXPECT_GT(share_on_the_right(0.7), share_on_the_right(1.0) + 0.02);
  EXPECT_GT(share_on_the_right(0.0), 0.4);
}

TEST(OrbExtractor, WeakCornersServeOnlyWhereThereAreNoStrongOnes) {
  GrayPixels image(300, 200, 100);
  const auto square = [&](int x0, int y0, int value) {
    for (int y = y0; y < y0 + 12; ++y) {
      for (int x = x0; x < x0 + 12; ++x) image.at(x, y) = static_cast<uint8_t>(value);
    }
  };
  square(50, 50, 200);
  square(74, 74, 112);    // contrast 12, in the cell of the strong square's corner
  square(170, 120, 112);  // contrast 12, alone
  OrbExtractorOptions options = ThousandFeatures();
  options.pyramid.levels = 1;
  options.cell_size_px = 96;
  const FeatureSet features = Extract(image, options);
  int strong = 0, shadowed = 0, alone = 0;
  for (const Keypoint& k : features.keypoints) {
    strong += k.x_px() < 66 ? 1 : 0;
    shadowed += k.x_px() > 70 && k.x_px() < 90 ? 1 : 0;
    alone += k.x_px() > 160 ? 1 : 0;
  }
  EXPECT_GT(strong, 3);
  EXPECT_EQ(shadowed, 0);
  EXPECT_GT(alone, 3);
}

TEST(OrbExtractor, IsTheSameOnEveryPathAndEveryTime) {
  for (const auto& [width, height] : {std::pair(640, 480), std::pair(333, 251), std::pair(97, 61)}) {
    const GrayPixels image = RandomRectangles(width, height, width, 4);
    OrbExtractorOptions options = ThousandFeatures();
    options.simd_path = SimdPath::kPortable;
    const FeatureSet portable = Extract(image, options);
    ASSERT_GT(portable.size(), 20U);
    for (const SimdPath path : {SimdPath::kSse2, SimdPath::kAvx2, SimdPath::kBest}) {
      if (!HasSimdPath(path)) continue;
      options.simd_path = path;
      OrbExtractor extractor(options);
      for (int repeat = 0; repeat < 2; ++repeat) {
        FeatureSet features;
        extractor.Extract(image.View(), &features);
        EXPECT_EQ(features.keypoints, portable.keypoints);
        EXPECT_EQ(features.descriptors, portable.descriptors);
      }
    }
  }
}

TEST(OrbExtractor, DoesNotDependOnWhatItSawBefore) {
  const GrayPixels small = RandomRectangles(320, 240, 200, 5), other = RandomRectangles(500, 300, 300, 6),
                   large = RandomRectangles(640, 480, 600, 7);
  OrbExtractor extractor(ThousandFeatures());
  FeatureSet features;
  for (const GrayPixels* image : {&other, &small, &large, &small}) {
    extractor.Extract(image->View(), &features);
    const FeatureSet fresh = Extract(*image);
    EXPECT_EQ(features.keypoints, fresh.keypoints);
    EXPECT_EQ(features.descriptors, fresh.descriptors);
  }
}

TEST(OrbExtractor, ReadsNothingBesideTheView) {
  // The same pixels inside a larger picture with another surrounding.
  const GrayPixels image = RandomRectangles(200, 150, 120, 7);
  GrayPixels larger = RandomRectangles(260, 170, 200, 8);
  for (int y = 0; y < 150; ++y) {
    for (int x = 0; x < 200; ++x) larger.at(x + 30, y + 10) = image.at(x, y);
  }
  const GrayView inside{larger.pixels.data() + 10 * 260 + 30, 200, 150, 260};
  FeatureSet features;
  OrbExtractor(ThousandFeatures()).Extract(inside, &features);
  EXPECT_EQ(features.descriptors, Extract(image).descriptors);
}

TEST(OrbExtractor, AllocatesNothingOnceItKnowsTheSize) {
  for (const auto& [width, height] : {std::pair(640, 480), std::pair(320, 240)}) {
    const GrayPixels plain = RandomRectangles(width, height, 20, 9),
                     rich = RandomRectangles(width, height, 2000, 10);
    OrbExtractor extractor(ThousandFeatures());
    FeatureSet features;
    extractor.Extract(plain.View(), &features);
    const size_t before = testing::NumAllocations();
    extractor.Extract(rich.View(), &features);
    extractor.Extract(plain.View(), &features);
    EXPECT_EQ(testing::NumAllocations(), before) << width;
    FeatureSet another;
    another.keypoints.reserve(1);
    EXPECT_GT(testing::NumAllocations(), before) << "the counter must count";
  }
}

TEST(OrbExtractor, SmallAndBlankImagesGiveNothing) {
  FeatureSet features;
  OrbExtractor extractor(ThousandFeatures());
  for (const auto& [width, height] :
       {std::pair(0, 0), std::pair(1, 1), std::pair(32, 32), std::pair(500, 7)}) {
    const GrayPixels image(width, height, 7);
    extractor.Extract(image.View(), &features);
    EXPECT_EQ(features.size(), 0U) << width << "x" << height;
  }
  for (const auto& [width, height] : {std::pair(17, 17), std::pair(33, 33), std::pair(40, 2000),
                                      std::pair(640, 480), std::pair(641, 479)}) {
    extractor.Extract(GrayPixels(width, height, 200).View(), &features);
    EXPECT_EQ(features.size(), 0U) << width << "x" << height;
  }
}

TEST(OrbExtractor, WideImagesUseEverySixteenth) {
  const GrayPixels image = RandomRectangles(4095, 64, 400, 11);
  const FeatureSet features = Extract(image);
  ASSERT_GT(features.size(), 100U);
  double rightmost = 0.0;
  for (const Keypoint& k : features.keypoints) rightmost = std::max(rightmost, k.x_px());
  EXPECT_GT(rightmost, 3800.0);
  EXPECT_THROW(Extract(GrayPixels(4096, 64)), InvariantError);
}

TEST(OrbExtractor, ScaleFactorTwoAndOddSizes) {
  OrbExtractorOptions options = ThousandFeatures();
  options.pyramid = {6, 2.0};
  EXPECT_GT(Extract(RandomRectangles(641, 483, 500, 12), options).size(), 300U);
}

TEST(OrbExtractorOptions, NamesTheFieldThatIsWrong) {
  const auto message_of = [](auto change) -> std::string {
    OrbExtractorOptions options;
    change(options);
    try {
      options.Check();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message_of([](OrbExtractorOptions&) {}), "");
  EXPECT_NE(message_of([](OrbExtractorOptions& o) { o.num_features = 0; }).find("num_features"),
            std::string::npos);
  EXPECT_NE(message_of([](OrbExtractorOptions& o) { o.border_px = 15; }).find("border_px"),
            std::string::npos);
  EXPECT_NE(message_of([](OrbExtractorOptions& o) { o.pyramid.scale_factor = 2.5; }).find("scale_factor"),
            std::string::npos);
  EXPECT_NE(message_of([](OrbExtractorOptions& o) { o.min_fast_threshold = 21; }).find("min_fast_threshold"),
            std::string::npos);
  EXPECT_NE(message_of([](OrbExtractorOptions& o) { o.rank_decay = std::nan(""); }).find("rank_decay"),
            std::string::npos);
}

TEST(RefineMaximum, FindsThePeakOfAParabola) {
  for (const auto& [px, py] : {std::pair(0.0, 0.0), std::pair(0.3, -0.2), std::pair(-0.45, 0.4)}) {
    uint8_t scores[9];
    for (int i = 0; i < 9; ++i) {
      const double dx = i % 3 - 1 - px, dy = i / 3 - 1 - py;
      scores[i] = static_cast<uint8_t>(std::lround(220 - 25 * dx * dx - 18 * dy * dy - 8 * dx * dy));
    }
    const SubpixelOffset offset = RefineMaximum(scores);
    EXPECT_NEAR(offset.x, px, 0.02);
    EXPECT_NEAR(offset.y, py, 0.02);
  }
  const uint8_t flat[9] = {5, 5, 5, 5, 5, 5, 5, 5, 5};
  EXPECT_EQ(RefineMaximum(flat).x, 0.0);
  const uint8_t valley[9] = {9, 9, 9, 9, 1, 9, 9, 9, 9};
  EXPECT_EQ(RefineMaximum(valley).y, 0.0);
}

}  // namespace
}  // namespace dmslam
