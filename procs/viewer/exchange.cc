#include "viewer/exchange.h"

#include "dmslam/dataset/image.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kImagesKept = 12;
constexpr int kJpegQuality = 85;

std::vector<uint8_t> Raw(const Frame& frame, ImageEncoding encoding) {
  const EncodedImage image{encoding, frame.width_px, frame.height_px, frame.data};
  if (encoding == ImageEncoding::kGray8) return EncodeJpeg(DecodeGray(image, "frame"), kJpegQuality);
  return EncodeJpeg(DecodeColor(image, "frame"), kJpegQuality);
}

std::vector<uint8_t> ToJpeg(Frame frame) {
  switch (frame.encoding) {
    case FrameEncoding::kJpeg:
      return std::move(frame.data);
    case FrameEncoding::kPng:
      return Raw(frame, ImageEncoding::kPng);
    case FrameEncoding::kGray8:
      return Raw(frame, ImageEncoding::kGray8);
    case FrameEncoding::kRgb8:
      return Raw(frame, ImageEncoding::kRgb8);
    case FrameEncoding::kBgr8:
      return Raw(frame, ImageEncoding::kBgr8);
  }
  return {};
}

}  // namespace

const std::vector<uint8_t>& ServedImage::Jpeg() {
  std::call_once(encoded_, [this] {
    try {
      jpeg_ = ToJpeg(std::move(frame_));
    } catch (const InputError&) {
      jpeg_.clear();  // the frontend says so
    }
  });
  return jpeg_;
}

void Exchange::AddImage(Frame frame) {
  auto image = std::make_shared<ServedImage>(std::move(frame));
  const std::lock_guard lock(mutex_);
  if (!images_.empty() && images_.back()->frame_index() == image->frame_index()) return;  // a repeat
  images_.push_back(std::move(image));
  if (images_.size() > kImagesKept) images_.pop_front();
}

std::vector<uint8_t> Exchange::EncodeScene(uint32_t generation, uint64_t since) const {
  const std::lock_guard lock(mutex_);
  return scene_.Encode(generation, since);
}

std::string Exchange::SeriesJson(int64_t since, int64_t most) const {
  const std::lock_guard lock(mutex_);
  return series_.Json(since, most);
}

std::shared_ptr<ServedImage> Exchange::FindImage(std::optional<uint32_t> frame_index) const {
  const std::lock_guard lock(mutex_);
  for (auto it = images_.rbegin(); frame_index && it != images_.rend(); ++it) {
    if ((*it)->frame_index() == *frame_index) return *it;
  }
  return images_.empty() ? nullptr : images_.back();
}

void Exchange::SetHealth(HealthText health) {
  const std::lock_guard lock(mutex_);
  health_ = std::move(health);
}

HealthText Exchange::Health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

}  // namespace dmslam
