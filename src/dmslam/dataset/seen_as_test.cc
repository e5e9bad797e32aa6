#include "dmslam/dataset/seen_as.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

Camera MakeCamera(int width_px, int height_px, double focal_px) {
  Camera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = focal_px;
  camera.cx_px = 0.5 * (width_px - 1);
  camera.cy_px = 0.5 * (height_px - 1);
  return camera;
}

/// What a camera sees of a world that is a picture at infinity: smooth, nowhere the same.
GrayImage Take(const Camera& camera) {
  GrayImage image(camera.width_px, camera.height_px);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d ray = camera.Ray(camera.Undistort({x, y}).value());
      const double grey = 128 + 60 * std::sin(9 * ray.x() + 2 * ray.y()) + 50 * std::sin(11 * ray.y());
      image.at(x, y) = static_cast<uint8_t>(std::lround(grey));
    }
  }
  return image;
}

/// The largest difference, in grey values, more than `rim` pixels inside.
int Difference(const GrayImage& a, const GrayImage& b, int rim) {
  int difference = 0;
  for (int y = rim; y < a.height - rim; ++y) {
    for (int x = rim; x < a.width - rim; ++x)
      difference = std::max(difference, std::abs(int{a.at(x, y)} - int{b.at(x, y)}));
  }
  return difference;
}

/// One frame, given as raw pixels.
class OneFrame : public FrameSource {
 public:
  explicit OneFrame(GrayImage image) : image_(std::move(image)) {}
  size_t size() const override { return 1; }
  int64_t StampNs(size_t) const override { return 7; }
  std::string Name(size_t) const override { return "the frame"; }
  uint32_t FrameIndex(size_t) const override { return 3; }
  EncodedImage Read(size_t) override {
    return {ImageEncoding::kGray8, image_.width, image_.height, image_.data};
  }

 private:
  GrayImage image_;
};

GrayImage ReadAs(const Camera& from, const Camera& as) {
  const auto source = SeenAs(std::make_unique<OneFrame>(Take(from)), from, as, "frames");
  EXPECT_EQ(source->StampNs(0), 7);
  EXPECT_EQ(source->FrameIndex(0), 3u);
  return DecodeGray(source->Read(0), "frames");
}

std::string Refusal(const Camera& from, const Camera& as) {
  try {
    SeenAs(std::make_unique<OneFrame>(Take(from)), from, as, "the second sequence");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(SeenAs, ACameraOfHalfTheSize) {
  const Camera from = MakeCamera(160, 120, 130), as = MakeCamera(320, 240, 260);
  const GrayImage seen = ReadAs(from, as);
  ASSERT_EQ(seen.width, 320);
  EXPECT_LE(Difference(seen, Take(as), 2), 2);
}

TEST(SeenAs, ACameraOfTwiceTheSizeIsAveraged) {
  const Camera from = MakeCamera(320, 240, 260), as = MakeCamera(160, 120, 130);
  EXPECT_LE(Difference(ReadAs(from, as), Take(as), 1), 2);
  // Grain finer than the pixels is gone.
  GrayImage grain(320, 240);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) grain.at(x, y) = (x + y) % 2 == 0 ? 0 : 200;
  }
  const GrayImage smooth = Resampler(from, as).Resample(grain, "grain");
  EXPECT_LE(Difference(smooth, GrayImage(160, 120, 100), 1), 1);
}

TEST(SeenAs, LensesAreTakenOutAndPutIn) {
  Camera wide = MakeCamera(320, 240, 200), as = MakeCamera(320, 240, 260);
  wide.k1 = -0.1;
  wide.p1 = 0.002;
  as.k1 = 0.05;
  EXPECT_LE(Difference(ReadAs(wide, as), Take(as), 2), 3);
  Camera fisheye = MakeCamera(320, 240, 150);
  fisheye.lens = Lens::kFisheye;
  fisheye.k1 = 0.01;
  EXPECT_LE(Difference(ReadAs(fisheye, as), Take(as), 2), 6);
}

TEST(SeenAs, TheSameCameraIsLeftAsItIs) {
  Camera from = MakeCamera(160, 120, 130), as = from;
  as.fps = 15;
  EXPECT_EQ(Difference(ReadAs(from, as), Take(from), 0), 0);
}

TEST(SeenAs, ACameraThatDoesNotFitIsRefusedByName) {
  const Camera as = MakeCamera(320, 240, 260);
  EXPECT_EQ(Refusal(MakeCamera(320, 240, 250), as), "");
  EXPECT_NE(Refusal(MakeCamera(320, 240, 400), as).find("the second sequence: its camera sees 4"),
            std::string::npos)
      << Refusal(MakeCamera(320, 240, 400), as);
  EXPECT_NE(Refusal(MakeCamera(80, 60, 65), as).find("3 times as coarse"), std::string::npos);
}

TEST(SeenAs, ImagesOfAnotherSizeAreRefused) {
  const Camera from = MakeCamera(160, 120, 130), as = MakeCamera(320, 240, 260);
  const auto source = SeenAs(std::make_unique<OneFrame>(GrayImage(100, 80)), from, as, "frames");
  EXPECT_THROW(source->Read(0), InputError);
}

}  // namespace
}  // namespace dmslam
