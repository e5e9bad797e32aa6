#include "dmslam/messaging/camera_channels.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace dmslam {
namespace {

constexpr std::string_view kOwners[] = {"DMSLAM_PLAYER", "DMSLAM_FRONTEND"};
constexpr int32_t kStreamsPerCamera = 1000;

/// Where the number stands in the channel's name; none where it belongs to no camera.
size_t PlaceOfNumber(const std::string& channel) {
  for (const std::string_view owner : kOwners) {
    if (channel.starts_with(owner)) return owner.size();
  }
  return std::string::npos;
}

}  // namespace

std::string OfCamera(const std::string& role, CameraId camera) {
  return camera == 0 ? role : role + std::to_string(camera);
}

std::string OwnerName(const std::string& role) {
  std::string owner = role;
  std::ranges::transform(owner, owner.begin(), [](unsigned char c) { return std::toupper(c); });
  return owner;
}

std::string ChannelOfCamera(const std::string& channel, CameraId camera) {
  const size_t at = camera == 0 ? std::string::npos : PlaceOfNumber(channel);
  return at == std::string::npos ? channel : std::string(channel).insert(at, std::to_string(camera));
}

CameraChannel SplitCamera(const std::string& channel) {
  const size_t at = PlaceOfNumber(channel);
  if (at == std::string::npos) return {channel, 0};
  const auto digits = std::find_if_not(channel.begin() + static_cast<std::ptrdiff_t>(at), channel.end(),
                                       [](unsigned char c) { return std::isdigit(c) != 0; });
  const size_t count = static_cast<size_t>(digits - channel.begin()) - at;
  if (count == 0 || count > 3) return {channel, 0};
  const CameraId camera = static_cast<CameraId>(std::stoul(channel.substr(at, count)));
  return {std::string(channel).erase(at, count), camera};
}

StreamId StreamOfCamera(StreamId stream, CameraId camera) {
  const bool of_camera = stream == StreamId::kPlayer || stream == StreamId::kFrontend;
  if (!of_camera) return stream;
  return static_cast<StreamId>(static_cast<int32_t>(stream) +
                               kStreamsPerCamera * static_cast<int32_t>(camera));
}

}  // namespace dmslam
