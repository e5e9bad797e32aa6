#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "dmslam/map/map_delta.h"
#include "dmslam/map/proposals.h"
#include "dmslam/wire/channels.h"
#include "dmslam/wire/frontend_messages.h"
#include "dmslam/wire/player_messages.h"
#include "dmslam/wire/status.h"

namespace dmslam::wire {

/// All that travels between processes, except the protocol's own messages.
using Messages =
    std::tuple<CameraInfo, Frame, EndOfSequence, GroundTruthPose, PlayerStatus,                      //
               SessionStart, InitialMap, KeyframeProposal, FramePose, FrameEvidence, MapReset,       //
               AdjustRequest, FrameDone, SequenceDone, Odometry, PoseView, FeatureView, FrameTrace,  //
               FrontendStatus, MapDelta, MapperStatus, LoopAnswer, LoopcloserStatus, TurnRequest>;

/// Where a message travels and what it is there.
struct MessageInfo {
  const char* channel;
  const char* type;     ///< name of the LCM type
  bool is_record;       ///< of a stream: it carries a record header
  int64_t fingerprint;  ///< the first eight bytes of its encoding
};

/// Of one of `Messages`.
template <typename Message>
MessageInfo Info();

/// Of all `Messages`.
inline std::vector<MessageInfo> AllInfos() {
  return []<typename... Message>(std::type_identity<std::tuple<Message...>>) {
    return std::vector<MessageInfo>{Info<Message>()...};
  }(std::type_identity<Messages>());
}

/// Over the fingerprints of all `Messages`: two programs with the same one understand each other's messages.
int64_t SchemaHash();

/// Encodes one of `Messages`: the bytes of its LCM type. The header of a record is zero, for the stream to
/// fill in. Text is made clean (valid UTF-8 without control characters, at most kMaxTextBytes). Throws
/// InvariantError that names the value when the message holds one that Decode would refuse.
template <typename Message>
std::vector<uint8_t> Encode(const Message& message);

/// Decodes one of `Messages`, for bytes from anywhere. Length, counts and strings are checked before the
/// generated decoder runs, then a checksum of its own must fit, where it has one, then it must consume
/// exactly the bytes there are, then every value must make sense: finite numbers, unit quaternions, ids that
/// can be, indices in range, order where it is promised. None otherwise; `reason`, if not null, says why. The
/// round trip is exact, doubles bit for bit (of a record's header nothing is kept).
template <typename Message>
std::optional<Message> Decode(std::span<const uint8_t> bytes, std::string* reason = nullptr);

/// Longest text that travels in a message.
inline constexpr size_t kMaxTextBytes = 1024;
/// Longest message that is decoded.
inline constexpr size_t kMaxMessageBytes = 64UL << 20;

}  // namespace dmslam::wire
