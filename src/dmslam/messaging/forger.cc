#include "dmslam/messaging/forger.h"

#include <iterator>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"

namespace dmslam {
namespace {

constexpr int64_t kFarNs = 1'000'000'000;

template <typename Message>
const std::pair<const std::string, Message>& AnyOf(const std::map<std::string, Message>& heard,
                                                   Random* random) {
  return *std::next(heard.begin(), random->Below(static_cast<uint32_t>(heard.size())));
}

/// "MAPPER" of the channel of its beacons.
std::string OwnerOf(const std::string& head_channel) {
  const std::string before = "DMSLAM_", after = "_HEAD";
  return head_channel.substr(before.size(), head_channel.size() - before.size() - after.size());
}

Outgoing TakeOver(const std::string& owner, const head_t& head, int64_t successor) {
  take_over_t request{};
  request.header = head.header;
  request.header.seq = 0;
  request.successor = successor;
  request.name = "nobody";
  return SealedMessage(TakeOverChannel(owner), request);
}

}  // namespace

void Forger::Hear(const Outgoing& message) {
  if (const auto head = DecodeHead(message.channel, *message.bytes)) heads_[message.channel] = *head;
  if (const auto ack = DecodeAck(message.channel, *message.bytes)) acks_[message.channel] = *ack;
}

std::optional<Outgoing> Forger::Make(Random* random) const {
  if (heads_.empty() || acks_.empty()) return std::nullopt;
  auto [head_channel, head] = AnyOf(heads_, random);
  auto [ack_channel, ack] = AnyOf(acks_, random);
  const int64_t far = kFarNs + static_cast<int64_t>(random->Next() >> 16);
  switch (random->Below(8)) {
    case 0:
      head.header.epoch += far;
      break;
    case 1:
      head.state = head_t::STATE_CLOSED;
      break;
    case 2:
      head.header.seq += far;
      break;
    case 3:
      head.utime += far;
      break;
    case 4:
      ack.header.epoch += far;
      return SealedMessage(ack_channel, ack);
    case 5:
      ack.header.seq += far;
      return SealedMessage(ack_channel, ack);
    case 6:
      ack.utime += far;
      return SealedMessage(ack_channel, ack);
    default:
      return TakeOver(OwnerOf(head_channel), head, far);
  }
  ++head.utime;  // no copy
  return SealedMessage(head_channel, head);
}

}  // namespace dmslam
