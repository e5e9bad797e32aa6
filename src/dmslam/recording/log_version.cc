#include "dmslam/recording/log_version.h"

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/util/version.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/former_types.h"

namespace dmslam {
namespace {

constexpr char kLogOwner[] = "LOG";

}  // namespace

std::optional<int32_t> OtherProtocol(const LogEvent& event) {
  const std::optional<int64_t> fingerprint = FingerprintOf(event.bytes);
  if (!fingerprint) return std::nullopt;
  if (fingerprint != head_t::getHash()) return wire::FormerProtocol(*fingerprint);
  const std::optional<head_t> head = DecodeHead(WithoutPrefix(event.channel), event.bytes);
  const bool other = head && head->protocol_version != kProtocolVersion;
  return other ? std::optional<int32_t>(head->protocol_version) : std::nullopt;
}

void WriteLogVersion(EventLogWriter* log, const std::string& prefix, int64_t utime_us,
                     const LogContent& content) {
  head_t head{};
  if (content.records > 0) {
    head.header.session = content.session;
    head.header.stream = static_cast<int32_t>(StreamId::kMap);
    head.header.seq = content.records;
  }
  head.utime = utime_us;
  head.protocol_version = kProtocolVersion;
  head.state = head_t::STATE_CLOSED;
  head.first_seq = 1;
  head.schema_hash = wire::SchemaHash();
  head.name = std::string("log of dmslam ") + kVersion;
  const Outgoing beacon = SealedMessage(HeadChannel(kLogOwner), head);
  log->Write(utime_us, prefix + beacon.channel, *beacon.bytes);
}

std::optional<LogContent> ReadLogContent(const LogEvent& event) {
  const std::string channel = WithoutPrefix(event.channel);
  if (channel != HeadChannel(kLogOwner)) return std::nullopt;
  const std::optional<head_t> head = DecodeHead(channel, event.bytes);
  const bool names_content = head && head->header.stream == static_cast<int32_t>(StreamId::kMap) &&
                             head->header.session > 0 && head->header.session <= UINT32_MAX &&
                             head->header.seq > 0;
  if (!names_content) return std::nullopt;
  return LogContent{static_cast<uint32_t>(head->header.session), head->header.seq, head->schema_hash};
}

}  // namespace dmslam
