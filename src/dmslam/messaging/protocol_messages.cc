#include "dmslam/messaging/protocol_messages.h"

#include "dmslam/messaging/codec.h"
#include "dmslam/util/crc32c.h"

namespace dmslam {
namespace {

constexpr int64_t kBehindUtime = 8 + static_cast<int64_t>(kHeaderBytes);  // bytes of utime and header
constexpr size_t kPartCrcOffset = 40;
constexpr size_t kPartDataOffset = 44;
constexpr int64_t kMaxMissing = 32;

// Walks a message of fixed fields and `num_strings` strings behind the header.
bool FixedThenStrings(std::span<const uint8_t> bytes, int64_t fixed_bytes, int num_strings) {
  LayoutWalker walk(bytes);
  walk.Skip(kBehindUtime + fixed_bytes);
  for (int i = 0; i < num_strings; ++i) walk.String();
  return walk.complete();
}

template <typename Message>
std::optional<Message> DecodeSealed(std::string_view channel, std::span<const uint8_t> bytes,
                                    bool layout_fits) {
  if (!layout_fits || !IsIntact(channel, bytes)) return std::nullopt;
  return DecodeWalked<Message>(bytes);
}

bool AckLayoutFits(std::span<const uint8_t> bytes) {
  LayoutWalker walk(bytes);
  const int64_t num_missing = walk.Skip(kBehindUtime).Count();
  walk.Skip(4 + 8 + 8 + 8 + 4).Array(num_missing, 8 + 8 + 4 + 4).String().String();
  return walk.complete() && num_missing <= kMaxMissing;
}

uint32_t PartChecksum(std::span<const uint8_t> bytes) {
  return Crc32c(bytes.subspan(kPartDataOffset), Crc32c(bytes.first(kPartCrcOffset)));
}

bool IsCount(int64_t value) { return value >= 0 && value < kMaxSeq; }

bool IsEpoch(int64_t value) { return value >= 0 && value < kMaxEpoch; }

bool IsPlausible(const ack_t& ack) {
  return IsEpoch(ack.header.epoch) && IsEpoch(ack.header.parent_epoch) && IsCount(ack.header.seq) &&
         IsCount(ack.header.parent_seq) && IsCount(ack.received);
}

bool IsPlausible(const head_t& head) {
  return IsEpoch(head.header.epoch) && IsCount(head.header.seq) && IsCount(head.first_seq) &&
         head.first_seq <= head.header.seq + 1 && head.snapshots >= 0 && head.snapshot_total >= 0 &&
         IsCount(head.snapshot_cut) && IsCount(head.snapshot_first) && IsCount(head.snapshot_last);
}

}  // namespace

std::optional<head_t> DecodeHead(std::string_view channel, std::span<const uint8_t> bytes) {
  std::optional<head_t> head =
      DecodeSealed<head_t>(channel, bytes, FixedThenStrings(bytes, 4 * 4 + 6 * 8, 1));
  return head && IsPlausible(*head) ? head : std::nullopt;
}

std::optional<ack_t> DecodeAck(std::string_view channel, std::span<const uint8_t> bytes) {
  std::optional<ack_t> ack = DecodeSealed<ack_t>(channel, bytes, AckLayoutFits(bytes));
  return ack && IsPlausible(*ack) ? ack : std::nullopt;
}

std::optional<take_over_t> DecodeTakeOver(std::string_view channel, std::span<const uint8_t> bytes) {
  return DecodeSealed<take_over_t>(channel, bytes, FixedThenStrings(bytes, 8, 1));
}

std::optional<hand_over_t> DecodeHandOver(std::string_view channel, std::span<const uint8_t> bytes) {
  return DecodeSealed<hand_over_t>(channel, bytes, FixedThenStrings(bytes, 8 + 8 + 4, 0));
}

std::optional<replica_t> DecodeReplica(std::string_view channel, std::span<const uint8_t> bytes) {
  return DecodeSealed<replica_t>(channel, bytes, FixedThenStrings(bytes, 8 + 8, 1));
}

std::optional<part_t> DecodePart(std::span<const uint8_t> bytes) {
  if (bytes.size() < kPartDataOffset || GetInt<uint32_t>(bytes, kPartCrcOffset) != PartChecksum(bytes)) {
    return std::nullopt;
  }
  LayoutWalker walk(bytes);
  const int64_t num_bytes = walk.Skip(8).Count();
  if (!walk.Skip(4 + 8 + 4 + 4 + 4).Array(num_bytes, 1).complete()) return std::nullopt;
  std::optional<part_t> part = DecodeWalked<part_t>(bytes);
  if (part && (part->num_bytes == 0 || part->seq < 1 || part->seq >= kMaxSeq || part->offset < 0 ||
               part->total_bytes < part->num_bytes || part->offset > part->total_bytes - part->num_bytes)) {
    return std::nullopt;
  }
  return part;
}

template <typename Message>
Outgoing SealedMessage(const std::string& channel, const Message& message) {
  Bytes bytes = Encode(message);
  Seal(message.header, channel, bytes);
  return {channel, std::make_shared<const Bytes>(std::move(bytes)), false};
}

template Outgoing SealedMessage(const std::string&, const head_t&);
template Outgoing SealedMessage(const std::string&, const ack_t&);
template Outgoing SealedMessage(const std::string&, const take_over_t&);
template Outgoing SealedMessage(const std::string&, const hand_over_t&);
template Outgoing SealedMessage(const std::string&, const replica_t&);

Bytes EncodePart(const part_t& part) {
  Bytes bytes = Encode(part);
  PutInt(PartChecksum(bytes), kPartCrcOffset, bytes);
  return bytes;
}

int32_t StreamKey(int64_t session, StreamId stream, const Term& term, int64_t snapshot) {
  uint8_t bytes[40];
  const int64_t fields[5] = {session, static_cast<int64_t>(stream), term.epoch, term.writer, snapshot};
  for (size_t i = 0; i < 5; ++i) PutInt(fields[i], 8 * i, bytes);
  return static_cast<int32_t>(Crc32c(bytes));
}

}  // namespace dmslam
