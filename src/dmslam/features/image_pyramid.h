#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "dmslam/features/image_kernels.h"
#include "dmslam/features/types.h"

namespace dmslam {

/// A grey image in memory of its own whose rows may be read kRowPadding bytes before their begin and beyond
/// their end.
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

/// Brings images of one size to another, from half to twice as large: linear interpolation between the four
/// neighbours, positions and weights in 64ths. Pixel centres map to pixel centres: x_from = (x + 0.5) *
/// from_width / width - 0.5.
class ImageResizer {
 public:
  ImageResizer(int from_width, int from_height, int width, int height);

  /// `to` gets the size given above. Allocates only on the first call.
  void Resize(const PaddedImage& from, const ImageKernels& kernels, PaddedImage* to);

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

/// An image, enlarged where Pyramid::OfImages says so, and its shrunken versions, each made from the one
/// before.
class ImagePyramid {
 public:
  struct Level {
    PaddedImage image;
    double scale_x = 1.0, scale_y = 1.0;  ///< size of a pixel in pixels of the image
  };

  /// Sets sizes and memory for images of one size. Levels are left out whose smaller side is not above
  /// `min_size_px`.
  void SetUp(int width, int height, const Pyramid& pyramid, int min_size_px);

  /// Makes level 0 of `image`, whose size must be the one set up.
  void MakeFirst(const GrayView& image, const ImageKernels& kernels);
  /// Makes level `index` >= 1 from the one before.
  void ShrinkInto(size_t index, const ImageKernels& kernels);

  size_t size() const { return levels_.size(); }
  const Level& level(size_t index) const { return levels_[index]; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<Level> levels_;
  PaddedImage original_;                  ///< where it is to be enlarged
  std::optional<ImageResizer> enlarger_;  ///< makes level 0 of it
  std::vector<ImageResizer> shrinkers_;   ///< entry i makes level i + 1
};

/// Smooths images with the triangle filter of seven taps, (1 2 3 4 3 2 1) / 16 in both directions, sigma 1.58
/// px; beyond the edges the outermost pixels go on. Averages of pairs round up.
class ImageSmoother {
 public:
  /// Reuses memory.
  void Smooth(const PaddedImage& image, const ImageKernels& kernels, PaddedImage* smooth);

 private:
  std::vector<uint8_t> row_;
};

}  // namespace dmslam
