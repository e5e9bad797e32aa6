#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "dmslam/ack_t.hpp"
#include "dmslam/hand_over_t.hpp"
#include "dmslam/head_t.hpp"
#include "dmslam/messaging/types.h"
#include "dmslam/part_t.hpp"
#include "dmslam/replica_t.hpp"
#include "dmslam/take_over_t.hpp"

namespace dmslam {

/// No stream gets this far: larger numbers are noise, and are kept out of all arithmetic.
inline constexpr int64_t kMaxSeq = int64_t{1} << 60;
/// No epoch gets this far: they are microseconds since 1970, or a little more.
inline constexpr int64_t kMaxEpoch = int64_t{1} << 61;
/// Between another process's wall clock and ours, from one of its words to the next.
inline constexpr int64_t kTimeToleranceUs = 5'000'000;

/// Decode one of the protocol's own messages: nothing unless its checksum, its counts, its lengths and its
/// total length are right. Nothing here throws, whatever the bytes.
std::optional<head_t> DecodeHead(std::string_view channel, std::span<const uint8_t> bytes);
std::optional<ack_t> DecodeAck(std::string_view channel, std::span<const uint8_t> bytes);
std::optional<part_t> DecodePart(std::span<const uint8_t> bytes);
std::optional<take_over_t> DecodeTakeOver(std::string_view channel, std::span<const uint8_t> bytes);
std::optional<hand_over_t> DecodeHandOver(std::string_view channel, std::span<const uint8_t> bytes);
std::optional<replica_t> DecodeReplica(std::string_view channel, std::span<const uint8_t> bytes);

/// Encodes a message with a record header and seals it for its channel.
template <typename Message>
Outgoing SealedMessage(const std::string& channel, const Message& message);

/// Encodes a part, with its checksum.
Bytes EncodePart(const part_t& part);

/// What tells the parts of one numbering (a term of a stream, or one of its snapshots) from those of another.
int32_t StreamKey(int64_t session, StreamId stream, const Term& term, int64_t snapshot);

extern template Outgoing SealedMessage(const std::string&, const head_t&);
extern template Outgoing SealedMessage(const std::string&, const ack_t&);
extern template Outgoing SealedMessage(const std::string&, const take_over_t&);
extern template Outgoing SealedMessage(const std::string&, const hand_over_t&);
extern template Outgoing SealedMessage(const std::string&, const replica_t&);

}  // namespace dmslam
