#include "dmslam/recording/map_file.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

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
void WriteRecord(EventLogWriter* log, int64_t utime_us, RecordHeader header, const Message& message) {
  const char* channel = wire::Info<Message>().channel;
  Bytes bytes = wire::Encode(message);
  Seal(header, channel, bytes);
  log->Write(utime_us, channel, bytes);
}

RecordHeader HeaderOf(uint32_t session, StreamId stream, int64_t seq) {
  RecordHeader header{};
  header.session = session;
  header.stream = static_cast<int32_t>(stream);
  header.flags = RecordHeader::FLAG_FRESH;
  header.epoch = 1;
  header.writer = 1;
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

RebuiltMap RebuildMap(const LogIndex& log, const RecordedSession& session, int64_t until_us,
                      std::shared_ptr<FeatureStore> features) {
  const Replay replay = PlanReplay(session.Stream(StreamId::kMap), until_us);
  const std::optional<SessionStart> start = FindSessionStart(log, session);
  const int64_t here = RecordsOf(session.Stream(StreamId::kMap));
  if (const auto saved = session.saved_records; saved && here < *saved) {
    throw InputError(log.path() + ": is not whole: " + std::to_string(*saved - here) + " of the " +
                     std::to_string(*saved) +
                     " records of the saved map are missing or damaged; copy or save it again");
  }
  if (replay.steps.empty()) {
    throw InputError(log.path() + ": holds no map record of session " + std::to_string(session.id) +
                     (until_us == INT64_MAX ? "; was the mapper recorded too?" : " up to that time"));
  }
  if (!start) throw InputError(log.path() + ": does not say which camera the map was made with");
  RebuiltMap rebuilt{Replica(start->camera, start->pyramid), *start};
  rebuilt.map.KeepFeaturesIn(std::move(features));
  rebuilt.missing = replay.missing;
  wire::RecordGroups<MapDelta> groups;
  for (const ReplayStep& step : replay.steps) {
    if (step.begins_anew) {
      rebuilt.map.Clear();
      groups.Clear();
    }
    std::optional<MapDelta> delta = wire::Decode<MapDelta>(log.Read(*step.message));
    if (delta) {
      ++rebuilt.records;
      delta = groups.Add(std::move(*delta), step.term);
      if (!groups.fault().empty() || !groups.abandoned().empty()) ++rebuilt.missing;
    } else {
      ++rebuilt.missing;
    }
    if (!delta) continue;
    rebuilt.map.Apply(*delta);
    rebuilt.ended = delta->event == MapEvent::kEnded;
  }
  if (groups.open()) ++rebuilt.missing;
  rebuilt.skipped = rebuilt.map.skipped_references();
  return rebuilt;
}

CutMap Cut(const std::string& path, const Map& map) {
  if (map.keyframes().empty()) throw InputError(path + ": is not written: the map is empty");
  const Keyframe& newest = map.keyframes().rbegin()->second;
  return {CutSnapshot(map, newest.id, kSnapshotPieceBytes), newest.stamp_ns};
}

void SaveMap(const std::string& path, const Map& map, const SessionStart& session) {
  SaveMap(path, Cut(path, map), session);
}

void SaveMap(const std::string& path, const CutMap& map, const SessionStart& session) {
  const int64_t utime_us = map.stamp_ns / 1000;
  const std::string partial = path + ".part";
  EventLogWriter log(partial);
  WriteLogVersion(&log, "", utime_us, {session.session, static_cast<int64_t>(map.pieces.size())});
  SessionStart start = session;  // of this program, whoever wrote the one it goes on from
  start.protocol_version = kProtocolVersion;
  start.software = kVersion;
  WriteRecord(&log, utime_us, HeaderOf(session.session, StreamId::kFrontend, 1), start);
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

void CheckFits(const std::string& path, const RebuiltMap& map, const Camera& camera, const Pyramid& pyramid) {
  if (!map.map.camera().SeesAs(camera)) {
    throw InputError(path +
                     ": was made with another camera than the one that plays; give the same camera file");
  }
  const Pyramid& its = map.map.pyramid();
  if (its.levels != pyramid.levels || its.scale_factor != pyramid.scale_factor) {
    throw InputError(path + ": was made with features.levels=" + std::to_string(its.levels) +
                     " and features.scale_factor=" + std::to_string(its.scale_factor) + "; set the same");
  }
}

std::string WhyOtherVocabulary(const std::string& path, const SessionStart& made,
                               std::optional<uint64_t> checksum) {
  if (!made.vocabulary_checksum || !checksum || *made.vocabulary_checksum == *checksum) return "";
  std::array<char, 160> text{};
  std::snprintf(
      text.data(), text.size(),
      ": was made with another vocabulary (checksum %016llx) than the one in use (%016llx); give its "
      "own with --vocabulary",
      static_cast<unsigned long long>(*made.vocabulary_checksum), static_cast<unsigned long long>(*checksum));
  return path + text.data();
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
