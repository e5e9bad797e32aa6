#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/bus_key.h"
#include "dmslam/messaging/types.h"

namespace dmslam {

/// A message as lcm-logger keeps it.
struct LogEvent {
  int64_t number = 0;    ///< counts the log's events from 0
  int64_t utime_us = 0;  ///< wall time at which the logger received it
  int64_t offset = 0;    ///< of its first byte in the file: what EventLogReader::Seek takes
  std::string channel;   ///< as on the wire, with a prefix if there was one
  Bytes bytes;
};

/// Bytes of a log that are no whole event, and how many events they held as far as the next one's number
/// says.
struct LogGap {
  int64_t offset = 0;
  int64_t num_bytes = 0;
  int64_t lost_events = 0;  ///< 0: not known
};

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// What is to be said where EventLogReader::UseKey() is false.
inline constexpr char kNothingIsVerified[] =
    "no message has a tag that fits the key: it was recorded without one or under another, and nothing in it "
    "is verified";

/// Reads the files of lcm-logger. Of a damaged or truncated one it reads what is whole: an event that is not
/// followed by another one or by the end is skipped, reading goes on at the next one, and what was skipped is
/// remembered.
///
/// An event: EDA1DA01 | int64 number | int64 utime | int32 channel length | int32 data length | channel |
/// data, all big-endian.
class EventLogReader {
 public:
  /// Throws InputError for a file that cannot be opened, or that holds no event at all.
  explicit EventLogReader(std::string path);

  /// Where the log was recorded under this key: from now on only messages with a tag that fits are read,
  /// since lcm-logger, which has no key, records what anybody sends. Else nothing changes, and the result is
  /// false.
  bool UseKey(const BusKey& key);
  /// The next whole event, without its tag if it has one; nothing at the end.
  std::optional<LogEvent> Next();
  /// The next event read begins at `offset` (LogEvent::offset), or is the first one after it. No gap is
  /// counted for the jump.
  void Seek(int64_t offset);

  const std::string& path() const { return path_; }
  int64_t size() const { return size_; }
  /// Messages that were left out since their tags do not fit the key.
  int64_t refused() const { return refused_; }
  const std::vector<LogGap>& gaps() const { return gaps_; }
  /// What was skipped so far, for people: places, bytes, events; empty when nothing was.
  std::string DescribeGaps() const;

 private:
  struct Lengths {
    int64_t channel = 0;
    int64_t data = 0;
    int64_t total() const;
  };

  std::optional<LogEvent> NextWhole();
  bool Load(int64_t offset, size_t num_bytes);
  std::optional<Lengths> HeaderAt(int64_t offset);
  bool IsFollowed(int64_t offset, const Lengths& lengths);
  std::optional<int64_t> FindEvent(int64_t from, int64_t before);
  LogEvent Read(int64_t offset, const Lengths& lengths);
  void CountGap(int64_t offset, int64_t end);

  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  int64_t size_ = 0;
  std::optional<BusKey> key_;
  int64_t refused_ = 0;
  int64_t at_ = 0;
  int64_t last_number_ = -1;
  bool gap_open_ = false;  ///< the newest gap waits for the number of the event behind it
  std::vector<LogGap> gaps_;
  Bytes buffer_;  ///< bytes of the file from buffer_offset_ on
  int64_t buffer_offset_ = 0;
};

/// Writes such a file. The same events give the same bytes.
class EventLogWriter {
 public:
  /// Replaces the file. Throws InputError when it cannot be written.
  explicit EventLogWriter(std::string path);
  void Write(int64_t utime_us, const std::string& channel, std::span<const uint8_t> bytes);
  /// Flushes; throws InputError when not all could be written (a full disk).
  void Close();
  int64_t num_events() const { return next_number_; }

 private:
  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  int64_t next_number_ = 0;
};

/// The name of one of our channels without the prefix that a system may put before it; empty for other
/// channels.
std::string WithoutPrefix(const std::string& channel);

}  // namespace dmslam
