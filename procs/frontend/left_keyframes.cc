#include "frontend/left_keyframes.h"

#include <algorithm>
#include <utility>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/channels.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

void LeftKeyframes::Hear(std::span<const uint8_t> bytes, int64_t now_ns) {
  if (term_ && now_ns >= term_->until_ns) return;
  if (!IsIntact(ChannelOfCamera(channels::kKeyframe, camera_), bytes)) return;
  const std::optional<RecordHeader> header = ParseHeader(bytes);
  const bool of_stream = header && header->session == session_ &&
                         header->stream == static_cast<int32_t>(StreamOfCamera(StreamId::kFrontend, camera_));
  if (!of_stream) return;
  const Term said_in{header->epoch, header->writer};
  if (term_ && said_in == term_->term) return;
  std::optional<KeyframeProposal> proposal = wire::Decode<KeyframeProposal>(bytes);
  if (!proposal || proposal->id.session() != session_ || proposal->id.camera() != camera_) return;
  const bool known =
      std::ranges::find(told_, proposal->id) != told_.end() ||
      std::ranges::any_of(left_, [&](const Left& left) { return left.proposal.id == proposal->id; });
  if (known) return;
  left_.push_back({said_in, std::move(*proposal)});
  if (left_.size() > kMost) left_.pop_front();
}

std::optional<KeyframeProposal> LeftKeyframes::Next(const Map& map) {
  DMSLAM_CHECK(term_.has_value(), "what was left is proposed again in a term of one's own");
  while (!left_.empty()) {
    Left left = std::move(left_.front());
    left_.pop_front();
    if (left.said_in >= term_->term || map.HasKnown(left.proposal.id)) continue;
    told_.push_back(left.proposal.id);
    if (told_.size() > kMost) told_.pop_front();
    return std::move(left.proposal);
  }
  return std::nullopt;
}

}  // namespace dmslam
