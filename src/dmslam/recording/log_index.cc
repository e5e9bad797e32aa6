#include "dmslam/recording/log_index.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/receive_window.h"
#include "dmslam/recording/log_version.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/former_types.h"

namespace dmslam {
namespace {

bool EndsWith(const std::string& text, std::string_view end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// The type of the records that travel on a channel; none when no records do.
template <typename... Message>
std::optional<wire::MessageInfo> RecordOf(const std::string& channel, const std::tuple<Message...>*) {
  std::optional<wire::MessageInfo> record;
  const auto look = [&](const wire::MessageInfo& info) {
    if (info.is_record && channel == info.channel) record = info;
  };
  (look(wire::Info<Message>()), ...);
  return record;
}

std::optional<wire::MessageInfo> RecordOf(const std::string& channel) {
  return RecordOf(SplitCamera(channel).channel, static_cast<const wire::Messages*>(nullptr));
}

bool IsRecordChannel(const std::string& channel) { return RecordOf(channel).has_value(); }

constexpr ReceiveWindow::Limits kNoLimits{INT64_MAX / 4, SIZE_MAX / 4, 64u << 20};

}  // namespace

const RecordedStream& RecordedSession::Stream(StreamId stream) const {
  static const RecordedStream kNone;
  const auto it = streams.find(stream);
  return it == streams.end() ? kNone : it->second;
}

bool RecordedSession::IsSavedMap() const {
  return saved || Stream(StreamId::kMap).contains(kSavedTerm) ||
         Stream(StreamId::kFrontend).contains(kSavedTerm);
}

std::vector<CameraId> RecordedSession::CamerasWithFrames() const {
  std::vector<CameraId> found;
  for (const auto& [camera, recorded] : cameras) {
    if (!recorded.frames.empty()) found.push_back(camera);
  }
  return found;
}

std::vector<CameraId> RecordedSession::CamerasWithFrontend() const {
  std::vector<CameraId> found;
  for (CameraId camera = 0; camera < kMaxCameras; ++camera) {
    if (streams.contains(StreamOfCamera(StreamId::kFrontend, camera))) found.push_back(camera);
  }
  return found;
}

/// Records in pieces, by the key of their numbering.
struct LogIndex::Parts {
  std::map<int32_t, ReceiveWindow> windows;
};

LogIndex::LogIndex(const std::string& path, const std::optional<BusKey>& key) : reader_(path) {
  unverified_ = key && !reader_.UseKey(*key);
  Parts parts;
  while (const std::optional<LogEvent> event = reader_.Next()) {
    if (num_messages_++ == 0) begin_us_ = event->utime_us;
    end_us_ = std::max(end_us_, event->utime_us);
    Add(*event, &parts);
  }
  if (sessions_.empty() && !of_protocol_.empty()) {
    throw InputError(path + ": " + wire::ToldOfFormer(of_protocol_.rbegin()->first));
  }
  if (sessions_.empty()) {
    throw InputError(path + ": holds no message of this system; record a run with `scripts/run.sh --record`");
  }
}

std::optional<int32_t> LogIndex::other_protocol() const {
  return of_protocol_.empty() ? std::nullopt : std::optional(of_protocol_.rbegin()->first);
}

template <typename Message>
std::optional<Message> LogIndex::Decode(std::span<const uint8_t> bytes) {
  std::optional<Message> message = wire::Decode<Message>(bytes);
  if (!message) {
    ++bad_messages_;
  } else {
    sessions_[message->session].id = message->session;
  }
  return message;
}

void LogIndex::Add(const LogEvent& event, Parts* parts) {
  if (const std::optional<int32_t> protocol = OtherProtocol(event)) {
    ++of_protocol_[*protocol];
    return;
  }
  if (const std::optional<LogContent> content = ReadLogContent(event)) {
    sessions_[content->session].id = content->session;
    sessions_[content->session].saved = content;
  }
  RecordedMessage message;
  message.utime_us = event.utime_us;
  message.order = num_messages_;
  message.offset = event.offset;
  message.channel = WithoutPrefix(event.channel);
  if (message.channel == kLogRunChannel) return AddRun(event);
  if (AddOfPlayer(event, message)) return;
  if (IsRecordChannel(message.channel)) {
    AddRecord(std::move(message), event.bytes);
  } else if (EndsWith(message.channel, "_PART")) {
    AddPart(event, std::move(message), parts);
  }
}

template <typename Message>
RecordedCamera& LogIndex::CameraOf(const Message& message) {
  return sessions_[message.session].cameras[message.camera_id];
}

/// Whether it is a message of a camera's player, and not a record.
bool LogIndex::AddOfPlayer(const LogEvent& event, const RecordedMessage& message) {
  const std::string of_any_camera = SplitCamera(message.channel).channel;
  const std::string_view channel = of_any_camera;
  if (channel == channels::kFrame) {
    AddFrame(event, message);
  } else if (channel == channels::kCameraInfo) {
    const auto info = Decode<CameraInfo>(event.bytes);
    if (info && !CameraOf(*info).info) CameraOf(*info).info = info;
  } else if (channel == channels::kGroundTruthPose) {
    if (const auto pose = Decode<GroundTruthPose>(event.bytes))
      CameraOf(*pose).ground_truth.emplace(pose->stamp_ns, *pose);
  } else if (channel == channels::kEndOfSequence) {
    if (const auto end = Decode<EndOfSequence>(event.bytes)) CameraOf(*end).end = end;
  } else {
    return false;
  }
  return true;
}

void LogIndex::AddFrame(const LogEvent& event, RecordedMessage message) {
  const auto frame = Decode<Frame>(event.bytes);
  if (!frame) return;
  RecordedCamera& camera = CameraOf(*frame);
  camera.frames.emplace(frame->frame_index, std::move(message));
  camera.stamps_ns.emplace(frame->frame_index, frame->stamp_ns);
}

void LogIndex::AddRun(const LogEvent& event) {
  const std::optional<RecordHeader> header = ParseHeader(event.bytes);
  const auto run = wire::Decode<SessionStart>(event.bytes);
  const bool sound = header && run && header->session > 0 && header->session <= UINT32_MAX &&
                     IsIntact(kLogRunChannel, event.bytes);
  if (!sound) {
    ++bad_messages_;
    return;
  }
  RecordedSession& session = sessions_[static_cast<uint32_t>(header->session)];
  session.id = static_cast<uint32_t>(header->session);
  session.runs.emplace(run->session, *run);
}

void LogIndex::AddRecord(RecordedMessage message, std::span<const uint8_t> bytes) {
  const std::optional<RecordHeader> header = ParseHeader(bytes);
  const bool sound = header && header->session > 0 && header->session <= UINT32_MAX && header->seq > 0 &&
                     header->seq < kMaxSeq && header->epoch > 0 &&
                     FingerprintOf(bytes) == RecordOf(message.channel)->fingerprint &&
                     IsIntact(message.channel, bytes);
  if (!sound) {
    ++bad_messages_;
    return;
  }
  message.header = *header;
  const auto id = static_cast<uint32_t>(header->session);
  sessions_[id].id = id;
  RecordedTerm& term =
      sessions_[id].streams[static_cast<StreamId>(header->stream)][{header->epoch, header->writer}];
  if ((header->flags & RecordHeader::FLAG_SNAPSHOT) != 0) {
    RecordedTerm::Snapshot& snapshot = term.snapshots[header->parent_epoch];
    snapshot.cut = header->parent_seq;
    if ((header->flags & RecordHeader::FLAG_SNAPSHOT_LAST) != 0) snapshot.last = header->seq;
    snapshot.pieces.emplace(header->seq, std::move(message));
    return;
  }
  term.fresh = (header->flags & RecordHeader::FLAG_FRESH) != 0;
  term.parent = {header->parent_epoch, header->parent_seq};
  term.records.emplace(header->seq, std::move(message));
}

void LogIndex::AddPart(const LogEvent& event, RecordedMessage message, Parts* parts) {
  const std::optional<part_t> part = DecodePart(event.bytes);
  if (!part) {
    ++bad_messages_;
    return;
  }
  auto window = parts->windows.try_emplace(part->stream_key, kNoLimits).first;
  ReceiveWindow::PartResult result = window->second.AddPart(*part);
  if (!result.whole || !IsRecordChannel(result.whole->first)) return;
  message.channel = result.whole->first;
  message.offset.reset();
  message.bytes = std::make_shared<const Bytes>(std::move(result.whole->second));
  const SharedBytes bytes = message.bytes;
  if (const std::optional<int32_t> protocol = wire::FormerProtocol(FingerprintOf(*bytes).value_or(0))) {
    ++of_protocol_[*protocol];
    return;
  }
  AddRecord(std::move(message), *bytes);
}

const RecordedSession& LogIndex::Session(uint32_t id) const {
  const auto it = id == 0 ? sessions_.begin() : sessions_.find(id);
  if (it != sessions_.end() && (id != 0 || sessions_.size() == 1)) return it->second;
  std::string ids;
  for (const auto& [session, content] : sessions_) ids += (ids.empty() ? "" : ", ") + std::to_string(session);
  if (id != 0) throw InputError(path() + ": holds no session " + std::to_string(id) + " but " + ids);
  const bool of_saved_maps = !sessions_.empty() && std::ranges::all_of(sessions_, [](const auto& session) {
    return session.second.IsSavedMap();
  });
  if (!of_saved_maps)
    throw InputError(path() + ": holds several sessions (" + ids + "); choose one with --log-session");
  throw InputError(path() + ": is several saved maps in one file (of the sessions " + ids +
                   "); give each by itself: dmslam-map --map " + path() +
                   " --log-session SESSION --save FILE takes one out");
}

Bytes LogIndex::Read(const RecordedMessage& message) const {
  if (message.bytes) return *message.bytes;
  reader_.Seek(message.offset.value());
  std::optional<LogEvent> event = reader_.Next();
  if (!event || event->offset != *message.offset) {
    throw InputError(path() + ": has changed while it was read; wait until its writer has finished");
  }
  return std::move(event->bytes);
}

std::string LogIndex::DescribeDamage() const {
  std::string text = reader_.DescribeGaps();
  const auto add = [&](const std::string& more) { text += (text.empty() ? path() + ": " : "; ") + more; };
  if (unverified_) add(kNothingIsVerified);
  if (reader_.refused() > 0)
    add(std::to_string(reader_.refused()) + " messages have no tag that fits the key and were left out");
  if (bad_messages_ > 0) add(std::to_string(bad_messages_) + " messages hold wrong bytes and were left out");
  for (const auto& [protocol, count] : of_protocol_) {
    add(std::to_string(count) + " messages are of " + NameOfProtocol(protocol) + " and were left out");
  }
  return text;
}

namespace {

/// Records 1..last of a term up to which a reader would go, and what is missing of them.
struct Extent {
  int64_t last = 0;
  int64_t last_missing = 0;  ///< 0: none
  int64_t num_missing = 0;
};

Extent ExtentOf(const RecordedTerm& term, int64_t last_seq, int64_t until_us) {
  Extent extent;
  for (const auto& [seq, message] : term.records) {
    if (seq > last_seq || message.utime_us > until_us) continue;
    if (seq > extent.last + 1) {
      extent.num_missing += seq - extent.last - 1;
      extent.last_missing = seq - 1;
    }
    extent.last = seq;
  }
  if (last_seq != INT64_MAX && extent.last < last_seq) {  // its successor had them
    extent.num_missing += last_seq - extent.last;
    extent.last_missing = last_seq;
  }
  return extent;
}

void AppendTerm(const Term& of, const RecordedTerm& term, int64_t last_seq, int64_t until_us,
                Replay* replay) {
  const Extent extent = ExtentOf(term, last_seq, until_us);
  int64_t after = 0;
  const RecordedTerm::Snapshot* bridge = nullptr;
  for (const auto& [number, snapshot] : term.snapshots) {
    const bool helps = extent.num_missing > 0 || (extent.last == 0 && !term.fresh);
    const bool in_time = snapshot.whole() && snapshot.pieces.rbegin()->second.utime_us <= until_us;
    if (helps && in_time && snapshot.cut >= extent.last_missing) bridge = &snapshot;
  }
  if (bridge != nullptr) {
    *replay = Replay();
    for (const auto& [number, piece] : bridge->pieces) replay->steps.push_back({&piece, number == 1, of});
    after = bridge->cut;
  } else {
    replay->missing += extent.num_missing;
    if (term.fresh) *replay = Replay{{}, extent.num_missing};
  }
  bool first = bridge == nullptr && term.fresh;
  for (const auto& [seq, message] : term.records) {
    if (seq <= after || seq > extent.last || message.utime_us > until_us) continue;
    replay->steps.push_back({&message, std::exchange(first, false), of});
  }
}

}  // namespace

Replay PlanReplay(const RecordedStream& stream, int64_t until_us) {
  // From the last term back through what each continues; a term counts up to where its successor took it
  // over.
  struct Office {
    Term term;
    const RecordedTerm* recorded = nullptr;
    int64_t last_seq = 0;
  };
  std::vector<Office> chain;
  int64_t last_seq = INT64_MAX;
  Version wanted{INT64_MAX, 0};
  for (auto it = stream.rbegin(); it != stream.rend(); ++it) {
    const auto& [term, recorded] = *it;
    const bool begun = std::any_of(recorded.records.begin(), recorded.records.end(),
                                   [&](const auto& item) { return item.second.utime_us <= until_us; }) ||
                       !recorded.snapshots.empty();
    if (!begun || term.epoch > wanted.epoch) continue;
    chain.push_back({term, &recorded, last_seq});
    if (recorded.fresh || recorded.parent.empty()) break;
    wanted = recorded.parent;
    last_seq = recorded.parent.seq;
  }
  Replay replay;
  for (auto link = chain.rbegin(); link != chain.rend(); ++link)
    AppendTerm(link->term, *link->recorded, link->last_seq, until_us, &replay);
  return replay;
}

}  // namespace dmslam
