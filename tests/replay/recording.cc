#include "recording.h"

#include <cstring>
#include <span>

#include "dmslam/wire/codec.h"

namespace dmslam::replay {

std::vector<uint8_t> ToBytes(const Recording& recording) {
  std::vector<uint8_t> bytes;
  for (const FrameInput& frame : recording) {
    KeyframeProposal message;
    message.id = KeyframeId::Make(1, frame.index);
    message.reference = message.id;
    message.map_id = 1;
    message.stamp_ns = frame.stamp_ns;
    message.features = frame.features;
    const std::vector<uint8_t> encoded = wire::Encode(message);
    const auto size = static_cast<uint32_t>(encoded.size());
    const auto* begin = reinterpret_cast<const uint8_t*>(&size);
    bytes.insert(bytes.end(), begin, begin + sizeof(size));
    bytes.insert(bytes.end(), encoded.begin(), encoded.end());
  }
  return bytes;
}

std::optional<Recording> FromBytes(const std::vector<uint8_t>& bytes) {
  Recording recording;
  std::span<const uint8_t> rest(bytes);
  while (!rest.empty()) {
    uint32_t size = 0;
    if (rest.size() < sizeof(size)) return std::nullopt;
    std::memcpy(&size, rest.data(), sizeof(size));
    rest = rest.subspan(sizeof(size));
    if (rest.size() < size) return std::nullopt;
    std::optional<KeyframeProposal> message = wire::Decode<KeyframeProposal>(rest.first(size));
    if (!message) return std::nullopt;
    recording.push_back({message->id.frame_index(), message->stamp_ns, std::move(message->features)});
    rest = rest.subspan(size);
  }
  return recording;
}

}  // namespace dmslam::replay
