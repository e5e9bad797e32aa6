#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dmslam/features/types.h"

namespace dmslam {

/// An 8-bit grey image that owns its pixels. Row-major without padding: pixel (x, y) is pixels[y * width +
/// x].
struct GrayPixels {
  std::vector<uint8_t> pixels;
  int width = 0;
  int height = 0;

  GrayPixels() = default;
  GrayPixels(int width_px, int height_px, uint8_t value = 0)
      : pixels(static_cast<size_t>(width_px) * static_cast<size_t>(height_px), value),
        width(width_px),
        height(height_px) {}

  uint8_t& at(int x, int y) {
    return pixels[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  uint8_t at(int x, int y) const {
    return pixels[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  /// Valid as long as the image is neither changed in size nor destroyed.
  GrayView View() const { return {pixels.data(), width, height, width}; }
};

}  // namespace dmslam
