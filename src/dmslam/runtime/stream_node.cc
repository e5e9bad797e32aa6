#include "dmslam/runtime/stream_node.h"

#include <unistd.h>

#include <algorithm>
#include <tuple>

#include "dmslam/console/log.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/runtime/session_check.h"
#include "dmslam/util/random.h"
#include "dmslam/wire/streams.h"

namespace dmslam {
namespace {

constexpr int64_t kMisfitNs = 2'000'000'000;

template <typename... Message>
int64_t HashOf(const std::tuple<Message...>*) {
  uint64_t hash = 0;
  ((hash = Mix64(hash ^ static_cast<uint64_t>(wire::Info<Message>().fingerprint))), ...);
  return static_cast<int64_t>(hash);
}

}  // namespace

bool NodeOptions::HasPeer(std::string_view name) const {
  return std::find(peers.begin(), peers.end(), name) != peers.end();
}

CameraId NodeOptions::NumCameras() const {
  CameraId count = 1;
  for (CameraId camera = 1; camera < kMaxCameras; ++camera) {
    if (HasPeer(OfCamera(roles::kFrontend, camera))) count = camera + 1;
  }
  return count;
}

int64_t SchemaHash() { return HashOf(static_cast<const wire::Messages*>(nullptr)); }

StreamNode::StreamNode(NodeContext context, NodeOptions options, std::string role)
    : context_(std::move(context)),
      options_(std::move(options)),
      feature_store_(std::make_shared<FeatureStore>(options_.settings.Read<FeatureStoreOptions>())),
      role_(std::move(role)),
      endpoint_(context_.bus, context_.now_ns),
      session_(options_.session),
      cameras_(context_.random_id % kStatusEveryNs),
      started_ns_(context_.now_ns()) {
  if (options_.session == 0 && !options_.of_a_log && !context_.fresh_system) {
    choice_.emplace(started_ns_ + SessionChoice::kListenNs);
    Listen(SessionChoice::Channels(options_.NumCameras()), 0);
  }
  Listen({channels::kCameraInfo});
  for (CameraId camera = 0; camera < kMaxCameras; ++camera) {
    if (camera != options_.camera_id) Listen({channels::kCameraInfo}, camera);
  }
}

/// Whether it is one camera's, as a frontend is.
bool StreamNode::IsOfCamera() const { return role_ == OfCamera(roles::kFrontend, options_.camera_id); }

void StreamNode::OnMessage(const std::string&, std::span<const uint8_t>) {}

void StreamNode::Listen(const std::vector<std::string>& channels) { Listen(channels, options_.camera_id); }

void StreamNode::Listen(const std::vector<std::string>& channels, CameraId camera) {
  for (const std::string& channel : channels) traffic_.Listen(ChannelOfCamera(channel, camera));
  endpoint_.SetOtherHandler(
      traffic_.channels(),
      [this](const std::string& channel, std::span<const uint8_t> bytes) { Receive(channel, bytes); });
}

void StreamNode::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  if (choice_ && SessionChoice::IsOne(channel)) {
    if (session_ == 0) choice_->HearBeacon(channel, bytes);
    return;
  }
  traffic_.OnReceived(bytes.size());
  if (!traffic_.IsListenedTo(channel)) return;
  const CameraChannel of_camera = SplitCamera(channel);
  if (of_camera.channel == channels::kCameraInfo) {
    OnCameraInfo(of_camera.camera, bytes);
  } else {
    OnMessage(of_camera.channel, bytes);
  }
}

void StreamNode::OnCameraInfo(CameraId camera, std::span<const uint8_t> bytes) {
  std::optional<CameraInfo> info = Read<CameraInfo>(bytes);
  if (!info) return;
  info->camera_id = camera;
  if (choice_ && session_ == 0) choice_->HearCamera(info->session, info->sequence, info->utime);
  if (camera >= options_.NumCameras() && camera != options_.camera_id) return OnSurplusCamera(*info);
  if (IsOfCamera() && camera != options_.camera_id) {
    if (camera_info_ && info->session == session_) OnOtherCamera(*info);
    return;
  }
  if (!cameras_.Knows(camera)) {
    if (!MayBeOurs(info->session)) return;
    if (options_.of_a_log || cameras_.SaidAgain(*info, context_.now_ns())) BelieveCamera(*info);
  } else if (!IsForeignFrame(info->session)) {
    cameras_.Heard(*info, context_.now_ns());
    KeepCameraKnown();
  }
}

/// What is said of a session that is not known yet, or of a recorded one that is to be taken for ours.
bool StreamNode::MayBeOurs(uint32_t session) {
  if (session_ == 0) return MayChooseSession();
  return (options_.accept_recorded && !recorded_session_) || !IsForeignFrame(session);
}

/// Who was not told its session takes that of the bus, and does not guess where there are several.
bool StreamNode::MayChooseSession() {
  if (!choice_) return true;
  if (!choice_->MayChoose(context_.now_ns())) return false;
  const std::string problem = choice_->Problem();
  if (!problem.empty()) Exit(kExitMisfit, problem);
  return problem.empty();
}

void StreamNode::ConfirmCamera(uint32_t session) {
  const std::optional<CameraInfo> info = cameras_.ClaimOfFrame(options_.camera_id, session);
  if (info && MayBeOurs(session)) BelieveCamera(*info);
}

void StreamNode::BelieveCamera(CameraInfo info) {
  if (session_ == 0) {
    session_ = info.session;
    LogInfo("{}: takes session {}", role_, session_);
  }
  if (options_.accept_recorded && !recorded_session_ && info.session != session_) {
    recorded_session_ = info.session;
    LogInfo("{}: takes the frames of recorded session {} for its own {}", role_, info.session, session_);
  }
  cameras_.Believe(info, !recorded_session_, context_.now_ns());
  if (recorded_session_) info.mode = PlaybackMode::kRealtime;  // who replays a log waits for nobody
  if (!camera_info_) camera_info_ = info;
  OnCamera(info);
}

void StreamNode::KnowCamera(const CameraInfo& info) {
  if (camera_info_) return;
  session_ = info.session;
  camera_info_ = info;
  OnCamera(info);
}

/// More cameras play than this process was told of, so it hears nothing else of this one.
void StreamNode::OnSurplusCamera(const CameraInfo& info) {
  const bool counts = options_.HasPeer(roles::kFrontend) || role_ == roles::kViewer;
  const bool ours = session_ != 0 && info.session == session_;
  if (!counts || !ours || !cameras_.not_heard().empty() || !cameras_.SaidAgain(info, context_.now_ns()))
    return;
  const CameraId told = options_.NumCameras();
  cameras_.NoteNotHeard(
      "camera " + std::to_string(info.camera_id) + " plays in session " + std::to_string(session_) +
      ", but this process was told of " + std::to_string(told) + (told == 1 ? " camera" : " cameras") +
      " and hears nothing of it: give every process --cameras " + std::to_string(info.camera_id + 1));
  LogWarning("{}: {}", role_, cameras_.not_heard());
}

/// A process that starts after the player has left still learns the camera, from those who write: one of them
/// repeats what the player said.
void StreamNode::KeepCameraKnown() {
  if (!plan_) return;
  for (const CameraInfo& info : cameras_.TakeSilent(context_.now_ns()))
    context_.bus->Publish({ChannelOfCamera(channels::kCameraInfo, info.camera_id),
                           std::make_shared<const Bytes>(wire::Encode(info)), false});
}

bool StreamNode::IsForeignFrame(uint32_t session) {
  return recorded_session_ ? session != *recorded_session_ && IsForeign(session) : IsForeign(session);
}

bool StreamNode::IsForeign(uint32_t session) {
  if (session == session_) return false;
  if (session_ == 0) return true;  // nothing is ours yet, and nothing foreign either
  if (traffic_.DropForeign())
    LogWarning("{}: dropped a message of session {}; ours is {}", role_, session, session_);
  return true;
}

void StreamNode::CountMalformed(const std::string& channel, const std::string& reason) {
  if (!traffic_.DropMalformed(channel)) return;
  LogWarning("{}: dropped a bad message on {}: {} (further ones are only counted)", role_, channel, reason);
}

std::optional<MapDelta> StreamNode::ReadMapRecord(const Record& record, StreamReader* reader) {
  MapRecords::Outcome read = map_records_.Read(record, reader, context_.now_ns());
  for (const std::string& complaint : read.complaints) CountMalformed(record.channel, complaint);
  return std::move(read.change);
}

/// What is too large for a record is a mistake of who made it; the others are spared it.
int64_t StreamNode::PublishBytes(const std::string& channel, Bytes bytes) {
  if (bytes.size() > wire::kMaxRecordBytes) {
    WarnOnce("too large " + channel, "refused to publish a record of " + std::to_string(bytes.size()) +
                                         " bytes on " + channel + "; at most " +
                                         std::to_string(wire::kMaxRecordBytes) + " are allowed");
    return writer_->last_seq();
  }
  return writer_->Publish(ChannelOfCamera(channel, options_.camera_id), std::move(bytes), context_.now_ns());
}

std::unique_ptr<StreamReader> StreamNode::MakeReader(StreamId stream, std::optional<Version> start,
                                                     CameraId camera, bool wants_all) {
  const StreamPlan& plan = PlanOf(stream);
  StreamReader::Options options;
  options.session = session_;
  options.stream = StreamOfCamera(stream, camera);
  options.owner = OwnerName(OfCamera(plan.writer, camera));
  options.reader = OwnerName(role_);
  options.role = role_;
  options.name = context_.name;
  options.id = context_.random_id;
  options.schema_hash = SchemaHash();
  options.clock_offset_us = ClockOffsetUs(context_);
  options.start = start;
  options.wants_all = wants_all;
  auto reader = std::make_unique<StreamReader>(options);
  std::vector<std::string> records_of_camera;
  records_of_camera.reserve(plan.records.size());
  for (const std::string& channel : plan.records)
    records_of_camera.push_back(ChannelOfCamera(channel, camera));
  endpoint_.AddReader(reader.get(), options.owner, records_of_camera);
  readers_.push_back({reader.get(), options.owner, {}, {}});
  return reader;
}

std::unique_ptr<CoreThread> StreamNode::MakeCoreThread(PlaybackMode mode,
                                                       const CoreThread::Options& options) {
  auto thread = MakeUnwatchedThread(mode, options);
  core_threads_.push_back(thread.get());
  return thread;
}

bool StreamNode::Hangs(int64_t now_ns, int64_t longest_ns) const {
  return std::ranges::any_of(core_threads_,
                             [&](const CoreThread* thread) { return thread->Hangs(now_ns, longest_ns); });
}

std::unique_ptr<CoreThread> StreamNode::MakeUnwatchedThread(PlaybackMode mode,
                                                            const CoreThread::Options& options) {
  const bool own = mode == PlaybackMode::kRealtime && context_.watch;
  auto thread =
      std::make_unique<CoreThread>(own ? CoreThread::Mode::kOwnThread : CoreThread::Mode::kAtOnce, options);
  if (own) context_.watch(thread->fd(), [to = thread.get()] { to->Deliver(); });
  return thread;
}

void StreamNode::ServeReplica(const Map* map, std::function<Version()> held, std::function<bool()> may_read) {
  replica_.snapshots = std::make_unique<MapSnapshots>(map, std::move(may_read));
  ReplicaServer::Options options;
  options.holder.session = session_;
  options.holder.holder = OwnerName(role_);
  options.holder.role = role_;
  options.holder.id = context_.random_id;
  options.name = context_.name;
  options.schema_hash = SchemaHash();
  options.link = options_.link;
  replica_.server = std::make_unique<ReplicaServer>(options, std::move(held), replica_.snapshots.get());
  endpoint_.AddServer(replica_.server.get(), owners::kMapper);
}

void StreamNode::LetSnapshotBegin() {
  if (replica_.snapshots && replica_.snapshots->wanted()) endpoint_.Advance();
}

bool StreamNode::MapIsOver(const Map& map, const StreamReader& map_reader, int64_t silent_ns) const {
  if (!map.progress().ended) return false;
  return map_reader.AtEnd() || map_reader.silent_ns(context_.now_ns()) > silent_ns;
}

void StreamNode::StartElection() {
  WriterElection::Options options;
  options.session = session_;
  options.stream = StreamOfCamera(plan_->stream, options_.camera_id);
  options.owner = OwnerName(role_);
  options.name = context_.name;
  options.writer = context_.random_id;
  options.schema_hash = SchemaHash();
  options.clock_offset_us = ClockOffsetUs(context_);
  options.take_over = options_.take_over;
  if (context_.fresh_system) options.listen_ns = 0;
  const bool may_be_contested = options_.take_over && !context_.fresh_system;
  candidacy_ = std::make_unique<WriterCandidacy>(options, may_be_contested, ReaderNames(), &endpoint_,
                                                 context_.now_ns());
}

void StreamNode::RunElection() {
  if (!plan_ || writer_) return;
  if (!candidacy_) StartElection();
  if (candidacy_->writer()) return BeginWritingWhenSettled();
  if (const auto refusal = candidacy_->Refusal()) return Exit(kExitPresent, *refusal);
  if (candidacy_->IsWon() && ReadyToWrite() && !ending_) {
    candidacy_->Open(MakeWriterOptions(), plan_->parent, plan_->snapshots, context_.wall_us(),
                     context_.now_ns());
    BeginWritingWhenSettled();
  }
}

/// Of all whose acknowledgements are heard.
std::vector<std::string> StreamNode::ReaderNames() const {
  std::vector<std::string> names;
  for (const auto* roles : {&plan_->readers, &PlanOf(plan_->stream).watchers}) {
    for (const std::string& role : *roles) names.push_back(OwnerName(role));
  }
  return names;
}

StreamWriter::Options StreamNode::MakeWriterOptions() const {
  StreamWriter::Options options;
  options.session = session_;
  options.stream = StreamOfCamera(plan_->stream, options_.camera_id);
  options.owner = OwnerName(role_);
  options.name = context_.name;
  options.schema_hash = SchemaHash();
  options.clock_offset_us = ClockOffsetUs(context_);
  options.link = options_.link;
  options.part_bytes -= static_cast<int32_t>(context_.bus->overhead_bytes());
  for (const std::string& reader : plan_->readers)
    options.roles.push_back({reader, options_.HasPeer(reader)});
  return options;
}

void StreamNode::BeginWritingWhenSettled() {
  writer_ = candidacy_->TakeSettled(context_.now_ns());
  if (!writer_) return;
  candidacy_.reset();
  OnWriterOpen();
}

std::string StreamNode::AwaitedReaders() const {
  std::string awaited;
  for (const std::string& role : plan_->readers) {
    if (options_.HasPeer(role) && !writer_->AcknowledgedBy(role))
      awaited += (awaited.empty() ? "" : ", ") + role;
  }
  return awaited;
}

void StreamNode::WatchWriter() {
  const StreamWriter* writer = writer_ || !candidacy_ ? writer_.get() : candidacy_->writer();
  if (writer == nullptr) return;
  if (hands_over_until_ns_) return WatchHandOver();
  if (writer->superseded_by())
    Exit(kExitSuperseded, "another writer has taken over the stream: " + *writer->superseded_by());
  if (const std::optional<Version>& newer = writer->newer_replica()) {
    Exit(kExitNewerMap, "another process holds version " + std::to_string(newer->epoch) + ":" +
                            std::to_string(newer->seq) +
                            ", which is newer than what this one began with; start it again");
  }
  if (writer->close_requested_by() && !stopping_ && MayHandOver()) {
    LogInfo("{}: hands its stream over to {}", role_, *writer->close_requested_by());
    Stop();
    hands_over_until_ns_ = context_.now_ns() + kGoesOnWithinNs;
  }
  if (stopping_ && writer_->closed() && !ending_) Exit(kExitDone);
}

/// The stream is closed, and goes on with who asked for it. That may be nobody: then this process is to be
/// started again.
void StreamNode::WatchHandOver() {
  if (writer_->superseded_by()) return Exit(kExitDone);
  if (context_.now_ns() >= *hands_over_until_ns_)
    Exit(kExitSuperseded, NobodyWentOn(*writer_->close_requested_by()));
}

std::optional<SessionStart> StreamNode::ReadSessionStart(const RecordHeader& header,
                                                         std::span<const uint8_t> bytes) {
  if (header.seq == 1) return Read<SessionStart>(bytes);
  CountMalformed(channels::kSession, "it is not the first record of its stream");
  return std::nullopt;
}

std::string StreamNode::WhyMisfits(const SessionStart& start) const {
  return WhyMisfit(start, options_.settings);
}

void StreamNode::JoinSession(const SessionStart& start) {
  const std::string why = WhyMisfits(start);
  if (!why.empty()) Exit(kExitMisfit, why);
}

bool StreamNode::IsDoubtful(const Record& record, StreamReader* reader) {
  bool is_grave = false;
  const CameraChannel split = SplitCamera(record.channel);
  const std::string_view channel = split.channel;
  if (channel == channels::kSession) {
    const auto start = wire::Decode<SessionStart>(*record.bytes);
    is_grave = start && !WhyMisfits(*start).empty();
  } else if (channel == channels::kMapReset) {
    const auto reset = wire::Decode<MapReset>(*record.bytes);
    is_grave = reset && reset->fate == MapReset::Fate::kDrop;
  }
  return is_grave && reader->Doubt(record, context_.now_ns());
}

/// Who comes into a system that speaks other message types leaves; whoever was there before goes on with what
/// it has. Not at the first word: a damaged beacon is followed by sound ones.
void StreamNode::RefuseOtherTypes(Watched* watched) {
  const StreamReader& reader = *watched->reader;
  const bool misfit = reader.state() == StreamReader::State::kRefusedVersion && reader.held() == Version{} &&
                      reader.writer_present(context_.now_ns());
  if (!misfit) {
    watched->misfit_since_ns.reset();
  } else if (!watched->misfit_since_ns) {
    watched->misfit_since_ns = context_.now_ns();
  } else if (context_.now_ns() - *watched->misfit_since_ns > kMisfitNs) {
    Exit(kExitMisfit, reader.problem());
  }
}

/// Once for each matter.
void StreamNode::WarnOnce(const std::string& matter, const std::string& text) {
  if (traffic_.IsFirst(matter)) LogWarning("{}: {} (further ones are only counted)", role_, text);
}

void StreamNode::WatchReaders() {
  constexpr char kDoubtful[] =
      "put aside a message with a leap in its number, its time or its term: the first word of a process that "
      "was started again (it counts when it is said again), the echo of one that is gone, or forged";
  if (writer_) {
    const WriterStatistics s = writer_->statistics();
    if (s.dropped_doubtful > 0) WarnOnce("doubtful", kDoubtful);
    if (s.overrun > 0)
      WarnOnce("overrun", "a reader is so far behind that records which it lacks had to be forgotten");
  }
  for (Watched& watched : readers_) {
    RefuseOtherTypes(&watched);
    const ReaderStatistics s = watched.reader->statistics();
    if (s.dropped_doubtful > 0) WarnOnce("doubtful", kDoubtful);
    if (s.lost_with_writer > 0)
      WarnOnce("lost with " + watched.owner, "a writer of " + watched.owner +
                                                 "'s stream is gone before all its records had come, and " +
                                                 std::to_string(s.lost_with_writer) + " of them are lost");
    if (s.lost > s.lost_with_writer)
      WarnOnce("lost", "was away for longer than its writer keeps records: some are lost");
    if (watched.reader->problem() == watched.problem) continue;
    watched.problem = watched.reader->problem();
    if (!watched.problem.empty()) LogWarning("{}: {}", role_, watched.problem);
  }
}

void StreamNode::Advance() {
  endpoint_.Advance();
  NoteQueue();
  if (ending_) return;
  if (camera_info_ && !begun_ && MayBegin()) {
    begun_ = true;
    Begin(*camera_info_);
  }
  RunElection();
  WatchWriter();
  WatchReaders();
  if (ending_) return;
  if (begun_ && (!plan_ || writer_)) {
    while (!ending_ && !stopping_ && WorkOnce()) {
      PumpBetweenSteps();
      PublishStatusIfDue();  // who has much to do says so too
    }
  }
  PublishStatusIfDue();
  endpoint_.Advance();
}

void StreamNode::PublishStatusIfDue() {
  if (!rounds_.TakeStatus(context_.now_ns())) return;
  KeepCameraKnown();
  PublishStatus();
  if (const auto notice = wait_notice_.Due(WaitsFor(), context_.now_ns())) LogInfo("{}: {}", role_, *notice);
  const std::string no_room = feature_store_->TakeProblem();
  if (!no_room.empty())
    LogWarning("{}: features of the map stay in memory, as no file can take them: {}", role_, no_room);
  if (!rounds_.TakeTidying(context_.now_ns())) return;
  ReturnFreeMemory();
  feature_store_->LetGo();
}

void StreamNode::PumpBetweenSteps() {
  if (context_.pump) context_.pump();
  endpoint_.Advance();
  NoteQueue();
}

/// Before it is worked off: what comes and goes between two statuses is seen, too.
void StreamNode::NoteQueue() {
  int64_t depth = 0;
  for (const Watched& watched : readers_) depth += watched.reader->backlog();
  traffic_.NoteQueue(depth);
}

int64_t StreamNode::deadline_ns() const {
  const int64_t settled_ns = candidacy_ ? candidacy_->deadline_ns() : INT64_MAX;
  return std::min({endpoint_.deadline_ns(), rounds_.next_status_ns(), settled_ns, WorkDeadline()});
}

void StreamNode::Stop() {
  hands_over_until_ns_.reset();  // who is asked to end as well waits for nobody
  if (stopping_) return;
  stopping_ = true;
  if (candidacy_) writer_ = candidacy_->TakeWriter();
  if (writer_) {
    writer_->Close(context_.now_ns());
  } else {
    Exit(kExitDone);
  }
}

void StreamNode::Exit(int code, std::string problem) {
  if (!ending_) ending_ = {code, std::move(problem)};
}

std::string NobodyWentOn(const std::string& who_asked) {
  return who_asked + " asked for the stream, and nobody has gone on with it for " +
         std::to_string(kGoesOnWithinNs / 1'000'000'000) + " s";
}

namespace {

void AddReader(const ReaderStatistics& s, ProcessHealth* health) {
  health->queue_depth += static_cast<int32_t>(s.backlog);
  health->received += s.records;
  health->received_bytes += s.payload_bytes;
  health->dropped_foreign += s.dropped_foreign;
  health->dropped_checksum += s.dropped_bad;
  health->dropped_malformed += s.dropped_doubtful;
  health->dropped_overflow += s.dropped_no_room;
  health->dropped_duplicate += s.duplicates;
  health->records_repaired += s.repaired;
  health->recovery_p50_ms = std::max(health->recovery_p50_ms, s.recovery_p50_ms);
  health->recovery_p99_ms = std::max(health->recovery_p99_ms, s.recovery_p99_ms);
  health->repairs_requested += s.requested;
  health->records_lost += s.lost;
}

void AddWriter(const StreamWriter& writer, ProcessHealth* health) {
  const WriterStatistics s = writer.statistics();
  health->epoch = writer.term().epoch;
  health->written = s.records;
  health->written_bytes = s.payload_bytes;
  health->dropped_checksum += s.dropped_bad;
  health->dropped_malformed += s.dropped_doubtful;
  health->dropped_foreign += s.dropped_foreign;
  health->dropped_overflow += s.overrun;
  health->resent = s.parts_repaired;
  health->resent_bytes = s.repaired_bytes;
  health->kept_bytes = static_cast<int64_t>(s.kept_bytes);
  health->readers = static_cast<int32_t>(writer.num_readers());
  health->snapshots = static_cast<int32_t>(s.snapshots);
  health->refused_peers = s.refused;
}

}  // namespace

StatusHead StreamNode::MakeStatusHead(const std::string& reason,
                                      const std::vector<const StreamReader*>& readers) const {
  StatusHead head;
  head.utime = context_.wall_us();
  head.session = session_;
  head.reason = reason.empty() ? cameras_.not_heard() : reason;
  ProcessHealth& health = head.health;
  health = MeasureProcess(context_.pid);
  health.uptime_s = static_cast<double>(context_.now_ns() - started_ns_) * 1e-9;
  health.dropped_foreign = context_.refused();
  for (const StreamReader* reader : readers) {
    if (reader != nullptr) AddReader(reader->statistics(), &health);
  }
  traffic_.AddTo(&health);
  if (!writer_) return head;
  AddWriter(*writer_, &health);
  for (const std::string& role : plan_->readers)
    health.unacknowledged = std::max(health.unacknowledged, static_cast<int32_t>(writer_->Backlog(role)));
  health.waiting_for = AwaitedReaders();
  return head;
}

}  // namespace dmslam
