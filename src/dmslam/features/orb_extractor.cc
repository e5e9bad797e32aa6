#include "dmslam/features/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "dmslam/features/subpixel.h"
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

/// A level's coordinate in sixteenths of a pixel of the image; pixel centres map to pixel centres.
uint16_t ImageQ4(double coordinate, double scale) {
  return static_cast<uint16_t>(std::lround(((coordinate + 0.5) * scale - 0.5) * 16.0));
}

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
    : options_((options.Check(), options)),
      kernels_(KernelsOn(options.simd_path)),
      pattern_(BriefPattern()) {}

void OrbExtractor::Extract(const GrayView& image, FeatureSet* features) {
  DMSLAM_CHECK(image.width <= 4095 && image.height <= 4095, "keypoints cannot name pixels beyond 4095");
  features->keypoints.clear();
  features->descriptors.clear();
  features->keypoints.reserve(static_cast<size_t>(options_.num_features));
  features->descriptors.reserve(static_cast<size_t>(options_.num_features));
  if (image.width != pyramid_.width() || image.height != pyramid_.height()) SetUp(image.width, image.height);
  pyramid_.MakeFirst(image, kernels_);
  int missing = 0;  // what finer levels could not give is asked of the coarser ones
  for (size_t octave = 0; octave < pyramid_.size(); ++octave) {
    if (octave > 0) pyramid_.ShrinkInto(octave, kernels_);
    const PaddedImage& level = pyramid_.level(octave).image;
    detector_.Detect(level, options_.min_fast_threshold, options_.border_px, kernels_, &corners_);
    const int wanted = quotas_[octave] + missing;
    selector_.Select(corners_, wanted, level.width(), level.height(),
                     {options_.cell_size_px, options_.fast_threshold, options_.rank_decay}, &chosen_);
    missing = wanted - static_cast<int>(chosen_.size());
    if (!chosen_.empty()) Describe(octave, features);
  }
}

void OrbExtractor::SetUp(int width, int height) {
  pyramid_.SetUp(width, height, options_.pyramid, 2 * options_.border_px);
  SetQuotas();
  if (pyramid_.size() == 0) return;
  const PaddedImage& finest = pyramid_.level(0).image;
  // No two of eight neighbours are both corners.
  const size_t most_corners =
      static_cast<size_t>(finest.width() / 2 + 1) * static_cast<size_t>(finest.height() / 2 + 1);
  corners_.reserve(most_corners);
  selector_.Reserve(most_corners);
  chosen_.reserve(std::min(most_corners, static_cast<size_t>(options_.num_features)));
  smooth_.Resize(finest.width(), finest.height());
}

void OrbExtractor::SetQuotas() {
  // In proportion to the levels' side lengths; rounding errors go to the last.
  quotas_.assign(pyramid_.size(), 0);
  double sum = 0.0;
  for (size_t i = 0; i < quotas_.size(); ++i) sum += 1.0 / pyramid_.level(i).scale_x;
  int given = 0;
  for (size_t i = 0; i < quotas_.size(); ++i) {
    const bool last = i + 1 == quotas_.size();
    const double share = 1.0 / pyramid_.level(i).scale_x / sum;
    quotas_[i] =
        last ? options_.num_features - given : static_cast<int>(std::lround(share * options_.num_features));
    given += quotas_[i];
  }
}

void OrbExtractor::Describe(size_t octave, FeatureSet* features) {
  const ImagePyramid::Level& level = pyramid_.level(octave);
  smoother_.Smooth(level.image, kernels_, &smooth_);
  for (const Corner& corner : chosen_) {
    const uint8_t* pixel = level.image.row(corner.y) + corner.x;
    uint8_t scores[9];
    kernels_.scores_around(pixel, level.image.stride(), scores);
    const SubpixelOffset offset = RefineMaximum(scores);
    int moment_x = 0, moment_y = 0;
    kernels_.disc_moments(pixel, level.image.stride(), &moment_x, &moment_y);
    Keypoint keypoint;
    keypoint.x_q4 = ImageQ4(corner.x + offset.x, level.scale_x);
    keypoint.y_q4 = ImageQ4(corner.y + offset.y, level.scale_y);
    keypoint.octave = static_cast<uint8_t>(octave);
    keypoint.angle = Orientation(moment_x, moment_y);
    features->keypoints.push_back(keypoint);
    kernels_.compare_pairs(smooth_.row(corner.y) + corner.x, smooth_.stride(),
                           pattern_.Places(keypoint.angle),
                           features->descriptors.emplace_back().words.data());
  }
}

}  // namespace dmslam
