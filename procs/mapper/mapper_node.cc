#include "mapper/mapper_node.h"

#include <algorithm>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kPartEveryNs = 3'000'000;

}  // namespace

MapperNode::MapperNode(NodeContext context, NodeOptions options, Files files)
    : StreamNode(std::move(context), std::move(options), "mapper"),
      run_(options_.settings.Read<RunOptions>()),
      files_(std::move(files)) {
  if (run_.saved_map == files_.load.empty()) {
    throw InputError(files_.load.empty()
                         ? "setting 'map.saved' needs a map: give it to the mapper with --map FILE"
                         : "--map " + files_.load +
                               ": set map.saved=on for every process (scripts/run.sh --map does)");
  }
  if (run_.localize_only && !run_.saved_map) {
    throw InputError("setting 'map.localize_only' needs a map: set map.saved=on and give --map FILE");
  }
  if (!files_.load.empty()) saved_ = LoadMap(files_.load);
}

/// Takes the loaded map over and returns the ordinal under which new landmarks are numbered.
uint16_t MapperNode::ContinueSavedMap(const CameraInfo& info) {
  CheckFits(files_.load, *saved_, info.camera, options_.settings.Read<Pyramid>());
  const Map& map = saved_->map;
  if (session_ <= NewestSession(map)) {
    throw InputError(files_.load + ": holds keyframes of session " + std::to_string(NewestSession(map)) +
                     "; give all processes a higher one with --session");
  }
  if (saved_->missing > 0) {
    LogWarning("{}: {} map records are missing in it; the map is as good as it can be", files_.load,
               saved_->missing);
  }
  const uint16_t ordinal = static_cast<uint16_t>(NewestOrdinal(map) + 1);
  LogInfo("{}: {} keyframes and {} landmarks loaded", files_.load, map.keyframes().size(),
          map.num_landmarks());
  return ordinal;
}

void MapperNode::Begin(const CameraInfo& info) {
  lockstep_ = info.mode == PlaybackMode::kLockstep;
  const uint16_t ordinal = saved_ ? ContinueSavedMap(info) : uint16_t{1};
  core_ = std::make_unique<MapperCore>(options_.settings.Read<MapperOptions>(), info.camera,
                                       options_.settings.Read<Pyramid>(), ordinal,
                                       [this](const MapDelta& delta) { PublishDelta(delta); });
  if (saved_) {
    core_->ContinueSaved(std::exchange(saved_, std::nullopt)->map);
    const KeyframeId newest = core_->map().keyframes().rbegin()->first;
    const std::vector<MapDelta> parts = CutSnapshot(core_->map(), newest, 56 * 1024);
    saved_parts_.assign(parts.begin(), parts.end());
  }
  if (!lockstep_) {
    core_->SetInterrupt([this] {
      PumpWithinWork();
      NoteArrivals();
      return KeyframeWaits();
    });
  }
  snapshots_ = std::make_unique<MapSnapshots>(&core_->map());
  WantWriter({StreamId::kMap, {"frontend", "loopcloser", "collector"}, {}, snapshots_.get()});
}

// ---- Continuing what another mapper began ----

void MapperNode::BeginFetch() {
  ReplicaFetch::Options options;
  options.session = session_;
  options.owner = "MAPPER";
  options.name = context_.name;
  options.id = context_.random_id;
  options.schema_hash = SchemaHash();
  const std::vector<ReplicaFetch::Holder> holders = {
      {"frontend", "FRONTEND"}, {"loopcloser", "LOOPCLOSER"}, {"collector", "COLLECTOR"}};
  for (const ReplicaFetch::Holder& holder : holders) {
    if (options_.peers.empty() || options_.HasPeer(holder.role)) options.holders.push_back(holder);
  }
  fetch_ = std::make_unique<ReplicaFetch>(options, context_.now_ns());
  endpoint_.AddFetch(fetch_.get(), {channels::kMap});
}

/// Takes the newest replica, if there is one; true when that is done.
bool MapperNode::FetchReplica() {
  while (std::optional<Record> record = fetch_->Take()) {
    if (record->begins_anew()) fetched_.emplace(core_->map().camera(), core_->map().pyramid());
    if (const auto delta = Read<MapDelta>(*record->bytes)) fetched_->Apply(*delta);
  }
  if (fetch_->state() == ReplicaFetch::State::kNone) return true;
  if (fetch_->state() != ReplicaFetch::State::kDone) return false;
  const Version version = fetch_->version();
  LogInfo("mapper: continues version {}:{} with {} keyframes and {} landmarks", version.epoch, version.seq,
          fetched_->keyframes().size(), fetched_->num_landmarks());
  core_->Continue(std::move(*fetched_));
  saved_parts_.clear();  // what the others hold is newer
  writer_plan().parent = version;
  return true;
}

bool MapperNode::ReadyToWrite() {
  if (context_.fresh_system || options_.fresh) return true;
  if (!fetch_) BeginFetch();
  if (!FetchReplica()) return false;
  endpoint_.Remove(fetch_.get());
  return true;
}

void MapperNode::OnWriterOpen() {
  fetch_.reset();
  fetched_.reset();
  const MapProgress progress = core_->map().progress();
  frontend_reader_ = MakeReader(StreamId::kFrontend, "FRONTEND",
                                {channels::kSession, channels::kInitialMap, channels::kKeyframe,
                                 channels::kFramePose, channels::kFrameEvidence, channels::kMapReset},
                                {progress.frontend.epoch, progress.frontend.seq});
  loop_reader_ = MakeReader(StreamId::kLoopCloser, "LOOPCLOSER", {channels::kChecked},
                            {progress.loopcloser.epoch, progress.loopcloser.seq});
  if (progress.ended) {  // the one before could not say goodbye
    end_announced_ = completing_ = true;
    Stop();
  } else if (progress.settled.valid()) {  // somebody may not have heard it
    const std::optional<Map::ResolvedPose> settled = core_->map().ResolvePose(progress.settled);
    core_->Settle(progress.settled, settled ? settled->map_id : 0);
  }
}

// ---- The frontend's and the loop closer's records ----

void MapperNode::PublishDelta(const MapDelta& delta) {
  PublishRecord(delta);
  PumpWithinWork();
  const int64_t now_ns = context_.now_ns();
  const double elapsed_ms = static_cast<double>(now_ns - keyframe_arrived_ns_) * 1e-6;
  if (delta.event == MapEvent::kFused) fused_ns_ = now_ns;
  if (delta.event == MapEvent::kAdjusted) adjustment_.Add(static_cast<double>(now_ns - fused_ns_) * 1e-6);
  if (delta.event == MapEvent::kLandmarksCreated) to_landmarks_.Add(elapsed_ms);
  if (delta.event == MapEvent::kAdjusted) to_adjusted_.Add(elapsed_ms);
}

bool MapperNode::KeyframeWaits() const {
  return std::any_of(taken_.begin(), taken_.end(),
                     [](const Arrived& arrived) { return arrived.record.channel == channels::kKeyframe; }) ||
         arrived_.size() + frontend_reader_->backlog() > 60;
}

/// Latencies count from when a record came, not from when there was time for it.
void MapperNode::NoteArrivals() {
  const int64_t now_ns = context_.now_ns();
  while (std::optional<Record> record = frontend_reader_->Take())
    arrived_.push_back({std::move(*record), now_ns});
}

void MapperNode::TakeLoopAnswers() {
  while (std::optional<Record> record = loop_reader_->Take()) {
    if (auto answer = Read<LoopAnswer>(*record->bytes))
      answers_.push_back({std::move(*answer), record->version()});
  }
}

/// The loaded map goes out as records like any other, and is settled: then lock-step goes on. One part at a
/// time: a logger, which nobody repairs, keeps up.
bool MapperNode::PublishSavedMap() {
  if (context_.now_ns() < next_part_ns_) return false;
  next_part_ns_ = context_.now_ns() + kPartEveryNs;
  if (writer_->Full()) return false;
  PublishDelta(saved_parts_.front());
  saved_parts_.pop_front();
  const Keyframe& newest = core_->map().keyframes().rbegin()->second;
  if (saved_parts_.empty()) core_->Settle(newest.id, newest.map_id);
  return true;
}

void MapperNode::ApplyFirstAnswer() {
  const PendingAnswer pending = std::move(answers_.front());
  answers_.pop_front();
  MapProgress progress = core_->map().progress();
  progress.loopcloser = {pending.version.epoch, pending.version.seq};
  core_->SetProgress(progress);
  core_->OnLoopAnswer(pending.answer);
  pending_answers_.push_back({pending.version, writer_->last_seq()});
}

int64_t MapperNode::WorkDeadline() const {
  return writer_ && !saved_parts_.empty() ? next_part_ns_ : INT64_MAX;
}

bool MapperNode::WorkOnce() {
  if (completing_) {
    DrainAfterEnd();
    return false;
  }
  if (!saved_parts_.empty()) return PublishSavedMap();
  TakeLoopAnswers();
  NoteArrivals();
  while (!arrived_.empty()) {
    taken_.push_back(std::move(arrived_.front()));
    arrived_.pop_front();
  }
  AcceptWhatIsSafe();
  if (awaited_.valid()) {
    SettleAwaited();
    return !awaited_.valid();
  }
  if (!lockstep_ && !answers_.empty()) {
    ApplyFirstAnswer();
    return true;
  }
  if (taken_.empty()) return EndIfDone();
  const Record record = std::move(taken_.front().record);
  keyframe_arrived_ns_ = taken_.front().at_ns;
  taken_.pop_front();
  current_ = record.version();
  Handle(record);
  if (!awaited_.valid()) pending_.push_back({current_, writer_->last_seq()});
  AcceptWhatIsSafe();
  return true;
}

/// The records up to here are worked into the map: the next map record says so.
void MapperNode::MarkFrontend(const Version& version) {
  MapProgress progress = core_->map().progress();
  progress.frontend = {version.epoch, version.seq};
  core_->SetProgress(progress);
}

void MapperNode::Handle(const Record& record) {
  // A keyframe makes several map records: only the last one says that it is done.
  const bool many = record.channel == channels::kInitialMap || record.channel == channels::kKeyframe;
  if (!many) MarkFrontend(current_);
  if (record.channel == channels::kSession) {
    if (const auto start = Read<SessionStart>(*record.bytes)) {
      session_start_ = *start;
      JoinsSession(*start);
    }
  }
  if (run_.localize_only) {
    // The map stays as it is, but nobody is left waiting.
    if (record.channel == channels::kMapReset) core_->Settle({}, 0);
    return;
  }
  if (record.channel == channels::kInitialMap) {
    if (const auto proposal = Read<InitialMap>(*record.bytes)) HandleInitialMap(*proposal);
  } else if (record.channel == channels::kKeyframe) {
    if (const auto proposal = Read<KeyframeProposal>(*record.bytes)) HandleKeyframe(*proposal);
  } else if (record.channel == channels::kFrameEvidence) {
    if (const auto evidence = Read<FrameEvidence>(*record.bytes)) core_->OnEvidence(*evidence);
  } else if (record.channel == channels::kMapReset) {
    if (const auto reset = Read<MapReset>(*record.bytes)) core_->OnReset(*reset);
  }
}

void MapperNode::HandleInitialMap(const InitialMap& proposal) {
  const bool started = core_->OnInitialMap(proposal);
  AfterKeyframe(proposal.second.id, proposal.map_id, started);
}

void MapperNode::HandleKeyframe(const KeyframeProposal& proposal) {
  const bool inserted = core_->OnKeyframe(proposal);
  AfterKeyframe(proposal.id, proposal.map_id, inserted);
}

void MapperNode::AfterKeyframe(KeyframeId id, MapId map_id, bool checked_by_loopcloser) {
  const bool wait = lockstep_ && checked_by_loopcloser && options_.HasPeer("loopcloser");
  if (!wait) return Settle(id, map_id, current_);
  awaited_ = id;
  awaited_map_ = map_id;
  awaited_version_ = current_;
  asked_term_ = loop_reader_->term();
}

void MapperNode::Settle(KeyframeId id, MapId map_id, const Version& of_frontend) {
  MarkFrontend(of_frontend);
  core_->Settle(id, map_id);
  last_settled_ = id;
}

/// Lock-step: the answer to the awaited keyframe, applied, lets it settle. Answers to earlier ones cannot be
/// due.
void MapperNode::SettleAwaited() {
  bool ask_again = false;
  while (!answers_.empty() && awaited_.valid()) {
    const KeyframeId answered = answers_.front().answer.keyframe;
    ApplyFirstAnswer();
    if (answered != awaited_) {
      ask_again = true;  // it has just come, and answers what is newest
      continue;
    }
    Settle(std::exchange(awaited_, {}), awaited_map_, awaited_version_);
    pending_.push_back({awaited_version_, writer_->last_seq()});
  }
  // Another loop closer than the one that was asked does not know what is due.
  if (!awaited_.valid()) return;
  if (!asked_term_.valid()) asked_term_ = loop_reader_->term();
  if (!ask_again && loop_reader_->term() == asked_term_) return;
  asked_term_ = loop_reader_->term();
  core_->AskAgain(awaited_, awaited_map_);
}

void MapperNode::AcceptWhatIsSafe() {
  while (!pending_.empty() && writer_->AcknowledgedByAny(pending_.front().map_seq)) {
    frontend_reader_->Accept(pending_.front().version);
    pending_.pop_front();
  }
  while (!pending_answers_.empty() && writer_->AcknowledgedByAny(pending_answers_.front().map_seq)) {
    loop_reader_->Accept(pending_answers_.front().version);
    pending_answers_.pop_front();
  }
}

// ---- The end ----

bool MapperNode::EndIfDone() {
  frontend_ended_ = frontend_ended_ || frontend_reader_->AtEnd();
  if (!frontend_ended_) return false;
  if (!end_announced_) {
    end_announced_ = true;
    while (!answers_.empty()) ApplyFirstAnswer();
    core_->End(run_.localize_only);
  }
  writer_->Complete(context_.now_ns());
  completing_ = true;
  PublishStatus();
  return true;
}

/// All readers take the last record before this process leaves. What still comes in changes nothing any more.
void MapperNode::DrainAfterEnd() {
  while (frontend_reader_->Take()) frontend_reader_->AcceptTaken();
  while (loop_reader_->Take()) loop_reader_->AcceptTaken();
  if (writer_->completed()) Stop();
}

void MapperNode::Save() {
  const std::string path = std::exchange(files_.save, "");
  if (path.empty() || !core_ || core_->map().keyframes().empty()) return;
  SaveMap(path, core_->map(), session_start_);
}

void MapperNode::Stop() {
  Save();
  StreamNode::Stop();
}

void MapperNode::PublishStatus() {
  MapperStatus status;
  status.head =
      MakeStatusHead(core_ ? "" : "waiting for a camera", {frontend_reader_.get(), loop_reader_.get()});
  status.state = core_ ? MapperStatus::State::kMapping : MapperStatus::State::kStarting;
  if (completing_) status.state = MapperStatus::State::kDone;
  status.keyframe_queue = static_cast<int32_t>(arrived_.size() + taken_.size());
  status.keyframes_unaccepted = static_cast<int32_t>(pending_.size()) + (awaited_.valid() ? 1 : 0);
  status.last_settled = last_settled_;
  status.landmarks_p50_ms = to_landmarks_.Quantile(0.5);
  status.landmarks_p95_ms = to_landmarks_.Quantile(0.95);
  status.landmarks_p99_ms = to_landmarks_.Quantile(0.99);
  status.adjusted_p50_ms = to_adjusted_.Quantile(0.5);
  status.adjusted_p95_ms = to_adjusted_.Quantile(0.95);
  status.adjusted_p99_ms = to_adjusted_.Quantile(0.99);
  status.adjustment_ms = adjustment_.Quantile(0.5);
  if (core_) FillCoreStatus(&status);
  PublishLoose(status);
}

void MapperNode::FillCoreStatus(MapperStatus* status) const {
  const Map& map = core_->map();
  const MapperCounters& counters = core_->counters();
  status->version = static_cast<int64_t>(map.version());
  status->maps = static_cast<int32_t>(counters.maps_started - counters.maps_dropped);
  status->keyframes = static_cast<int32_t>(map.keyframes().size());
  status->landmarks = static_cast<int32_t>(map.num_landmarks());
  status->keyframes_inserted = static_cast<int64_t>(counters.keyframes_inserted);
  status->keyframes_culled = static_cast<int64_t>(counters.keyframes_culled);
  status->landmarks_created = counters.creation.created;
  status->landmarks_culled = static_cast<int64_t>(counters.landmarks_culled);
  status->landmarks_fused = static_cast<int64_t>(counters.fusions);
  status->observations_dropped = static_cast<int64_t>(counters.observations_dropped);
  status->refused_neighbourhood = counters.creation.refused_neighbourhood + counters.creation.refused_count;
  status->refused_motion = static_cast<int64_t>(counters.landmarks_moving_removed);
  status->refused_geometry = counters.creation.refused_parallax + counters.creation.refused_depth +
                             counters.creation.refused_reprojection + counters.creation.refused_scale;
  status->corrections_applied = static_cast<int64_t>(counters.corrections_applied);
  status->corrections_refused = static_cast<int64_t>(counters.corrections_refused);
}

}  // namespace dmslam
