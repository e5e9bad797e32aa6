#include "dmslam/recording/map_file.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "dmslam/map/renumbering.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/recording/log_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "dmslam/util/version.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/record_groups.h"

namespace dmslam {
namespace {

template <typename Message>
void WriteRecord(EventLogWriter* log, int64_t utime_us, RecordHeader header, const Message& message,
                 const char* channel = wire::Info<Message>().channel) {
  Bytes bytes = wire::Encode(message);
  Seal(header, channel, bytes);
  log->Write(utime_us, channel, bytes);
}

RecordHeader HeaderOf(uint32_t session, StreamId stream, int64_t seq) {
  RecordHeader header{};
  header.session = session;
  header.stream = static_cast<int32_t>(stream);
  header.flags = RecordHeader::FLAG_FRESH;
  header.epoch = kSavedTerm.epoch;
  header.writer = kSavedTerm.writer;
  header.seq = seq;
  return header;
}

int64_t RecordsOf(const RecordedStream& stream) {
  int64_t records = 0;
  for (const auto& [term, recorded] : stream) records += static_cast<int64_t>(recorded.records.size());
  return records;
}

std::map<MapId, size_t> KeyframesOfMaps(const Map& map) {
  std::map<MapId, size_t> sizes;
  for (const auto& [id, keyframe] : map.keyframes()) ++sizes[keyframe.map_id];
  return sizes;
}

std::string Hex(uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

/// Whatever ends this, no file of that name stays.
struct Removal {
  std::string path;
  explicit Removal(std::string what) : path(std::move(what)) {}
  ~Removal() { std::remove(path.c_str()); }
  Removal(const Removal&) = delete;
  Removal& operator=(const Removal&) = delete;
};

[[noreturn]] void RefuseVersion(const LogIndex& log, const std::string& its, const std::string& ours) {
  throw InputError(log.path() + ": was written with " + its + ", this program speaks " + ours +
                   ": load it with the program that wrote it, or make the map again with this one");
}

[[noreturn]] void RefuseDamaged(const LogIndex& log, const std::string& what) {
  throw InputError(log.path() + ": is damaged: " + what + "; copy or save it again");
}

/// A saved map stands for itself, and is whole and of this version or refused. `start`: its session.
void CheckSaved(const LogIndex& log, const RecordedSession& session,
                const std::optional<SessionStart>& start) {
  std::optional<int32_t> protocol = log.other_protocol();
  if (!protocol && start && start->protocol_version != kProtocolVersion) protocol = start->protocol_version;
  if (protocol) RefuseVersion(log, "protocol " + std::to_string(*protocol), std::to_string(kProtocolVersion));
  if (!session.saved)
    RefuseDamaged(log,
                  "its first message, which says how many records it has, is missing or fails its checksum");
  if (session.saved->schema_hash != wire::SchemaHash()) {
    RefuseVersion(log, "message types " + Hex(static_cast<uint64_t>(session.saved->schema_hash)),
                  Hex(static_cast<uint64_t>(wire::SchemaHash())));
  }
  const int64_t wanted = session.saved->records, here = RecordsOf(session.Stream(StreamId::kMap));
  if (here < wanted) {
    throw InputError(log.path() + ": is not whole: " + std::to_string(wanted - here) + " of the " +
                     std::to_string(wanted) +
                     " records of the saved map are missing or damaged; copy or save it again");
  }
  if (!start)
    RefuseDamaged(log,
                  "session_t, which says with which camera it was made, is missing or fails its checksum");
  if (log.bad_messages() > 0)
    RefuseDamaged(log, std::to_string(log.bad_messages()) + " messages fail their checksums");
}

}  // namespace

std::optional<SessionStart> FindSessionStart(const LogIndex& log, const RecordedSession& session) {
  for (const auto& [term, recorded] : session.Stream(StreamId::kFrontend)) {
    for (const auto& [seq, message] : recorded.records) {
      if (message.channel != channels::kSession) continue;
      if (auto start = wire::Decode<SessionStart>(log.Read(message))) return start;
    }
  }
  for (const auto& [camera, recorded] : session.cameras) {
    if (!recorded.info) continue;
    SessionStart start;
    start.session = session.id;
    start.camera = recorded.info->camera;
    start.sequence = recorded.info->sequence;
    start.mode = recorded.info->mode;
    return start;
  }
  return std::nullopt;
}

SessionStart MadeWith(const LogIndex& log, const RecordedSession& session) {
  const std::optional<SessionStart> start = FindSessionStart(log, session);
  if (session.IsSavedMap()) CheckSaved(log, session, start);
  if (session.Stream(StreamId::kMap).empty()) {
    throw InputError(log.path() + ": holds no map record of session " + std::to_string(session.id) +
                     "; was the mapper recorded too?");
  }
  if (!start) {
    throw InputError(log.path() +
                     ": does not say which camera the map was made with; record the frontend or the player "
                     "too, or save the map with `scripts/run.sh --save-map`");
  }
  return *start;
}

SessionStart MadeWith(const std::string& path) {
  const LogIndex log(path);
  return MadeWith(log, log.Session());
}

SessionRuns RunsOf(const RecordedSession& session, const SessionStart& made, const Map& map) {
  if (!session.runs.empty()) return session.runs;
  const bool told = made.configuration_hash != 0;  // else by nobody but a player
  const bool its_own = !session.IsSavedMap() || SessionsOf(map) == std::set{made.session};
  return told && its_own ? SessionRuns{{made.session, made}} : SessionRuns();
}

ChangesRead ForEachChange(const LogIndex& log, const RecordedSession& session, int64_t until_us,
                          const ChangeReader& reader) {
  const Replay replay = PlanReplay(session.Stream(StreamId::kMap), until_us);
  if (replay.steps.empty()) {
    throw InputError(log.path() + ": holds no map record of session " + std::to_string(session.id) +
                     (until_us == INT64_MAX ? "; was the mapper recorded too?" : " up to that time"));
  }
  ChangesRead read{0, replay.missing};
  wire::RecordGroups<MapDelta> groups;
  std::string first_fault;
  Term writer = replay.steps.front().term;
  for (const ReplayStep& step : replay.steps) {
    if (step.begins_anew) {
      if (reader.begins_anew) reader.begins_anew();
      groups.Clear();
    }
    if (std::exchange(writer, step.term) != step.term && reader.new_writer) reader.new_writer();
    std::string reason;
    std::optional<MapDelta> delta = wire::Decode<MapDelta>(log.Read(*step.message), &reason);
    if (delta) {
      ++read.records;
      delta = groups.Add(std::move(*delta), step.term);
      if (!groups.fault().empty() || !groups.abandoned().empty()) ++read.missing;
    } else {
      ++read.missing;
      if (first_fault.empty()) first_fault = reason;
    }
    if (delta) reader.change(*delta);
  }
  if (groups.open()) ++read.missing;
  if (session.IsSavedMap() && read.missing > 0)
    RefuseDamaged(log, std::to_string(read.missing) + " records of the saved map cannot be decoded" +
                           (first_fault.empty() ? "" : " (" + first_fault + ")"));
  return read;
}

RebuiltMap RebuildMap(const LogIndex& log, const RecordedSession& session, int64_t until_us,
                      std::shared_ptr<FeatureStore> features) {
  const SessionStart start = MadeWith(log, session);
  RebuiltMap rebuilt{Replica(start.camera, start.pyramid), start};
  rebuilt.map.KeepFeaturesIn(std::move(features));
  ChangeReader reader;
  reader.begins_anew = [&] { rebuilt.map.Clear(); };
  reader.change = [&](const MapDelta& delta) {
    rebuilt.map.Apply(delta);
    rebuilt.ended = delta.event == MapEvent::kEnded;
  };
  const ChangesRead read = ForEachChange(log, session, until_us, reader);
  rebuilt.records = read.records;
  rebuilt.missing = read.missing;
  rebuilt.skipped = rebuilt.map.skipped_references();
  rebuilt.runs = RunsOf(session, start, rebuilt.map);
  return rebuilt;
}

CutMap Cut(const std::string& path, const Map& map) {
  if (map.keyframes().empty()) throw InputError(path + ": is not written: the map is empty");
  const Keyframe& newest = map.keyframes().rbegin()->second;
  return {CutSnapshot(map, newest.id, kSnapshotPieceBytes), SessionsOf(map), newest.stamp_ns};
}

void SaveMap(const std::string& path, const Map& map, const SessionStart& session) {
  SaveMap(path, map, session, {{session.session, session}});
}

void SaveMap(const std::string& path, const Map& map, const SessionStart& session, const SessionRuns& runs) {
  SaveMap(path, Cut(path, map), session, runs);
}

void SaveMap(const std::string& path, const CutMap& map, const SessionStart& session,
             const SessionRuns& runs) {
  CheckFolderOf(path);
  const int64_t utime_us = map.stamp_ns / 1000;
  const std::string partial = path + ".part";
  EventLogWriter log(partial);
  const Removal of_what_is_not_complete{partial};
  WriteLogVersion(&log, "", utime_us, {session.session, static_cast<int64_t>(map.pieces.size())});
  SessionStart start = session;  // of this program, whoever wrote the one it goes on from
  start.protocol_version = kProtocolVersion;
  start.software = kVersion;
  WriteRecord(&log, utime_us, HeaderOf(session.session, StreamId::kFrontend, 1), start);
  if (map.sessions != std::set{session.session}) {  // else it is of that one run
    for (const auto& [id, run] : runs)
      WriteRecord(&log, utime_us, HeaderOf(session.session, StreamId::kFrontend, 1), run, kLogRunChannel);
  }
  int64_t seq = 0;
  for (const MapDelta& delta : map.pieces)
    WriteRecord(&log, utime_us, HeaderOf(session.session, StreamId::kMap, ++seq), delta);
  log.Close();
  if (!RenameDurably(partial, path)) throw InputError(path + ": cannot be written; check the path");
}

RebuiltMap LoadMap(const std::string& path, const std::optional<BusKey>& key,
                   std::shared_ptr<FeatureStore> features) {
  const LogIndex log(path, key);
  RebuiltMap map = RebuildMap(log, log.Session(), INT64_MAX, std::move(features));
  if (map.map.keyframes().empty()) throw InputError(path + ": holds a map without keyframes");
  return map;
}

void CheckFits(const std::string& path, const SessionStart& made, const Camera& camera,
               const Pyramid& pyramid) {
  if (const auto differ = FirstDifference(made.camera, camera)) {
    throw InputError(path + ": was made with " + differ->a + ", the camera that plays has " + differ->b +
                     ": give the camera file of that map");
  }
  const Pyramid& its = made.pyramid;
  if (its.levels != pyramid.levels || its.scale_factor != pyramid.scale_factor) {
    throw InputError(path + ": was made with features.levels=" + std::to_string(its.levels) +
                     " and features.scale_factor=" + std::to_string(its.scale_factor) + "; set the same");
  }
}

std::string WhyOtherVocabulary(const std::string& path, const SessionStart& made,
                               std::optional<uint64_t> checksum) {
  if (!made.vocabulary_checksum || !checksum || *made.vocabulary_checksum == *checksum) return "";
  return path + ": was made with another vocabulary (checksum " + Hex(*made.vocabulary_checksum) +
         ") than the one in use (" + Hex(*checksum) + "); give its own with --vocabulary";
}

void CheckVocabulary(const std::string& path, const SessionStart& made, std::optional<uint64_t> checksum) {
  const std::string why = WhyOtherVocabulary(path, made, checksum);
  if (!why.empty()) throw MisfitError(why);
}

void CheckSessionIsNew(const std::string& path, const Map& map, uint32_t session) {
  if (session > NewestSession(map)) return;
  throw InputError(path + ": holds keyframes of session " + std::to_string(NewestSession(map)) +
                   "; give all processes a higher one with --session");
}

uint32_t NewestSession(const Map& map) {
  uint32_t newest = 0;
  for (const auto& [id, keyframe] : map.keyframes()) newest = std::max(newest, id.session());
  for (const auto& [id, tombstone] : map.keyframe_tombstones()) newest = std::max(newest, id.session());
  return newest;
}

uint16_t NewestOrdinal(const Map& map) {
  uint16_t newest = 0;
  for (const LandmarkId id : map.LandmarkIdsSorted()) newest = std::max(newest, id.epoch_ordinal());
  for (const auto& [id, by] : map.landmark_tombstones()) newest = std::max(newest, id.epoch_ordinal());
  return newest;
}

std::optional<MapId> LargestMap(const Map& map) {
  std::optional<MapId> largest;
  size_t most = 0;
  for (const auto& [id, size] : KeyframesOfMaps(map)) {
    if (size > most) largest = id, most = size;
  }
  return largest;
}

}  // namespace dmslam
