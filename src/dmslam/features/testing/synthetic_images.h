#pragma once

#include <cstdint>

#include "dmslam/features/gray_pixels.h"

namespace dmslam::testing {

/// A picture with many corners: overlapping rectangles of random place, size and brightness, and a little
/// noise.
GrayPixels RandomRectangles(int width, int height, int count, uint64_t seed);

/// The picture turned by `radians` (from x towards y) about its middle, resampled linearly; outside it is
/// grey 128.
GrayPixels Turned(const GrayPixels& image, double radians);

}  // namespace dmslam::testing
