#include "dmslam/features/testing/synthetic_images.h"

#include <algorithm>
#include <cmath>

#include "dmslam/util/random.h"

namespace dmslam::testing {

GrayPixels RandomRectangles(int width, int height, int count, uint64_t seed) {
  Random random(DeriveSeed(seed, 0, "rectangles"));
  GrayPixels image(width, height, 128);
  for (int i = 0; i < count; ++i) {
    const int x0 = static_cast<int>(random.Below(static_cast<uint32_t>(width)));
    const int y0 = static_cast<int>(random.Below(static_cast<uint32_t>(height)));
    const int x1 = std::min(width, x0 + 6 + static_cast<int>(random.Below(60)));
    const int y1 = std::min(height, y0 + 6 + static_cast<int>(random.Below(60)));
    const auto value = static_cast<uint8_t>(20 + random.Below(210));
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) image.at(x, y) = value;
    }
  }
  for (uint8_t& pixel : image.pixels) {
    pixel = static_cast<uint8_t>(
        std::clamp(static_cast<int>(pixel) + static_cast<int>(random.Below(5)) - 2, 0, 255));
  }
  return image;
}

GrayPixels Turned(const GrayPixels& image, double radians) {
  GrayPixels turned(image.width, image.height, 128);
  const double cosine = std::cos(radians), sine = std::sin(radians);
  const double middle_x = (image.width - 1) / 2.0, middle_y = (image.height - 1) / 2.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double from_x = cosine * (x - middle_x) + sine * (y - middle_y) + middle_x;
      const double from_y = -sine * (x - middle_x) + cosine * (y - middle_y) + middle_y;
      const int left = static_cast<int>(std::floor(from_x)), top = static_cast<int>(std::floor(from_y));
      if (left < 0 || top < 0 || left + 1 >= image.width || top + 1 >= image.height) continue;
      const double wx = from_x - left, wy = from_y - top;
      const double upper = image.at(left, top) * (1 - wx) + image.at(left + 1, top) * wx;
      const double lower = image.at(left, top + 1) * (1 - wx) + image.at(left + 1, top + 1) * wx;
      turned.at(x, y) = static_cast<uint8_t>(std::lround(upper * (1 - wy) + lower * wy));
    }
  }
  return turned;
}

}  // namespace dmslam::testing
