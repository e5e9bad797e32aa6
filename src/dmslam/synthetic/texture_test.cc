#include "dmslam/synthetic/texture.h"

#include <gtest/gtest.h>

#include "dmslam/synthetic/paint.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

int Red(uint32_t color) { return static_cast<int>(color & 0xff); }
int Blue(uint32_t color) { return static_cast<int>((color >> 16) & 0xff); }

TEST(Texture, InterpolatesAndRepeats) {
  Canvas canvas(4, 2);
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 2; ++y)
      canvas.at(x, y) = Rgb(50.0f * static_cast<float>(x), 0, 200.0f * static_cast<float>(y));
  }
  const Texture texture(canvas);
  EXPECT_EQ(Red(texture.Sample(0.5f, 0.5f, 0)), 0);
  EXPECT_EQ(Red(texture.Sample(2.5f, 0.5f, 0)), 100);
  EXPECT_NEAR(Red(texture.Sample(2.0f, 0.5f, 0)), 75, 1);
  EXPECT_NEAR(Blue(texture.Sample(1.5f, 1.0f, 0)), 100, 1);
  EXPECT_EQ(texture.Sample(2.5f + 8, 0.5f - 4, 0), texture.Sample(2.5f, 0.5f, 0));
  EXPECT_NEAR(Red(texture.Sample(0.0f, 0.5f, 0)), 75, 1);  // Between the last and the first column.
}

TEST(Texture, LevelsAreMeans) {
  Random random(1);
  const Canvas canvas = PaintPackage(64, 32, random);
  Rgb mean = Rgb::Zero();
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) mean += canvas.at(x, y) / 2048.0f;
  }
  const Texture texture(canvas);
  ASSERT_EQ(texture.levels(), 7);
  EXPECT_NEAR(Red(texture.Sample(0, 0, 6)), mean.x(), 1.5);
  EXPECT_NEAR(Blue(texture.Sample(13, 7, 6)), mean.z(), 1.5);
}

TEST(Texture, SidesMustBePowersOfTwo) { EXPECT_THROW(Texture(Canvas(12, 8)), InvariantError); }

TEST(Texture, NoiseHasUnitVarianceAndTiles) {
  Random random(5);
  const std::vector<float> noise = FractalNoise(128, 128, 4, 5, 0.7f, random);
  double sum = 0, squares = 0, seam = 0, step = 0;
  for (const float value : noise) {
    sum += value;
    squares += static_cast<double>(value) * value;
  }
  const double count = static_cast<double>(noise.size());
  EXPECT_NEAR(sum / count, 0, 0.35);
  EXPECT_NEAR(std::sqrt(squares / count - sum * sum / count / count), 1.0, 0.4);
  for (size_t y = 0; y < 128; ++y) {
    seam += std::abs(noise[y * 128] - noise[y * 128 + 127]);
    step += std::abs(noise[y * 128 + 64] - noise[y * 128 + 63]);
  }
  EXPECT_LT(seam, 2.5 * step);
}

TEST(Texture, PicturesOfOneKindDiffer) {
  Random random(9);
  const Canvas first = PaintPoster(64, 64, random), second = PaintPoster(64, 64, random);
  double difference = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) difference += (first.at(x, y) - second.at(x, y)).cwiseAbs().mean() / 4096;
  }
  EXPECT_GT(difference, 10);
}

}  // namespace
}  // namespace dmslam
