#include "dmslam/dataset/seen_as.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "dmslam/camera/image_scale.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr double kMinCovered = 0.95;  // of the other camera's image
constexpr double kMaxCoarser = 3.0;   // pixels of the other camera in one of this
constexpr double kSamePx = 0.5;       // so near a pixel comes back from where a lens puts it
const Eigen::Vector2d kNowhere(-1e6, -1e6);

/// Where `from` has the ray of pixel (x, y) of `as`; far outside where it does not see it.
Eigen::Vector2d Find(const Camera& from, const Camera& as, int x, int y) {
  const auto ideal_as = as.Undistort({x, y});
  const auto ideal = ideal_as ? from.Project(as.Ray(*ideal_as)) : std::nullopt;
  if (!ideal) return kNowhere;
  const Eigen::Vector2d raw = from.Distort(*ideal);
  // Far outside the image a lens's polynomial may lead back into it.
  const auto back = from.Undistort(raw);
  return back && (*back - *ideal).norm() < kSamePx ? raw : kNowhere;
}

bool IsInside(const Camera& camera, const Eigen::Vector2d& px) {
  return px.x() >= -0.5 && px.y() >= -0.5 && px.x() <= camera.width_px - 0.5 &&
         px.y() <= camera.height_px - 0.5;
}

/// Between four pixels; beyond the rim its pixels are repeated.
double Interpolate(const GrayImage& image, const Eigen::Vector2d& px) {
  const double u = std::clamp(px.x(), 0.0, image.width - 1.0),
               v = std::clamp(px.y(), 0.0, image.height - 1.0);
  const int x = std::min(static_cast<int>(u), std::max(0, image.width - 2));
  const int y = std::min(static_cast<int>(v), std::max(0, image.height - 2));
  const int right = std::min(x + 1, image.width - 1), below = std::min(y + 1, image.height - 1);
  const double a = u - x, b = v - y;
  return (1 - b) * ((1 - a) * image.at(x, y) + a * image.at(right, y)) +
         b * ((1 - a) * image.at(x, below) + a * image.at(right, below));
}

class SeenAsSource : public FrameSource {
 public:
  SeenAsSource(std::unique_ptr<FrameSource> source, Resampler resampler)
      : source_(std::move(source)), resampler_(std::move(resampler)) {}

  size_t size() const override { return source_->size(); }
  int64_t StampNs(size_t index) const override { return source_->StampNs(index); }
  std::string Name(size_t index) const override { return source_->Name(index); }
  EncodedImage Read(size_t index) override {
    EncodedImage image = source_->Read(index);
    if (image.encoding == ImageEncoding::kFile) image.encoding = DetectEncoding(image.bytes);
    decoder_.Decode(image.encoding, image.width, image.height, image.bytes, Name(index), taken_);
    GrayImage seen = resampler_.Resample(taken_, Name(index));
    return {ImageEncoding::kGray8, seen.width, seen.height, std::move(seen.data)};
  }
  size_t missing() const override { return source_->missing(); }
  std::optional<std::string> GroundTruthPath() const override { return source_->GroundTruthPath(); }
  std::vector<StampedPose> GroundTruth() const override { return source_->GroundTruth(); }
  uint32_t FrameIndex(size_t index) const override { return source_->FrameIndex(index); }

 private:
  std::unique_ptr<FrameSource> source_;
  Resampler resampler_;
  GrayDecoder decoder_;
  GrayImage taken_;
};

}  // namespace

Resampler::Resampler(const Camera& from, const Camera& as)
    : from_(from),
      as_(as),
      samples_(std::max(1, static_cast<int>(std::lround(FocalPx(from) / FocalPx(as))))) {
  size_t inside = 0;
  for (int y = 0; y < as.height_px; ++y) {
    for (int x = 0; x < as.width_px; ++x) {
      at_.push_back(Find(from, as, x, y));
      inside += IsInside(from, at_.back()) ? 1 : 0;
    }
  }
  covered_ = static_cast<double>(inside) / static_cast<double>(at_.size());
}

GrayImage Resampler::Resample(const GrayImage& image, const std::string& name) const {
  if (image.width != from_.width_px || image.height != from_.height_px) {
    throw InputError(name + ": has " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                     " pixels, but its camera file says " + std::to_string(from_.width_px) + "x" +
                     std::to_string(from_.height_px));
  }
  GrayImage seen(as_.width_px, as_.height_px);
  const double share = 1.0 / samples_;
  for (int y = 0; y < as_.height_px; ++y) {
    for (int x = 0; x < as_.width_px; ++x) {
      const Eigen::Vector2d at = At(x, y);
      // A step to the next pixel, in the first camera's image.
      const Eigen::Vector2d right = x + 1 < as_.width_px ? At(x + 1, y) - at : at - At(x - 1, y);
      const Eigen::Vector2d down = y + 1 < as_.height_px ? At(x, y + 1) - at : at - At(x, y - 1);
      double sum = 0;
      for (int j = 0; j < samples_; ++j) {
        for (int i = 0; i < samples_; ++i)
          sum +=
              Interpolate(image, at + ((i + 0.5) * share - 0.5) * right + ((j + 0.5) * share - 0.5) * down);
      }
      seen.at(x, y) = static_cast<uint8_t>(std::lround(sum * share * share));
    }
  }
  return seen;
}

std::unique_ptr<FrameSource> SeenAs(std::unique_ptr<FrameSource> source, const Camera& from, const Camera& as,
                                    const std::string& name) {
  if (from.SeesAs(as)) return source;
  if (FocalPx(as) > kMaxCoarser * FocalPx(from)) {
    throw InputError(name + ": its camera is more than " + std::to_string(std::lround(kMaxCoarser)) +
                     " times as coarse as the one that its frames are to be told by; choose a coarser model");
  }
  Resampler resampler(from, as);
  if (resampler.covered() < kMinCovered) {
    throw InputError(name + ": its camera sees " + std::to_string(std::lround(100 * resampler.covered())) +
                     " % of what the one sees that its frames are to be told by; choose the model with the "
                     "narrowest view");
  }
  return std::make_unique<SeenAsSource>(std::move(source), std::move(resampler));
}

}  // namespace dmslam
