#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/features/image_kernels.h"
#include "dmslam/features/types.h"

namespace dmslam {

/// A grey image in memory of its own whose rows may be read kRowPadding bytes before their begin and beyond their end.
class PaddedImage {
 public:
  /// Sets the size; pixels are undefined. Reuses memory where it suffices.
  void Resize(int width, int height);

  uint8_t* row(int y) { return pixels_.data() + kRowPadding + y * stride_; }
  const uint8_t* row(int y) const { return pixels_.data() + kRowPadding + y * stride_; }
  int width() const { return width_; }
  int height() const { return height_; }
  ptrdiff_t stride() const { return stride_; }
  GrayView View() const { return {row(0), width_, height_, stride_}; }

 private:
  std::vector<uint8_t> pixels_;
  int width_ = 0;
  int height_ = 0;
  ptrdiff_t stride_ = 0;
};

/// Shrinks images of one size to another, not smaller than half: linear interpolation between the four neighbours,
/// positions and weights in 64ths. Pixel centres map to pixel centres: x_from = (x + 0.5) * from_width / width - 0.5.
class ImageShrinker {
 public:
  ImageShrinker(int from_width, int from_height, int width, int height);

  /// `to` gets the size given above. Allocates only on the first call.
  void Shrink(const PaddedImage& from, const ImageKernels& kernels, PaddedImage* to);

 private:
  /// Source of a row or column: the one before, and the weight of the one behind in 64ths.
  struct Source {
    int before = 0;
    int weight = 0;
  };
  static Source SourceOf(int index, int from_size, int size);

  int from_width_, from_height_, width_, height_;
  std::vector<ResizeBlock> blocks_;
  std::vector<uint8_t> blended_;
};

}  // namespace dmslam
