#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/messaging/event_log.h"

namespace dmslam {

/// On which a saved map tells with which seed and settings each of the runs was played that it is made of, as
/// a session_t: where they are not those of its own session_t alone.
inline constexpr char kLogRunChannel[] = "DMSLAM_LOG_RUN";

/// The protocol of a message that another version has written, as far as that can be told: a beacon says it
/// (its layout never changes), and former types are known.
std::optional<int32_t> OtherProtocol(const LogEvent& event);

/// Writes the first message of a log that no writer's beacons are in: a beacon of its own, which says the
/// version to every later one. `prefix` comes before its channel. `records`: how many map records of a
/// session follow, where that is known: a log that lacks some of them is not whole.
struct LogContent {
  uint32_t session = 0;
  int64_t records = 0;
  int64_t schema_hash = 0;  ///< of the message types; when it is read
};
void WriteLogVersion(EventLogWriter* log, const std::string& prefix, int64_t utime_us,
                     const LogContent& content = {});

/// What such a beacon says; nothing for any other message, and where it names no content.
std::optional<LogContent> ReadLogContent(const LogEvent& event);

}  // namespace dmslam
