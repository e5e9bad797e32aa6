#pragma once

#include <cstdint>

#include "dmslam/features/gray_image.h"

namespace dmslam::testing {

/// A picture with many corners: overlapping rectangles of random place, size and brightness, and a little
/// noise.
GrayImage RandomRectangles(int width, int height, int count, uint64_t seed);

/// The picture turned by `radians` (from x towards y) about its middle, resampled linearly; outside it is
/// grey 128.
GrayImage Turned(const GrayImage& image, double radians);

}  // namespace dmslam::testing
