#include "dmslam/features/image_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "dmslam/features/brief_pattern.h"
#include "dmslam/features/image_pyramid.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

PaddedImage Noise(int width, int height, uint64_t seed) {
  Random random(seed);
  PaddedImage image;
  image.Resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // Flat stretches between wild ones, so that both corners and none occur.
      image.row(y)[x] =
          static_cast<uint8_t>((x / 9 + y / 7) % 2 == 0 ? random.Below(256) : 90 + random.Below(12));
    }
  }
  return image;
}

/// The definition, arc by arc.
int SlowFastScore(const PaddedImage& image, int x, int y) {
  constexpr int kCircle[16][2] = {{0, -3}, {1, -3}, {2, -2}, {3, -1}, {3, 0},  {3, 1},   {2, 2},   {1, 3},
                                  {0, 3},  {-1, 3}, {-2, 2}, {-3, 1}, {-3, 0}, {-3, -1}, {-2, -2}, {-1, -3}};
  int best = 0;
  for (int start = 0; start < 16; ++start) {
    int brighter = 255, darker = 255;
    for (int i = 0; i < 9; ++i) {
      const auto& offset = kCircle[(start + i) % 16];
      const int difference = image.row(y + offset[1])[x + offset[0]] - image.row(y)[x];
      brighter = std::min(brighter, difference);
      darker = std::min(darker, -difference);
    }
    best = std::max({best, brighter, darker});
  }
  return best;
}

class KernelPath : public testing::TestWithParam<SimdPath> {
 protected:
  void SetUp() override {
    if (!HasSimdPath(GetParam())) GTEST_SKIP() << "this CPU lacks the instructions";
  }
  const ImageKernels& kernels() const { return KernelsOn(GetParam()); }
};

TEST_P(KernelPath, FastScoresFollowTheDefinition) {
  const PaddedImage image = Noise(97, 40, 1);
  for (const int threshold : {1, 7, 40}) {
    std::vector<uint8_t> scores(97 + kRowPadding, 0xee);
    for (int y = 3; y < 37; ++y) {
      const bool any = kernels().fast_scores(image.row(y), image.stride(), 4, 91, threshold, scores.data());
      int sum = 0;
      for (int x = 0; x < 91 + kRowPadding / 2; ++x) {
        const int truth = x >= 4 && x < 91 ? SlowFastScore(image, x, y) : 0;
        ASSERT_EQ(scores[static_cast<size_t>(x)], truth > threshold ? truth : 0) << x << " " << y;
        sum += scores[static_cast<size_t>(x)];
      }
      EXPECT_EQ(any, sum > 0);
    }
  }
}

TEST_P(KernelPath, ScoresAroundFollowTheDefinition) {
  const PaddedImage image = Noise(60, 60, 2);
  for (int i = 0; i < 20; ++i) {
    uint8_t scores[9];
    kernels().scores_around(image.row(20 + i) + 17 + i, image.stride(), scores);
    for (int j = 0; j < 9; ++j) EXPECT_EQ(scores[j], SlowFastScore(image, 16 + i + j % 3, 19 + i + j / 3));
  }
}

TEST_P(KernelPath, OfEqualNeighboursTheFirstIsTheMaximum) {
  std::vector<uint8_t> above(128, 0), here(128, 0), below(128, 0);
  here[20] = here[21] = 9;      // a pair: 20 stays
  here[40] = 7, below[39] = 7;  // 39 comes later: 40 stays
  here[60] = 7, above[61] = 7;  // 61 came before: 60 goes
  here[70] = 7, below[71] = 8;
  here[90] = 1;
  std::array<Corner, 64> corners;
  const int count =
      kernels().local_maxima({above.data(), here.data(), below.data()}, 16, 96, 5, corners.data());
  ASSERT_EQ(count, 3);
  EXPECT_EQ(corners[0].x, 20);
  EXPECT_EQ(corners[0].y, 5);
  EXPECT_EQ(corners[0].score, 9);
  EXPECT_EQ(corners[1].x, 40);
  EXPECT_EQ(corners[2].x, 90);
}

TEST_P(KernelPath, MomentsFollowTheDefinition) {
  const PaddedImage image = Noise(50, 45, 3);
  int mx = 0, my = 0;
  kernels().disc_moments(image.row(20) + 25, image.stride(), &mx, &my);
  constexpr int kHalfWidth[16] = {15, 15, 15, 15, 14, 14, 14, 13, 13, 12, 11, 10, 9, 8, 6, 3};
  int true_mx = 0, true_my = 0;
  for (int y = -15; y <= 15; ++y) {
    for (int x = -kHalfWidth[std::abs(y)]; x <= kHalfWidth[std::abs(y)]; ++x) {
      true_mx += x * image.row(20 + y)[25 + x];
      true_my += y * image.row(20 + y)[25 + x];
    }
  }
  EXPECT_EQ(mx, true_mx);
  EXPECT_EQ(my, true_my);
}

TEST_P(KernelPath, ComparisonsFollowThePattern) {
  const PaddedImage image = Noise(50, 50, 4);
  const SteeredPattern pattern(BriefPattern());
  std::array<uint64_t, 4> words{};
  kernels().compare_pairs(image.row(25) + 24, image.stride(), pattern.Places(0), words.data());
  for (size_t i = 0; i < 256; ++i) {
    const BriefTest& t = BriefPattern()[i];
    const bool darker = image.row(25 + t.y0)[24 + t.x0] < image.row(25 + t.y1)[24 + t.x1];
    EXPECT_EQ((words[i / 64] >> (i % 64)) & 1, darker ? 1U : 0U) << "test " << i;
  }
}

TEST_P(KernelPath, ShrinkingAndSmoothingAreThePortableOnesBitForBit) {
  for (const int width : {33, 64, 97, 641}) {
    const PaddedImage image = Noise(width, 40, static_cast<uint64_t>(width));
    const ImageKernels* sets[2] = {&KernelsOn(SimdPath::kPortable), &kernels()};
    PaddedImage shrunken[2], smooth[2];
    ImageResizer shrinker(width, 40, (width * 10 + 11) / 12, 34);
    ImageSmoother smoother;
    for (int i = 0; i < 2; ++i) {
      shrinker.Resize(image, *sets[i], &shrunken[i]);
      smoother.Smooth(image, *sets[i], &smooth[i]);
    }
    for (int y = 0; y < 34; ++y) {
      ASSERT_TRUE(
          std::equal(shrunken[0].row(y), shrunken[0].row(y) + shrunken[0].width(), shrunken[1].row(y)));
    }
    for (int y = 0; y < 40; ++y)
      ASSERT_TRUE(std::equal(smooth[0].row(y), smooth[0].row(y) + width, smooth[1].row(y)));
  }
}

TEST_P(KernelPath, EnlargingIsThePortableOneBitForBit) {
  for (const int width : {33, 97, 321}) {
    const PaddedImage image = Noise(width, 40, static_cast<uint64_t>(width));
    for (const double by : {1.33, 1.96, 2.0}) {
      const int to_width = static_cast<int>(std::ceil(by * width));
      ImageResizer resizer(width, 40, to_width, static_cast<int>(by * 40));
      PaddedImage plain, fast;
      resizer.Resize(image, KernelsOn(SimdPath::kPortable), &plain);
      resizer.Resize(image, kernels(), &fast);
      for (int y = 0; y < plain.height(); ++y)
        ASSERT_TRUE(std::equal(plain.row(y), plain.row(y) + to_width, fast.row(y))) << width << " by " << by;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Paths, KernelPath,
                         testing::Values(SimdPath::kPortable, SimdPath::kSse2, SimdPath::kAvx2));

TEST(ImageResizer, MapsPixelCentresToPixelCentres) {
  PaddedImage ramp, shrunken, enlarged;
  ramp.Resize(240, 60);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 240; ++x) ramp.row(y)[x] = static_cast<uint8_t>(x);
  }
  ImageResizer(240, 60, 200, 50).Resize(ramp, KernelsOn(SimdPath::kBest), &shrunken);
  for (int x = 0; x < 200; ++x) {
    const double expected = std::clamp((x + 0.5) * 1.2 - 0.5, 0.0, 239.0);
    EXPECT_NEAR(shrunken.row(25)[x], expected, 0.52) << x;
  }
  ImageResizer(240, 60, 480, 120).Resize(ramp, KernelsOn(SimdPath::kBest), &enlarged);
  for (int x = 0; x < 480; ++x) {
    const double expected = std::clamp((x + 0.5) / 2 - 0.5, 0.0, 239.0);
    EXPECT_NEAR(enlarged.row(60)[x], expected, 0.52) << x;
  }
}

TEST(ImageSmoother, AnImpulseBecomesTheTriangle) {
  PaddedImage impulse, smooth;
  impulse.Resize(40, 40);
  for (int y = 0; y < 40; ++y) std::fill(impulse.row(y), impulse.row(y) + 40, uint8_t{0});
  impulse.row(20)[20] = 255;
  ImageSmoother().Smooth(impulse, KernelsOn(SimdPath::kBest), &smooth);
  constexpr int kTriangle[7] = {1, 2, 3, 4, 3, 2, 1};
  for (int y = -3; y <= 3; ++y) {
    for (int x = -3; x <= 3; ++x) {
      // Each of eight averages rounds up by at most one half.
      EXPECT_NEAR(smooth.row(20 + y)[20 + x], 255.0 * kTriangle[y + 3] * kTriangle[x + 3] / 256.0 + 1.5, 2.0);
    }
  }
  EXPECT_EQ(smooth.row(20)[24], 0);
  EXPECT_EQ(smooth.row(16)[20], 0);
}

}  // namespace
}  // namespace dmslam
