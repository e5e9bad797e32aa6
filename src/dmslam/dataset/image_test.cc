#include "dmslam/dataset/image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

GrayImage Pattern(int width, int height) {
  GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image.at(x, y) = static_cast<uint8_t>(128 + 100 * std::sin(x * 0.1) * std::cos(y * 0.07));
  }
  return image;
}

ColorImage Colored(int width, int height) {
  ColorImage image{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    image.data.push_back(static_cast<uint8_t>(i % width));
    image.data.push_back(static_cast<uint8_t>(i / width));
    image.data.push_back(static_cast<uint8_t>(200 - i % 100));
  }
  return image;
}

double MeanAbsoluteDifference(const GrayImage& a, const GrayImage& b) {
  double sum = 0;
  for (size_t i = 0; i < a.data.size(); ++i) sum += std::abs(a.data[i] - b.data[i]);
  return sum / static_cast<double>(a.data.size());
}

std::string ErrorOf(ImageEncoding encoding, int width, int height, std::vector<uint8_t> bytes) {
  try {
    DecodeGray(EncodedImage{encoding, width, height, std::move(bytes)}, "frame 7");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Image, PngIsLossless) {
  const GrayImage image = Pattern(97, 53);
  const std::vector<uint8_t> bytes = EncodePng(image);
  EXPECT_EQ(DetectEncoding(bytes), ImageEncoding::kPng);
  EXPECT_EQ(DecodeGray(bytes, "x").data, image.data);
  const ColorImage color = Colored(40, 30);
  EXPECT_EQ(DecodeColor({ImageEncoding::kPng, 0, 0, EncodePng(color)}, "x").data, color.data);
}

TEST(Image, JpegGreyIsCloseAndGoesStraightToLuma) {
  const GrayImage image = Pattern(160, 120);
  const std::vector<uint8_t> bytes = EncodeJpeg(image, 95);
  EXPECT_EQ(DetectEncoding(bytes), ImageEncoding::kJpeg);
  EXPECT_LT(MeanAbsoluteDifference(DecodeGray(bytes, "x"), image), 1.5);
  const ColorImage color = Colored(160, 120);
  const GrayImage luma = DecodeGray(EncodeJpeg(color, 95), "x");
  const GrayImage expected = DecodeGray({ImageEncoding::kRgb8, 160, 120, color.data}, "x");
  EXPECT_LT(MeanAbsoluteDifference(luma, expected), 2.0);
}

TEST(Image, RawColourOrderMatters) {
  const std::vector<uint8_t> red = {255, 0, 0};
  EXPECT_EQ(DecodeGray({ImageEncoding::kRgb8, 1, 1, red}, "x").data[0], 76);
  EXPECT_EQ(DecodeGray({ImageEncoding::kBgr8, 1, 1, red}, "x").data[0], 29);
  EXPECT_EQ(DecodeGray({ImageEncoding::kGray8, 1, 1, {9}}, "x").data[0], 9);
  EXPECT_EQ(DecodeColor({ImageEncoding::kBgr8, 1, 1, red}, "x").data, (std::vector<uint8_t>{0, 0, 255}));
  EXPECT_EQ(DecodeColor({ImageEncoding::kGray8, 1, 1, {9}}, "x").data, (std::vector<uint8_t>{9, 9, 9}));
}

TEST(Image, DecoderKeepsItsBuffer) {
  GrayDecoder decoder;
  GrayImage image;
  const std::vector<uint8_t> bytes = EncodeJpeg(Pattern(64, 64), 90);
  decoder.Decode(ImageEncoding::kJpeg, 0, 0, bytes, "x", image);
  const uint8_t* before = image.data.data();
  decoder.Decode(ImageEncoding::kJpeg, 0, 0, bytes, "x", image);
  EXPECT_EQ(image.data.data(), before);
}

TEST(Image, BadInputIsNamed) {
  std::vector<uint8_t> jpeg = EncodeJpeg(Pattern(160, 120), 90);
  jpeg.resize(jpeg.size() / 2);
  EXPECT_NE(ErrorOf(ImageEncoding::kJpeg, 0, 0, jpeg).find("frame 7: JPEG image is damaged"),
            std::string::npos);
  std::vector<uint8_t> png = EncodePng(Pattern(160, 120));
  std::vector<uint8_t> cut(png.begin(), png.begin() + static_cast<std::ptrdiff_t>(png.size() / 2));
  EXPECT_NE(ErrorOf(ImageEncoding::kPng, 0, 0, cut).find("frame 7: PNG image is truncated"),
            std::string::npos);
  std::vector<uint8_t> bomb = png;
  bomb[16] = 0x7f;
  EXPECT_NE(ErrorOf(ImageEncoding::kPng, 0, 0, bomb).find("is outside 1..4096"), std::string::npos);
  EXPECT_NE(ErrorOf(ImageEncoding::kPng, 0, 0, {1, 2, 3}).find("is not a PNG"), std::string::npos);
  EXPECT_NE(ErrorOf(ImageEncoding::kJpeg, 0, 0, {1, 2, 3}).find("is not a JPEG"), std::string::npos);
  EXPECT_NE(ErrorOf(ImageEncoding::kFile, 0, 0, {}).find("is no readable image"), std::string::npos);
  EXPECT_NE(ErrorOf(ImageEncoding::kFile, 0, 0, {1, 2, 3}).find("is no readable image"), std::string::npos);
  EXPECT_NE(ErrorOf(ImageEncoding::kGray8, 4, 4, {1, 2, 3}).find("has 3 bytes where 4x4"), std::string::npos);
  EXPECT_NE(ErrorOf(ImageEncoding::kRgb8, 5000, 1, {}).find("is outside"), std::string::npos);
  EXPECT_THROW(LoadGray("/nonexistent.png"), InputError);
  EXPECT_THROW(LoadGray(testing::TempDir()), InputError);
}

// Damaged files end in an image or in an InputError, never in a crash.
TEST(Image, DamagedBytesNeverCrash) {
  Random random(3);
  for (const auto& good : {EncodeJpeg(Pattern(48, 40), 80), EncodePng(Pattern(48, 40))}) {
    for (int trial = 0; trial < 60; ++trial) {
      std::vector<uint8_t> bytes = good;
      for (int i = 0; i < 3; ++i)
        bytes[random.Below(static_cast<uint32_t>(bytes.size()))] ^=
            static_cast<uint8_t>(1 + random.Below(255));
      if (trial % 3 == 0) bytes.resize(random.Below(static_cast<uint32_t>(bytes.size())));
      try {
        const GrayImage image = DecodeGray(bytes, "x");
        EXPECT_EQ(image.data.size(), static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
      } catch (const InputError&) {
      }
    }
  }
}

}  // namespace
}  // namespace dmslam
