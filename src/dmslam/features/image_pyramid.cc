#include "dmslam/features/image_pyramid.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dmslam/camera/image_scale.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Rounded up, so that no level is less than half of the one before.
int LevelSize(int size, double scale) { return static_cast<int>(std::ceil(size / scale - 1e-9)); }

/// So many that the coarsest level's shorter side is about what it is in an image of 640 x 480.
int CoarserLevels(int width_px, int height_px, const Pyramid& pyramid) {
  constexpr double kShorterSide = 480.0;
  constexpr int kMostLevels = 16;
  const double larger = std::min(width_px, height_px) / kShorterSide;
  if (larger <= 1.0) return 0;
  const int more = static_cast<int>(std::lround(std::log(larger) / std::log(pyramid.scale_factor)));
  return std::clamp(more, 0, std::max(0, kMostLevels - pyramid.levels));
}

}  // namespace

Pyramid Pyramid::OfImages(int width_px, int height_px) const {
  Pyramid pyramid = *this;
  pyramid.finest_px = FinestPx(width_px, height_px);
  pyramid.coarser_levels = CoarserLevels(width_px, height_px, *this);
  return pyramid;
}

void PaddedImage::Resize(int width, int height) {
  constexpr int kAlignment = 64;
  width_ = width;
  height_ = height;
  stride_ = (width + kRowPadding + kAlignment - 1) / kAlignment * kAlignment;
  pixels_.resize(static_cast<size_t>(stride_) * static_cast<size_t>(height) + 2 * kRowPadding);
}

ImageResizer::ImageResizer(int from_width, int from_height, int width, int height)
    : from_width_(from_width), from_height_(from_height), width_(width), height_(height) {
  DMSLAM_CHECK(width > 0 && height > 0, "the image made must have pixels");
  DMSLAM_CHECK(width <= 2 * from_width && from_width <= 2 * width,
               "resizes to between half and twice the width");
  DMSLAM_CHECK(height <= 2 * from_height && from_height <= 2 * height,
               "resizes to between half and twice the height");
  blended_.resize(static_cast<size_t>(from_width) + kRowPadding);
  blocks_.resize(static_cast<size_t>(width + 7) / 8);
  for (size_t b = 0; b < blocks_.size(); ++b) {
    ResizeBlock& block = blocks_[b];
    const int first = static_cast<int>(b) * 8;
    block.source_begin = SourceOf(first, from_width, width).before;
    for (int i = 0; i < 8; ++i) {
      const Source source = SourceOf(std::min(first + i, width - 1), from_width, width);
      const int before = source.before - block.source_begin;
      block.pick[2 * i] = static_cast<uint8_t>(before);
      block.pick[2 * i + 1] = static_cast<uint8_t>(source.weight == 0 ? before : before + 1);
      block.weight[2 * i] = static_cast<int8_t>(64 - source.weight);
      block.weight[2 * i + 1] = static_cast<int8_t>(source.weight);
    }
  }
}

void ImageResizer::Resize(const PaddedImage& from, const ImageKernels& kernels, PaddedImage* to) {
  DMSLAM_CHECK(from.width() == from_width_ && from.height() == from_height_,
               "image has another size than agreed");
  to->Resize(width_, height_);
  for (int y = 0; y < height_; ++y) {
    const Source source = SourceOf(y, from_height_, height_);
    const uint8_t* upper = from.row(source.before);
    const uint8_t* lower = source.weight == 0 ? upper : from.row(source.before + 1);
    kernels.resize_row(upper, lower, source.weight, from_width_, blocks_.data(),
                       static_cast<int>(blocks_.size()), blended_.data(), to->row(y));
  }
}

ImageResizer::Source ImageResizer::SourceOf(int index, int from_size, int size) {
  // (index + 0.5) * from_size / size - 0.5 in 64ths, rounded, in integers.
  const int64_t numerator = (2 * static_cast<int64_t>(index) + 1) * from_size * 64 - 64LL * size;
  const int64_t position = (numerator + size) / (2 * static_cast<int64_t>(size));
  const int64_t clamped = std::clamp<int64_t>(position, 0, static_cast<int64_t>(from_size - 1) * 64);
  return {static_cast<int>(clamped / 64), static_cast<int>(clamped % 64)};
}

void ImagePyramid::SetUp(int width, int height, const Pyramid& pyramid, int min_size_px) {
  width_ = width;
  height_ = height;
  levels_.clear();
  shrinkers_.clear();
  enlarger_.reset();
  const Pyramid of_images = pyramid.OfImages(width, height);
  for (int i = 0; i < of_images.NumLevels(); ++i) {
    const int level_width = LevelSize(width, of_images.Sigma(i));
    const int level_height = LevelSize(height, of_images.Sigma(i));
    if (std::min(level_width, level_height) <= min_size_px) break;
    if (i > 0) {
      const PaddedImage& before = levels_.back().image;
      shrinkers_.emplace_back(before.width(), before.height(), level_width, level_height);
    }
    Level& level = levels_.emplace_back();
    level.image.Resize(level_width, level_height);
    level.scale_x = static_cast<double>(width) / level_width;
    level.scale_y = static_cast<double>(height) / level_height;
  }
  if (levels_.empty() || of_images.finest_px == 1.0) return;
  original_.Resize(width, height);
  enlarger_.emplace(width, height, levels_[0].image.width(), levels_[0].image.height());
}

void ImagePyramid::MakeFirst(const GrayView& image, const ImageKernels& kernels) {
  DMSLAM_CHECK(image.width == width_ && image.height == height_, "image has another size than agreed");
  if (levels_.empty()) return;
  PaddedImage& copy = enlarger_ ? original_ : levels_[0].image;
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(copy.row(y), image.row(y), static_cast<size_t>(image.width));
  }
  if (enlarger_) enlarger_->Resize(original_, kernels, &levels_[0].image);
}

void ImagePyramid::ShrinkInto(size_t index, const ImageKernels& kernels) {
  shrinkers_[index - 1].Resize(levels_[index - 1].image, kernels, &levels_[index].image);
}

void ImageSmoother::Smooth(const PaddedImage& image, const ImageKernels& kernels, PaddedImage* smooth) {
  const int width = image.width(), height = image.height();
  smooth->Resize(width, height);
  row_.resize(static_cast<size_t>(width) + 2 * kRowPadding);
  uint8_t* padded = row_.data() + kRowPadding;
  for (int y = 0; y < height; ++y) {
    const uint8_t* rows[7];
    for (int i = 0; i < 7; ++i) rows[i] = image.row(std::clamp(y + i - 3, 0, height - 1));
    kernels.blur_down(rows, width, padded);
    std::memset(padded - 3, padded[0], 3);
    std::memset(padded + width, padded[width - 1], 3);
    kernels.blur_along(padded, width, smooth->row(y));
  }
}

}  // namespace dmslam
