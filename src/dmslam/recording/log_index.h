#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/messaging/event_log.h"
#include "dmslam/messaging/types.h"
#include "dmslam/recording/log_version.h"
#include "dmslam/wire/frontend_messages.h"
#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// A message of a log: where it stands, or its bytes where it was put together from parts.
struct RecordedMessage {
  int64_t utime_us = 0;           ///< wall time at which the logger received (the last part of) it
  int64_t order = 0;              ///< counts the messages of the log
  std::optional<int64_t> offset;  ///< in the log; none: see `bytes`
  std::string channel;            ///< without prefix
  SharedBytes bytes;              ///< null unless it travelled in parts
  RecordHeader header;            ///< of a record; zero for other messages
};

/// What a log holds of one writer's term of office.
struct RecordedTerm {
  struct Snapshot {
    std::map<int64_t, RecordedMessage> pieces;  ///< by number, from 1
    int64_t cut = 0;                            ///< followed by the record after this one
    std::optional<int64_t> last;                ///< number of the last piece; none: it was not recorded
    bool whole() const { return last && pieces.size() == static_cast<size_t>(*last); }
  };
  std::map<int64_t, RecordedMessage> records;  ///< by seq
  std::map<int64_t, Snapshot> snapshots;       ///< by number
  bool fresh = false;                          ///< continues nothing
  Version parent;                              ///< what it continues
};

/// A stream as recorded: its terms of office in their order.
using RecordedStream = std::map<Term, RecordedTerm>;

/// What a log holds of one camera's player.
struct RecordedCamera {
  std::optional<CameraInfo> info;                   ///< the first one
  std::map<uint32_t, RecordedMessage> frames;       ///< by index; the first of those that were repeated
  std::map<uint32_t, int64_t> stamps_ns;            ///< of the frames
  std::map<int64_t, GroundTruthPose> ground_truth;  ///< by stamp
  std::optional<EndOfSequence> end;
};

/// The term of what SaveMap writes: of no run, whose epochs are microseconds since 1970.
inline constexpr Term kSavedTerm{1, 1};

/// What a log holds of one session.
struct RecordedSession {
  uint32_t id = 0;
  std::map<CameraId, RecordedCamera> cameras;  ///< whose players were recorded
  std::map<StreamId, RecordedStream> streams;
  std::optional<LogContent> saved;        ///< of a saved map: what its first message says of it
  std::map<uint32_t, SessionStart> runs;  ///< of a saved map: what it says of the runs in it, by session

  const RecordedStream& Stream(StreamId id) const;
  /// Whether it was written by SaveMap, and by no run: also where its first message is lost.
  bool IsSavedMap() const;
  /// The cameras of which frames were recorded, in order.
  std::vector<CameraId> CamerasWithFrames() const;
  /// The cameras whose frontends were recorded, in order.
  std::vector<CameraId> CamerasWithFrontend() const;
};

/// Reads a log of lcm-logger once and knows where everything in it stands. Records may have travelled whole
/// or in parts. Bad messages are left out and counted.
class LogIndex {
 public:
  /// Throws InputError for what is no log, or a log without any message of ours; one that another version has
  /// recorded is called that.
  /// `key`: of the bus; a log that was recorded under it gives only what was said by those who have it.
  explicit LogIndex(const std::string& path, const std::optional<BusKey>& key = std::nullopt);

  /// The session `id`; 0: the only one there is. Throws InputError that names the sessions there are.
  const RecordedSession& Session(uint32_t id = 0) const;
  const std::map<uint32_t, RecordedSession>& sessions() const { return sessions_; }
  /// The bytes of a message.
  Bytes Read(const RecordedMessage& message) const;

  const std::string& path() const { return reader_.path(); }
  int64_t begin_us() const { return begin_us_; }  ///< wall time of the first message
  int64_t end_us() const { return end_us_; }
  int64_t num_messages() const { return num_messages_; }
  int64_t bad_messages() const { return bad_messages_; }
  /// The protocol of messages that another version has written; none: there are no such messages.
  std::optional<int32_t> other_protocol() const;
  /// What was skipped, for people, one line; empty when nothing was.
  std::string DescribeDamage() const;

 private:
  struct Parts;
  void Add(const LogEvent& event, Parts* parts);
  bool AddOfPlayer(const LogEvent& event, const RecordedMessage& message);
  void AddFrame(const LogEvent& event, RecordedMessage message);
  void AddRun(const LogEvent& event);
  void AddRecord(RecordedMessage message, std::span<const uint8_t> bytes);
  void AddPart(const LogEvent& event, RecordedMessage message, Parts* parts);
  template <typename Message>
  std::optional<Message> Decode(std::span<const uint8_t> bytes);
  template <typename Message>
  RecordedCamera& CameraOf(const Message& message);

  mutable EventLogReader reader_;
  bool unverified_ = false;  ///< a key was given, and it is not the one under which the log was recorded
  std::map<uint32_t, RecordedSession> sessions_;
  int64_t begin_us_ = 0, end_us_ = 0;
  int64_t num_messages_ = 0, bad_messages_ = 0;
  std::map<int32_t, int64_t> of_protocol_;  ///< messages of other versions, by their protocol
};

/// One step of a stream that is gone through again.
struct ReplayStep {
  const RecordedMessage* message = nullptr;
  bool begins_anew = false;  ///< what was held before is void
  Term term;                 ///< in which it was written
};

struct Replay {
  std::vector<ReplayStep> steps;
  int64_t missing = 0;  ///< records that existed, are not in the log, and are not made up for by a snapshot
};

/// The records of a stream in their order, through terms that continue one another, up to a wall time. Where
/// records are missing it begins at a snapshot behind them, if a whole one was recorded.
Replay PlanReplay(const RecordedStream& stream, int64_t until_us = INT64_MAX);

}  // namespace dmslam
