#include "noise.h"

#include <algorithm>

#include "dmslam/messaging/keyed_bus.h"
#include "dmslam/util/crc32c.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

constexpr size_t kKeptPerChannel = 8;
constexpr size_t kKeptMade = 200'000;
constexpr size_t kMaxNoiseBytes = 1400;
constexpr size_t kLargeBytes = 4000;  // large messages are changed seldom: they are many datagrams each
constexpr uint32_t kLargeSeldom = 50;

}  // namespace

std::vector<std::string> AllChannels() {
  std::vector<std::string> all = {channels::kSessionAgain};
  for (const wire::MessageInfo& info : wire::AllInfos()) all.emplace_back(info.channel);
  for (const std::string process : {"FRONTEND", "MAPPER", "LOOPCLOSER", "COLLECTOR"}) {
    for (const auto& name : {HeadChannel(process), PartChannel(process), AckChannel(process),
                             TakeOverChannel(process), HandOverChannel(process), ReplicaChannel(process)}) {
      all.push_back(name);
    }
  }
  all.emplace_back(kProofChannel);
  return all;
}

NoiseMaker::NoiseMaker(uint64_t seed) : channels_(AllChannels()), random_(seed) {}

bool NoiseMaker::IsOurs(std::span<const uint8_t> bytes) const { return made_.contains(Crc32c(bytes)); }

void NoiseMaker::Remember(std::span<const uint8_t> bytes) {
  const uint32_t checksum = Crc32c(bytes);
  if (!made_.insert(checksum).second) return;
  made_order_.push_back(checksum);
  if (made_order_.size() <= kKeptMade) return;
  made_.erase(made_order_.front());
  made_order_.pop_front();
}

void NoiseMaker::Hear(const std::string& channel, std::span<const uint8_t> bytes) {
  if (IsOurs(bytes)) return;
  std::deque<Bytes>& kept = heard_[channel];
  kept.emplace_back(bytes.begin(), bytes.end());
  if (kept.size() > kKeptPerChannel) kept.pop_front();
}

Bytes NoiseMaker::MakeNoise() {
  Bytes bytes(random_.Below(kMaxNoiseBytes));
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random_.Below(256));
  return bytes;
}

Bytes NoiseMaker::Change(const Bytes& sound) {
  Bytes bytes = sound;
  const uint32_t count = 1 + random_.Below(16);
  for (uint32_t i = 0; i < count; ++i) {
    const size_t at = random_.Below(static_cast<uint32_t>(bytes.size()));
    bytes[at] = static_cast<uint8_t>(bytes[at] ^ (1 + random_.Below(255)));
  }
  return bytes;
}

Outgoing NoiseMaker::Make() {
  const std::string& channel = channels_[random_.Below(static_cast<uint32_t>(channels_.size()))];
  const auto heard = heard_.find(channel);
  Bytes bytes;
  if (heard != heard_.end() && random_.Below(4) != 0) {
    const Bytes& sound = heard->second[random_.Below(static_cast<uint32_t>(heard->second.size()))];
    const bool small = sound.size() <= kLargeBytes || random_.Below(kLargeSeldom) == 0;
    if (small && !sound.empty()) bytes = Change(sound);
    if (bytes == sound) bytes.clear();  // changed back into itself
  }
  if (!bytes.empty()) ++changed_;
  if (bytes.empty()) bytes = MakeNoise();
  Remember(bytes);
  return {channel, std::make_shared<const Bytes>(std::move(bytes)), false};
}

}  // namespace dmslam
