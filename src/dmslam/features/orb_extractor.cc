#include "dmslam/features/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

void Require(bool condition, const char* field, const char* range) {
  if (!condition) throw InputError(std::string("extractor option ") + field + " must be " + range);
}

/// Direction of the intensity centroid in 256 steps per turn, from x towards y.
uint8_t Orientation(int moment_x, int moment_y) {
  const double radians = std::atan2(static_cast<double>(moment_y), static_cast<double>(moment_x));
  return static_cast<uint8_t>(std::lround(radians * (128.0 / std::numbers::pi)) & 255);
}

/// A level's coordinate in sixteenths of a pixel of level 0; pixel centres map to pixel centres.
uint16_t FullResolutionQ4(double coordinate, double scale) {
  return static_cast<uint16_t>(std::lround(((coordinate + 0.5) * scale - 0.5) * 16.0));
}

/// Rounded up, so that no level is less than half of the one before.
int LevelSize(int size, double scale) { return static_cast<int>(std::ceil(size / scale - 1e-9)); }

}  // namespace

void OrbExtractorOptions::Check() const {
  Require(num_features >= 1 && num_features <= 100000, "num_features", "in 1..100000");
  Require(pyramid.levels >= 1 && pyramid.levels <= 16, "pyramid.levels", "in 1..16");
  Require(pyramid.scale_factor >= 1.05 && pyramid.scale_factor <= 2.0, "pyramid.scale_factor", "in 1.05..2");
  Require(fast_threshold >= 1 && fast_threshold <= 254, "fast_threshold", "in 1..254");
  Require(min_fast_threshold >= 1 && min_fast_threshold <= fast_threshold, "min_fast_threshold",
          "in 1..fast_threshold");
  Require(cell_size_px >= 8 && cell_size_px <= 4096, "cell_size_px", "in 8..4096");
  Require(rank_decay >= 0.0 && rank_decay <= 1.0, "rank_decay", "in 0..1");
  Require(border_px >= 16 && border_px <= 2048, "border_px", "in 16..2048");
}

OrbExtractor::OrbExtractor(const OrbExtractorOptions& options)
    : options_((options.Check(), options)), kernels_(KernelsOn(options.simd_path)), pattern_(BriefPattern()) {}

void OrbExtractor::Extract(const GrayView& image, FeatureSet* features) {
  DMSLAM_CHECK(image.width <= 4095 && image.height <= 4095, "keypoints cannot name pixels beyond 4095");
  features->keypoints.clear();
  features->descriptors.clear();
  features->keypoints.reserve(static_cast<size_t>(options_.num_features));
  features->descriptors.reserve(static_cast<size_t>(options_.num_features));
  SetUpLevels(image.width, image.height);
  const CornerSelector::Options selection = {options_.cell_size_px, options_.fast_threshold, options_.rank_decay};
  int missing = 0;  // what finer levels could not give is asked of the coarser ones
  for (size_t i = 0; i < levels_.size(); ++i) {
    Level& level = levels_[i];
    FillLevel(i, image);
    detector_.Detect(level.image, options_.min_fast_threshold, options_.border_px, kernels_, &corners_);
    const int wanted = level.quota + missing;
    selector_.Select(corners_, wanted, level.image.width(), level.image.height(), selection, &chosen_);
    missing = wanted - static_cast<int>(chosen_.size());
    if (!chosen_.empty()) Describe(static_cast<int>(i), level, features);
  }
}

void OrbExtractor::SetUpLevels(int width, int height) {
  if (!levels_.empty() && levels_[0].image.width() == width && levels_[0].image.height() == height) return;
  levels_.clear();
  const Pyramid& pyramid = options_.pyramid;
  const double shrink = 1.0 / pyramid.scale_factor;
  double share = (1.0 - shrink) / (1.0 - std::pow(shrink, pyramid.levels)) * options_.num_features;
  int given = 0;
  for (int i = 0; i < pyramid.levels; ++i) {
    const int level_width = LevelSize(width, pyramid.Scale(i));
    const int level_height = LevelSize(height, pyramid.Scale(i));
    if (std::min(level_width, level_height) <= 2 * options_.border_px) break;
    Level level;
    level.scale_x = static_cast<double>(width) / level_width;
    level.scale_y = static_cast<double>(height) / level_height;
    const bool last = i + 1 == pyramid.levels;
    level.quota = last ? options_.num_features - given : static_cast<int>(std::lround(share));
    given += level.quota;
    share *= shrink;
    if (i > 0) {
      const PaddedImage& before = levels_.back().image;
      level.shrinker.emplace_back(before.width(), before.height(), level_width, level_height);
    }
    level.image.Resize(level_width, level_height);
    levels_.push_back(std::move(level));
  }
  ReserveFor(width, height);
}

void OrbExtractor::ReserveFor(int width, int height) {
  // No two of eight neighbours are both corners.
  const size_t most_corners = static_cast<size_t>(width / 2 + 1) * static_cast<size_t>(height / 2 + 1);
  corners_.reserve(most_corners);
  selector_.Reserve(most_corners);
  chosen_.reserve(std::min(most_corners, static_cast<size_t>(options_.num_features)));
  blurred_.Resize(width, height);
}

void OrbExtractor::FillLevel(size_t index, const GrayView& image) {
  Level& level = levels_[index];
  if (index > 0) {
    level.shrinker[0].Shrink(levels_[index - 1].image, kernels_, &level.image);
    return;
  }
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(level.image.row(y), image.row(y), static_cast<size_t>(image.width));
  }
}

void OrbExtractor::Blur(const PaddedImage& image) {
  const int width = image.width(), height = image.height();
  blurred_.Resize(width, height);
  blur_row_.resize(static_cast<size_t>(width + 2 * kRowPadding));
  uint8_t* padded = blur_row_.data() + kRowPadding;
  for (int y = 0; y < height; ++y) {
    const uint8_t* rows[7];
    for (int i = 0; i < 7; ++i) rows[i] = image.row(std::clamp(y + i - 3, 0, height - 1));
    kernels_.blur_down(rows, width, padded);
    std::memset(padded - 3, padded[0], 3);
    std::memset(padded + width, padded[width - 1], 3);
    kernels_.blur_along(padded, width, blurred_.row(y));
  }
}

void OrbExtractor::Describe(int octave, const Level& level, FeatureSet* features) {
  Blur(level.image);
  for (const Corner& corner : chosen_) {
    int moment_x = 0, moment_y = 0;
    kernels_.disc_moments(level.image.row(corner.y) + corner.x, level.image.stride(), &moment_x, &moment_y);
    Keypoint keypoint;
    keypoint.x_q4 = FullResolutionQ4(corner.x, level.scale_x);
    keypoint.y_q4 = FullResolutionQ4(corner.y, level.scale_y);
    keypoint.octave = static_cast<uint8_t>(octave);
    keypoint.angle = Orientation(moment_x, moment_y);
    features->keypoints.push_back(keypoint);
    kernels_.compare_pairs(blurred_.row(corner.y) + corner.x, blurred_.stride(), pattern_.Places(keypoint.angle),
                           features->descriptors.emplace_back().words.data());
  }
}

}  // namespace dmslam
