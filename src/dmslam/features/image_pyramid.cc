#include "dmslam/features/image_pyramid.h"

#include <algorithm>

#include "dmslam/util/check.h"

namespace dmslam {

void PaddedImage::Resize(int width, int height) {
  constexpr int kAlignment = 64;
  width_ = width;
  height_ = height;
  stride_ = (width + kRowPadding + kAlignment - 1) / kAlignment * kAlignment;
  pixels_.resize(static_cast<size_t>(stride_) * static_cast<size_t>(height) + 2 * kRowPadding);
}

ImageShrinker::ImageShrinker(int from_width, int from_height, int width, int height)
    : from_width_(from_width), from_height_(from_height), width_(width), height_(height) {
  DMSLAM_CHECK(width > 0 && height > 0, "the shrunken image must have pixels");
  DMSLAM_CHECK(width <= from_width && from_width <= 2 * width, "shrinks to between half and the whole width");
  DMSLAM_CHECK(height <= from_height && from_height <= 2 * height, "shrinks to between half and the whole height");
  blended_.resize(static_cast<size_t>(from_width + kRowPadding));
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

void ImageShrinker::Shrink(const PaddedImage& from, const ImageKernels& kernels, PaddedImage* to) {
  DMSLAM_CHECK(from.width() == from_width_ && from.height() == from_height_, "image has another size than agreed");
  to->Resize(width_, height_);
  for (int y = 0; y < height_; ++y) {
    const Source source = SourceOf(y, from_height_, height_);
    const uint8_t* upper = from.row(source.before);
    const uint8_t* lower = source.weight == 0 ? upper : from.row(source.before + 1);
    kernels.resize_row(upper, lower, source.weight, from_width_, blocks_.data(), static_cast<int>(blocks_.size()),
                       blended_.data(), to->row(y));
  }
}

ImageShrinker::Source ImageShrinker::SourceOf(int index, int from_size, int size) {
  // (index + 0.5) * from_size / size - 0.5 in 64ths, rounded, in integers.
  const int64_t numerator = (2 * static_cast<int64_t>(index) + 1) * from_size * 64 - 64LL * size;
  const int64_t position = (numerator + size) / (2 * static_cast<int64_t>(size));
  const int64_t clamped = std::clamp<int64_t>(position, 0, static_cast<int64_t>(from_size - 1) * 64);
  return {static_cast<int>(clamped / 64), static_cast<int>(clamped % 64)};
}

}  // namespace dmslam
