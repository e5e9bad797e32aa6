#include "viewer/exchange.h"

#include "dmslam/dataset/image.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kImagesKept = 12;  // of each camera
constexpr int kJpegQuality = 85;
constexpr int64_t kHealthHoldsNs = 5'000'000'000;

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
  auto& images = images_[image->camera()];
  if (!images.empty() && images.back()->frame_index() == image->frame_index()) return;  // a repeat
  images.push_back(std::move(image));
  if (images.size() > kImagesKept) images.pop_front();
}

std::vector<uint8_t> Exchange::EncodeScene(uint32_t generation, uint64_t since) const {
  const std::lock_guard lock(mutex_);
  return scene_.Encode(generation, since);
}

std::string Exchange::SeriesJson(int64_t since, int64_t most, CameraId camera) const {
  const std::lock_guard lock(mutex_);
  return series_.Json(camera, since, most);
}

std::shared_ptr<ServedImage> Exchange::FindImage(std::optional<uint32_t> frame_index, CameraId camera) const {
  const std::lock_guard lock(mutex_);
  const auto found = images_.find(camera);
  if (found == images_.end()) return nullptr;
  const auto& images = found->second;
  for (auto it = images.rbegin(); frame_index && it != images.rend(); ++it) {
    if ((*it)->frame_index() == *frame_index) return *it;
  }
  return images.back();
}

void Exchange::SetHealth(HealthText health) {
  const std::lock_guard lock(mutex_);
  health_ = std::move(health);
  health_ns_ = now_ns_();
}

std::optional<HealthText> Exchange::Health() const {
  const std::lock_guard lock(mutex_);
  if (!health_ns_ || now_ns_() - *health_ns_ > kHealthHoldsNs) return std::nullopt;
  return health_;
}

}  // namespace dmslam
