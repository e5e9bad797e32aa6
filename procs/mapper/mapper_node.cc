#include "mapper/mapper_node.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/recording/checkpoint.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "dmslam/wire/streams.h"

namespace dmslam {

void AddMapperOptions(CommandLine& app, MapperFiles* files) {
  if (const char* checkpoint = std::getenv("DMSLAM_CHECKPOINT")) files->checkpoint = checkpoint;
  app.AddOption("--map", files->load, "saved map or log: begin with this map (needs the setting map.saved)");
  app.AddOption(
      "--checkpoint", files->checkpoint,
      "the collector's checkpoint of this session: go on from it where no other process has the map "
      "any more; default: what DMSLAM_CHECKPOINT names");
  app.AddOption("--save-map", files->save, "write the map into this file at the end");
}

std::unique_ptr<Node> MakeMapper(NodeContext context, NodeOptions options, MapperFiles files) {
  return std::make_unique<MapperNode>(std::move(context), std::move(options), std::move(files));
}

namespace {

/// Said at the beginning, while the folder can still be made: the map is saved at the end.
void WarnOfFolder(const std::string& save) {
  try {
    CheckFolderOf(save);
  } catch (const InputError& error) {
    LogWarning("mapper: --save-map: {}, before the run ends", error.what());
  }
}

}  // namespace

MapperNode::MapperNode(NodeContext context, NodeOptions options, Files files)
    : StreamNode(std::move(context), std::move(options), roles::kMapper),
      run_(options_.settings.Read<RunOptions>()),
      files_(std::move(files)),
      requests_(options_.NumCameras()) {
  if (run_.saved_map == files_.load.empty()) {
    throw InputError(files_.load.empty()
                         ? "setting 'map.saved' needs a map: give it to the mapper with --map FILE"
                         : "--map " + files_.load +
                               ": set map.saved=on for every process (scripts/run.sh --map does)");
  }
  if (run_.localize_only && !run_.saved_map) {
    throw InputError("setting 'map.localize_only' needs a map: set map.saved=on and give --map FILE");
  }
  if (!files_.load.empty()) saved_.emplace(files_.load, feature_store_);
  if (!files_.save.empty()) WarnOfFolder(files_.save);
  Listen({channels::kSessionAgain});
}

/// What the frontend said when it began. A mapper that takes over later does not read that in its stream.
void MapperNode::OnMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  const std::optional<RecordHeader> header = ParseHeader(bytes);
  if (!header || !IsIntact(channel, bytes)) return CountMalformed(channel, "its checksum does not fit");
  const std::optional<SessionStart> start = ReadSessionStart(*header, bytes);
  if (start && !IsForeign(start->session)) heard_sessions_.Hear(0, header->epoch, *start, context_.now_ns());
}

void MapperNode::Begin(const CameraInfo& info) {
  lockstep_ = info.mode == PlaybackMode::kLockstep;
  const auto pyramid = options_.settings.Read<Pyramid>();
  std::optional<SavedMap::Beginning> saved;
  if (saved_) saved = saved_->Begin(info.camera, pyramid, session_);
  work_ = MakeCoreThread(info.mode, {.lets_others_go_first = true});
  const auto publish = [this](const MapDelta& delta) {
    tally_.OnDelta(delta, core_->map());
    work_->Report([this, delta] { PublishDelta(delta); });
  };
  core_ = std::make_unique<MapperCore>(options_.settings.Read<MapperOptions>(), info.camera, pyramid,
                                       saved ? saved->ordinal : uint16_t{1}, publish);
  core_->KeepFeaturesIn(feature_store_);
  if (saved) {
    core_->ContinueSaved(std::move(saved->map));
    parts_.Cut(core_->map());
  }
  const auto goes_on = [this](const std::atomic<bool>& ends) {  // asked before every step of an adjustment
    work_->Beat();
    return ends.load();
  };
  if (!lockstep_) core_->SetInterrupt([this, goes_on] { return goes_on(hurries_); });
  core_->SetStop([this, goes_on] { return goes_on(stops_); });
  snapshots_ = std::make_unique<MapSnapshots>(&core_->map(), [this] { return work_->Idle(); });
  WantWriter({StreamId::kMap, ReadersOf(StreamId::kMap, options_.NumCameras()), {}, snapshots_.get()});
  ListenToFrontends();
}

/// From the beginning, not only when the map is here: a frontend that dies meanwhile has left behind what it
/// had to say.
void MapperNode::ListenToFrontends() {
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera)
    frontends_.Add(MakeReader(StreamId::kFrontend, std::nullopt, camera));
}

// ---- Continuing what another mapper began ----

void MapperNode::BeginFetch() {
  ReplicaFetch::Options fetch;
  fetch.session = session_;
  fetch.owner = owners::kMapper;
  fetch.name = context_.name;
  fetch.id = context_.random_id;
  fetch.schema_hash = SchemaHash();
  for (const std::string& role : ReadersOf(StreamId::kMap, frontends_.size())) {
    if (options_.peers.empty() || options_.HasPeer(role)) fetch.holders.push_back({role, OwnerName(role)});
  }
  left_ = std::make_unique<LeftMap>(
      LeftMap::Options{fetch, core_->map().camera(), core_->map().pyramid(), feature_store_}, &endpoint_,
      context_.now_ns());
}

/// Takes the newest replica, if there is one, or else what is on the disk; true when that is done.
bool MapperNode::FetchReplica() {
  const LeftMap::State state = left_->Advance(
      context_.now_ns(), [this](const Record& record) { return Read<MapDelta>(*record.bytes); },
      [this](const Record& record, const std::string& why) { CountMalformed(record.channel, why); });
  switch (state) {
    case LeftMap::State::kFetching:
      return false;
    case LeftMap::State::kKeepsGrowing:
      Exit(kExitPresent,
           "the map that the others hold grows while it is fetched: another mapper writes it, which is not "
           "heard here; check the network, or stop that one");
      return false;
    case LeftMap::State::kBroken:
      Exit(kExitInternal, "the map that " + left_->giver() +
                              " holds cannot be used, however often it is asked for (the warnings above say "
                              "what is wrong with it): restart that process");
      return false;
    case LeftMap::State::kWhole:
      ContinueLeftMap();
      break;
    case LeftMap::State::kNone:
      TakeCheckpoint();
      break;
  }
  left_.reset();
  return true;
}

void MapperNode::ContinueLeftMap() {
  const Version version = left_->version();
  LogInfo("mapper: continues version {}:{} with {} keyframes and {} landmarks", version.epoch, version.seq,
          left_->replica().keyframes().size(), left_->replica().num_landmarks());
  core_->Continue(left_->TakeReplica(), static_cast<uint64_t>(context_.random_id));
  parts_.Drop();  // what the others hold is newer
  writer_plan().parent = version;
}

/// Whoever held the map has died with the mapper: what is on the disk is all there is. False: nothing is.
bool MapperNode::TakeCheckpoint() {
  if (files_.checkpoint.empty()) return false;
  FoundCheckpoint found = FindCheckpoint(files_.checkpoint, session_, feature_store_);
  if (!found.problem.empty()) LogWarning("{}", found.problem);
  if (!found.map) return false;
  CheckFits(found.path, found.map->session, camera_info_->camera, options_.settings.Read<Pyramid>());
  const bool ended = found.map->map.progress().ended;
  LogInfo("{}: {} with {} keyframes and {} landmarks", found.path, ended ? "is complete" : "continues",
          found.map->map.keyframes().size(), found.map->map.num_landmarks());
  core_->ContinueSaved(std::move(found.map->map), static_cast<uint64_t>(context_.random_id));
  if (ended) {  // the sequence is over, and the collector has this map
    session_start_ = found.map->session;
    Save();
    Exit(kExitDone);
  }
  parts_.Cut(core_->map());
  return true;
}

bool MapperNode::ReadyToWrite() {
  if (options_.fresh) return true;
  if (context_.fresh_system) {
    if (context_.resumed && !TakeCheckpoint())
      throw InputError(files_.checkpoint + ": holds no map of this session to go on from");
    return true;
  }
  if (!left_) BeginFetch();
  return FetchReplica();
}

void MapperNode::OnWriterOpen() {
  const MapProgress progress = core_->map().progress();
  for (CameraId camera = 0; camera < frontends_.size(); ++camera) {
    const StreamPosition mapped = core_->map().progress(camera).frontend;
    frontends_.BeginWith(camera, {mapped.epoch, mapped.seq});
  }
  loop_reader_ =
      MakeReader(StreamId::kLoopCloser, Version{progress.loopcloser.epoch, progress.loopcloser.seq});
  // One that has ended could not say goodbye: whoever has died since may lack the map.
  if (progress.ended) end_.WaitUntil(context_.now_ns() + kBackAfterDeathNs);
  const auto begin = [this, ended = progress.ended] {
    tally_.Count(core_->map());
    ended ? core_->End(true) : SettleAgain();
  };
  Run(begin, [this, ended = progress.ended] {
    if (ended) Complete();
  });
}

/// On the core. Somebody may not have heard it.
void MapperNode::SettleAgain() {
  for (const CameraId camera : core_->map().cameras()) {
    const std::optional<KeyframeId> id = core_->map().progress(camera).settled;
    if (!id) continue;
    const Keyframe* settled = core_->map().Resolve(*id);
    core_->Settle(*id, settled != nullptr ? std::optional(settled->map_id) : std::nullopt);
  }
}

// ---- The frontend's and the loop closer's records ----

void MapperNode::PublishDelta(MapDelta delta) {
  const MapEvent event = delta.event;
  PublishChange(std::move(delta));
  timing_.OnPublished(event, context_.now_ns());
}

void MapperNode::NoteArrivals() {
  const int64_t now_ns = context_.now_ns();
  const auto is_doubtful = [this](const Record& record, StreamReader* reader) {
    return IsDoubtful(record, reader);
  };
  for (CameraId camera = 0; camera < frontends_.size(); ++camera) {
    while (std::optional<Record> record = frontends_.Take(camera, is_doubtful))
      records_.Add({camera, std::move(*record), now_ns});
  }
}

void MapperNode::TakeLoopAnswers() {
  while (const std::optional<Record> record = loop_reader_->Take()) {
    std::optional<LoopAnswer> answer = Read<LoopAnswer>(*record->bytes);
    if (!answer) {
      loop_answers_.AddUnreadable();
      continue;
    }
    for (const std::string& problem :
         loop_answers_.Add(std::move(*answer), record->term(), record->version()))
      CountMalformed(record->channel, problem);
  }
  RefuseBrokenCorrections();
}

/// Whoever proposed a correction that did not come whole hears so, and may propose it again.
void MapperNode::RefuseBrokenCorrections() {
  const std::vector<uint64_t> broken = loop_answers_.TakeBroken();
  if (broken.empty()) return;
  Run([this, broken] {
    for (const uint64_t id : broken) core_->RefuseCorrection(id, "its records did not come whole");
  });
}

/// A map with which this mapper has begun is settled when all of it is out: then lock-step goes on.
bool MapperNode::PublishPart() {
  std::optional<MapDelta> part = parts_.TakeNext(context_.now_ns(), !writer_->Full());
  if (!part) return false;
  PublishDelta(std::move(*part));
  const Keyframe& newest = core_->map().keyframes().rbegin()->second;
  if (parts_.empty()) Run([this, id = newest.id, map_id = newest.map_id] { core_->Settle(id, map_id); });
  return true;
}

/// Returns which keyframe it answers.
KeyframeId MapperNode::ApplyFirstAnswer() {
  const LoopAnswers::Answer first = loop_answers_.TakeFirst();
  const auto apply = [this, first] {
    MapProgress progress = core_->map().progress();
    progress.loopcloser = {first.version.epoch, first.version.seq};
    core_->SetProgress(progress);
    core_->OnLoopAnswer(first.answer);
  };
  Run(apply, [this, version = first.version] {
    unsafe_answers_.OnHandled({0, version, writer_->last_seq()});
  });
  return first.answer.keyframe;
}

/// Has the core do something, and then this node. The core is idle.
void MapperNode::Run(Job job, std::function<void()> when_done) {
  hurries_ = RecordsAreUrgent();
  work_->Post([this, job = std::move(job), when_done = std::move(when_done)] {
    job();
    work_->Report([this, when_done, status = StatusOf(*core_, tally_)] {
      status_ = status;
      if (when_done) when_done();
    });
  });
}

int64_t MapperNode::WorkDeadline() const { return writer_ ? parts_.next_ns() : INT64_MAX; }

bool MapperNode::WorkOnce() {
  if (end_.IsCompleting()) {
    DrainAfterEnd();
    return false;
  }
  NoteArrivals();
  AcceptWhatIsSafe();
  if (!work_->Idle()) {
    if (RecordsAreUrgent()) hurries_ = true;
    return false;
  }
  if (snapshots_->wanted()) endpoint_.Advance();  // now the map may be read
  if (!parts_.empty()) return PublishPart();
  TakeLoopAnswers();
  if (!work_->Idle()) return false;
  records_.MakeDue();
  if (settling_.Awaits()) {
    SettleAwaited();
    return !settling_.Awaits();
  }
  if (!lockstep_ && !loop_answers_.empty()) {
    ApplyFirstAnswer();
    return work_->Idle();
  }
  if (!records_.NoneIsDue()) return HandleFirstRecord();
  if (AnswerRequests() || GiveTurn()) return work_->Idle();
  return EndIfDone();
}

/// The records up to here are worked into the map: the next map record says so.
void MapperNode::MarkFrontend(CameraId camera, const Version& version) {
  MapProgress progress = core_->map().progress(camera);
  progress.frontend = {version.epoch, version.seq};
  core_->SetProgress(progress);
}

/// A frontend must have the settings of this process, and the vocabulary with which the map was made that it
/// begins in.
std::string MapperNode::WhyMisfits(const SessionStart& start) const {
  const std::string why = StreamNode::WhyMisfits(start);
  return why.empty() && saved_ ? saved_->WhyMisfits(start.vocabulary_checksum) : why;
}

void MapperNode::JoinFrontend(CameraId camera, const SessionStart& start) {
  if (camera == 0) session_start_ = start;
  requests_.OnBegin(camera);
  JoinSession(start);
}

/// True: there may be more to do.
bool MapperNode::HandleFirstRecord() {
  const ArrivedRecords::Arrived first = records_.TakeFirst();
  const Record& record = first.record;
  timing_.OnRecord(first.at_ns);
  if (record.channel == channels::kSession) {
    if (const auto start = ReadSessionStart(record.header, *record.bytes)) JoinFrontend(first.camera, *start);
  }
  // A keyframe makes several map records: only the last one says that it is done.
  const bool many = record.channel == channels::kInitialMap || record.channel == channels::kKeyframe;
  const Version version = record.version();
  const auto work = [this, many, camera = first.camera, version, job = JobFor(first.camera, record)] {
    if (!many) MarkFrontend(camera, version);
    if (job) job();
  };
  Run(work, [this, camera = first.camera, version] {
    if (!settling_.Awaits()) unsafe_.OnHandled({camera, version, writer_->last_seq()});
    AcceptWhatIsSafe();
  });
  return work_->Idle();
}

/// What a record of the frontend asks of the core; empty: nothing.
MapperNode::Job MapperNode::JobFor(CameraId camera, const Record& record) {
  if (record.channel == channels::kTurnRequest) {
    if (const auto request = Read<TurnRequest>(*record.bytes))
      requests_.OnTurn(camera, record.version().epoch, *request);
    return {};
  }
  if (run_.localize_only) return LocalizeOnlyJobFor(record);
  if (record.channel == channels::kInitialMap || record.channel == channels::kKeyframe)
    return KeyframeJobFor(record);
  if (record.channel == channels::kFrameEvidence) {
    if (const auto evidence = Read<FrameEvidence>(*record.bytes))
      return [this, evidence] { core_->OnEvidence(*evidence); };
  } else if (record.channel == channels::kMapReset) {
    if (const auto reset = Read<MapReset>(*record.bytes)) return [this, reset] { core_->OnReset(*reset); };
  } else if (record.channel == channels::kAdjustRequest) {
    if (const auto request = Read<AdjustRequest>(*record.bytes)) {
      if (frontends_.size() == 1) return [this, request] { core_->OnAdjustRequest(*request); };
      requests_.OnAdjust(camera, request->request);  // the others go on mapping
    }
  }
  return {};
}

/// The map stays as it is, but nobody is left waiting.
MapperNode::Job MapperNode::LocalizeOnlyJobFor(const Record& record) {
  if (record.channel != channels::kAdjustRequest) return {};
  const auto request = Read<AdjustRequest>(*record.bytes);
  if (!request) return {};
  return [this, request] { core_->AnswerRequest(*request); };
}

MapperNode::Job MapperNode::KeyframeJobFor(const Record& record) {
  const Version version = record.version();
  if (record.channel == channels::kInitialMap) {
    const auto proposal = Read<InitialMap>(*record.bytes);
    if (!proposal) return {};
    return [this, version, proposal] {
      const bool started = core_->OnInitialMap(*proposal);
      AfterKeyframe(version, proposal->second.id, proposal->map_id, started);
    };
  }
  const auto proposal = Read<KeyframeProposal>(*record.bytes);
  if (!proposal) return {};
  return [this, version, proposal] {
    const KeyframeOutcome outcome = core_->OnKeyframe(*proposal);
    AfterKeyframe(version, proposal->id, proposal->map_id, outcome == KeyframeOutcome::kInserted,
                  WhyRefused(outcome));
  };
}

/// On the core. In lock-step, where the node is told at once, a keyframe settles when the loop closer has
/// answered it.
void MapperNode::AfterKeyframe(const Version& version, KeyframeId id, MapId map_id,
                               bool checked_by_loopcloser, std::string why_refused) {
  const bool wait = lockstep_ && checked_by_loopcloser && options_.HasPeer(roles::kLoopCloser);
  if (!wait) return Settle(id, map_id, version, std::move(why_refused));
  work_->Report([this, version, id, map_id] {
    settling_.Await({id, map_id, version}, loop_reader_->term());
  });
}

/// On the core.
void MapperNode::Settle(KeyframeId id, MapId map_id, const Version& of_frontend, std::string why_refused) {
  MarkFrontend(id.camera(), of_frontend);
  core_->Settle(id, map_id, std::move(why_refused));
  work_->Report([this, id] { settling_.OnSettled(id); });
}

/// Lock-step: the answer to the awaited keyframe, applied, lets it settle.
void MapperNode::SettleAwaited() {
  if (loop_answers_.TakeLost()) settling_.OnLost();
  while (!loop_answers_.empty() && settling_.Awaits()) {
    const auto settled = settling_.OnAnswer(ApplyFirstAnswer());
    if (!settled) continue;
    Run([this, settled] { Settle(settled->id, settled->map_id, settled->version); },
        [this, settled] {
          unsafe_.OnHandled({settled->id.camera(), settled->version, writer_->last_seq()});
        });
  }
  if (const auto question = settling_.TakeQuestion(loop_reader_->term()))
    Run([this, question] { core_->AskAgain(question->id, question->map_id); });
}

void MapperNode::AcceptWhatIsSafe() {
  const auto is_held = [this](int64_t map_seq) { return writer_->AcknowledgedByAny(map_seq); };
  while (const auto safe = unsafe_.TakeSafe(is_held)) frontends_.Accept(safe->camera, safe->version);
  while (const auto safe = unsafe_answers_.TakeSafe(is_held)) loop_reader_->Accept(safe->version);
}

// ---- Several cameras ----

/// True: a job for the core was made of it.
bool MapperNode::GiveTurn() {
  if (!lockstep_ || frontends_.size() == 1 || end_.HasBegun()) return false;
  const auto turn =
      requests_.TakeTurn(HasEnded(), [this](CameraId camera) { return frontends_.Epoch(camera); });
  if (!turn) return false;
  Run([this, frame = KeyframeId::Make(session_, turn->frame_index, turn->camera)] {
    core_->GiveTurn(frame);
  });
  return true;
}

/// The same of requests to adjust the maps.
bool MapperNode::AnswerRequests() {
  if (frontends_.size() == 1) return false;
  const std::vector<AdjustRequest> requests = requests_.TakeAdjust(HasEnded());
  if (requests.empty()) return false;
  Run([this, requests] {
    for (const AdjustRequest& request : requests) core_->OnAdjustRequest(request);
  });
  return true;
}

CameraRequests::HasEnded MapperNode::HasEnded() const {
  return [this](CameraId camera) { return frontends_.HasEnded(camera); };
}

// ---- The end ----

bool MapperNode::EndIfDone() {
  switch (end_.TakeStep(frontends_.AllHaveEnded(), !loop_answers_.empty())) {
    case MapperEnd::Step::kNone:
      return false;
    case MapperEnd::Step::kApplyAnswer:
      ApplyFirstAnswer();
      return work_->Idle();
    case MapperEnd::Step::kAnnounce:
      Run([this] { core_->End(run_.localize_only); });
      return work_->Idle();
    case MapperEnd::Step::kComplete:
      Complete();
  }
  return true;
}

void MapperNode::Complete() {
  writer_->Complete(context_.now_ns());
  end_.Complete();
  PublishStatus();
}

/// All readers take the last record before this process leaves. What still comes in changes nothing any more.
void MapperNode::DrainAfterEnd() {
  frontends_.AcceptUnread();
  while (loop_reader_->Take()) loop_reader_->AcceptTaken();
  if (writer_->completed()) return Stop();
  if (!end_.GivesUp(context_.now_ns())) return;
  LogInfo("mapper: ends, since the map is complete and not all who lack it have come back within {} s",
          kBackAfterDeathNs / 1'000'000'000);
  Stop();
}

void MapperNode::Save() {
  const std::string path = std::exchange(files_.save, "");
  if (path.empty() || !core_ || core_->map().keyframes().empty()) return;
  if (!session_start_) session_start_ = heard_sessions_.Mapped(0, core_->map().progress(0).frontend.epoch);
  if (!session_start_) {
    throw InputError(path +
                     ": not written, since this mapper took over and has not heard from the frontend "
                     "with which settings the map was made; 'dmslam-map --log LOG --save' writes it");
  }
  SessionRuns runs = saved_ ? saved_->runs() : SessionRuns();
  runs.insert_or_assign(session_, *session_start_);
  SaveMap(path, core_->map(), *session_start_, runs);
}

void MapperNode::TellWhatWasNotDone() const {
  const std::string text = core_ ? NotDoneText(core_->counters()) : "";
  if (!text.empty()) LogInfo("mapper: {}", text);
}

/// A step in work inserts and creates, and leaves out what takes long; an adjustment ends where it is.
void MapperNode::InterruptCore() {
  hurries_ = stops_ = true;
  if (work_) work_->Finish();
}

MapperNode::~MapperNode() { hurries_ = stops_ = true; }

void MapperNode::Stop() {
  if (!stopping_) {
    InterruptCore();
    TellWhatWasNotDone();
  }
  Save();
  StreamNode::Stop();
}

/// The state, and for whom it waits in it.
std::pair<MapperStatus::State, std::string> MapperNode::StateAndReason() const {
  using State = MapperStatus::State;
  if (!core_) return {State::kStarting, "waiting for a camera"};
  if (end_.IsCompleting()) return {State::kDone, ""};
  if (!writer_) return {State::kWaiting, "asks who writes the map, and who holds one"};
  const bool idle = !end_.HasBegun() && work_->Idle() && records_.size() == 0;
  if (idle && frontends_.AllAreGone(context_.now_ns())) return {State::kWaiting, "waiting for a frontend"};
  return {State::kMapping, ""};
}

/// The frontends that are not there, where others cannot go on, or the map cannot be complete, without them.
std::string MapperNode::WaitsFor() const {
  if (!core_ || end_.HasBegun() || stopping_) return "";
  if (!writer_) return left_ ? left_->Unanswered() : "";
  std::string missing;
  bool any_waits = false;
  for (CameraId camera = 0; camera < frontends_.size(); ++camera) {
    const bool ended = frontends_.HasEnded(camera);
    any_waits = any_waits || ended || requests_.Waits(camera);
    if (!ended && !frontends_.IsThere(camera, context_.now_ns()))
      missing += (missing.empty() ? "" : ", ") + OfCamera(roles::kFrontend, camera);
  }
  return any_waits ? missing : "";
}

void MapperNode::PublishStatus() {
  if (core_ && work_->Idle()) status_ = StatusOf(*core_, tally_);
  MapperStatus status = status_;
  std::vector<const StreamReader*> readers = frontends_.readers();
  readers.push_back(loop_reader_.get());
  const auto [state, reason] = StateAndReason();
  status.head = MakeStatusHead(reason, readers);
  status.state = state;
  status.keyframe_queue = static_cast<int32_t>(records_.size());
  status.keyframes_unaccepted = static_cast<int32_t>(unsafe_.size()) + (settling_.Awaits() ? 1 : 0);
  status.last_settled = settling_.last_settled();
  timing_.Fill(&status);
  PublishLoose(status);
}

}  // namespace dmslam
