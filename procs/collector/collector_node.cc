#include "collector/collector_node.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <utility>

#include "collector/corrections.h"
#include "collector/results.h"
#include "dmslam/console/log.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/runtime/service_notice.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kSyncEveryNs = 1'000'000'000;
constexpr int64_t kCountersEveryNs = 5'000'000'000;
constexpr int64_t kLastStatusesNs = 300'000'000;  // after the end, the processes say their last words
constexpr int64_t kSilentAfterEndNs = 3'000'000'000;
constexpr int64_t kSilentFrontendNs = 1'000'000'000;  // it says ten times a second that it is there
constexpr int64_t kRoomOnDiskNs = 30'000'000'000;     // after the end: no room comes any more
constexpr int64_t kTryAgainNs = 1'000'000'000;

}  // namespace

std::unique_ptr<Node> MakeCollector(NodeContext context, NodeOptions options, CollectorOptions collector) {
  return std::make_unique<CollectorNode>(std::move(context), std::move(options), std::move(collector));
}

CollectorNode::CollectorNode(NodeContext context, NodeOptions options, CollectorOptions collector)
    : StreamNode(std::move(context), std::move(options), roles::kCollector),
      collector_(std::move(collector)),
      sequences_(options_.NumCameras()),
      frames_(options_.NumCameras()),
      place_({.own_id = context_.random_id,
              .others_may_be = !context_.fresh_system,
              .takes_over = options_.take_over},
             context_.now_ns()) {
  Listen({channels::kMapperStatus, channels::kLoopcloserStatus, AckChannel(owners::kCollector)});
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera) {
    Listen({channels::kEndOfSequence, channels::kGroundTruthPose, channels::kFrameTrace,
            channels::kPlayerStatus, channels::kFrontendStatus},
           camera);
  }
  collector_.ground_truth.resize(options_.NumCameras());
  run_.cameras.resize(options_.NumCameras());
  for (std::string& path : collector_.ground_truth) path = path == "-" ? "" : path;
  RecallEndedMap();
  RecallSession();
}

/// A collector before this one has noted what the run rests on: nobody need say it again, and what a frontend
/// has kept for this one is taken at once.
void CollectorNode::RecallSession() {
  if (context_.fresh_system || session_ == 0) return;
  std::optional<SessionStart> start;
  Journal::Read(JournalPath(collector_.out_dir), session_, [&](std::span<const uint8_t> record) {
    if (!start) start = wire::Decode<SessionStart>(record);
    if (start && start->camera_id != 0) start.reset();
  });
  if (start) KnowSession(*start);
}

void CollectorNode::KnowSession(const SessionStart& start) {
  CameraInfo info;
  info.session = session_;
  info.camera = start.camera;
  info.sequence = start.sequence;
  info.mode = start.mode;
  place_.GoOn();
  KnowCamera(info);
}

/// Where the map on the disk is the last one, nobody is needed any more, and nobody may be left.
void CollectorNode::RecallEndedMap() {
  if (context_.fresh_system && !context_.resumed) return;
  FoundCheckpoint found = FindCheckpoint(CheckpointPath(collector_.out_dir), session_, feature_store_);
  if (!found.map || !found.map->map.progress().ended) return;
  LogInfo("{}: the map is complete; what is left to do is to write the results", found.path);
  ended_map_.found = std::move(found.map->map);
  KnowSession(found.map->session);
}

void CollectorNode::OnCamera(const CameraInfo& info) {
  sequences_.Announce(info.camera_id, info.num_frames, info.first_frame);
  run_.cameras[info.camera_id].sequence = info.sequence;
}

bool CollectorNode::MayBegin() {
  YieldToOther();
  return !exit_code() && place_.MayBegin(session_, context_.now_ns());
}

void CollectorNode::HearReader(std::span<const uint8_t> bytes) {
  const auto ack = DecodeAck(AckChannel(owners::kCollector), bytes);
  if (!ack) return;
  place_.Hear({ack->reader, ack->name, ack->header.session, ack->utime}, context_.now_ns());
  YieldToOther();
}

void CollectorNode::YieldToOther() {
  const std::optional<CollectorPlace::Yield> yield = place_.TakeYield(session_, context_.now_ns());
  if (!yield) return;
  const std::string who = "session " + std::to_string(session_) + ": " + yield->other;
  if (yield->how == CollectorPlace::Yield::How::kLeave)
    return Exit(kExitPresent, who +
                                  " writes results of this session already: stop it, or give another "
                                  "--session, --prefix or port");
  LogInfo("{} writes its results; waits until it has ended", who);
}

void CollectorNode::Begin(const CameraInfo& info) {
  builder_ = std::make_unique<TrajectoryBuilder>(info.camera, options_.settings.Read<Pyramid>());
  builder_->KeepFeaturesIn(feature_store_);
  if (ended_map_.found) {
    ended_map_.safe_version = ended_map_.found->version();
    builder_->SetMap(*std::exchange(ended_map_.found, std::nullopt));
  }
  place_.OnBegun(context_.now_ns());
  run_.mode = info.mode == PlaybackMode::kLockstep ? "lockstep" : "realtime";
  run_.profile = options_.settings.profile();
  run_.seed = options_.settings.Read<RunOptions>().seed;
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera)
    run_.cameras[camera].ground_truth = collector_.ground_truth[camera];
  OpenJournal();
  BeginCheckpoints();
  map_reader_ = MakeReader(StreamId::kMap);
  ServeReplica(&builder_->map(), [this] { return MapHeld(*map_reader_); });
}

void CollectorNode::OnMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  if (channel == AckChannel(owners::kCollector)) {
    HearReader(bytes);
  } else if (channel == channels::kFrameTrace) {
    if (const auto trace = Read<FrameTrace>(bytes);
        trace && !IsForeign(trace->session) && trace->camera_id == 0)
      run_.durations.Add(*trace);
  } else if (channel == channels::kEndOfSequence) {
    if (const auto end = Read<EndOfSequence>(bytes); end && !IsForeignFrame(end->session))
      sequences_.OnEnd(*end);
  } else if (channel == channels::kGroundTruthPose) {
    if (const auto pose = Read<GroundTruthPose>(bytes); pose && !IsForeignFrame(pose->session))
      OnGroundTruth(*pose);
  } else if (channel == channels::kPlayerStatus) {
    if (const auto status = Read<PlayerStatus>(bytes)) OnPlayerStatus(*status);
  } else if (channel == channels::kFrontendStatus) {
    if (auto status = Read<FrontendStatus>(bytes)) OnFrontendStatus(std::move(*status));
  } else if (channel == channels::kMapperStatus) {
    auto status = Read<MapperStatus>(bytes);
    if (status && OnHealth(roles::kMapper, status->head)) run_.mapper = std::move(*status);
  } else if (channel == channels::kLoopcloserStatus) {
    auto status = Read<LoopcloserStatus>(bytes);
    if (status && OnHealth(roles::kLoopCloser, status->head)) run_.loopcloser = std::move(*status);
  }
}

void CollectorNode::OnGroundTruth(const GroundTruthPose& pose) {
  if (pose.camera_id >= options_.NumCameras() || !collector_.ground_truth[pose.camera_id].empty()) return;
  std::vector<StampedPose>& heard = run_.cameras[pose.camera_id].heard_ground_truth;
  if (!heard.empty() && pose.stamp_ns <= heard.back().stamp_ns) return;
  heard.push_back({pose.stamp_ns, pose.T_world_cam});
}

/// What a collector before this one has noted.
void CollectorNode::ReadNote(const std::string& text) {
  std::istringstream note(text);
  std::string kind;
  note >> kind;
  if (kind == "keyframe" || kind == "mapped" || kind == "dropped" || kind == "begun" || kind == "resumed")
    proposals_.ReadNote(kind, note);
  if (kind == "counters" || kind == "process" || kind == "heard")
    processes_.ReadNote(kind, note, context_.now_ns());
  if (kind == "frames" || kind == "end") sequences_.ReadNote(kind, note);
  if (kind == "taken") kept_->ReadNote(note, options_.NumCameras());
}

bool CollectorNode::IsOfThisRun(const std::string& process, const StatusHead& head) {
  if (head.session == 0 && session_ != 0) return false;  // it has not chosen one yet
  return process.starts_with(roles::kPlayer) ? !IsForeignFrame(head.session) : !IsForeign(head.session);
}

/// False for a process of another session, and for a rival of one of ours.
bool CollectorNode::OnHealth(const std::string& process, const StatusHead& head) {
  if (!IsOfThisRun(process, head)) return false;
  return processes_.Hear(process, head.health, NumKeyframes(), context_.now_ns());
}

size_t CollectorNode::NumKeyframes() const { return builder_ ? builder_->map().keyframes().size() : 0; }

/// What this process has heard and lost itself. A loss is noted at once: whoever comes next does not know it.
void CollectorNode::CountOwn() {
  std::vector<const StreamReader*> readers = {map_reader_.get()};
  for (const auto& reader : frontend_readers_) readers.push_back(reader.get());
  const int64_t lost_before = run_.health[roles::kCollector].records_lost;
  OnHealth(roles::kCollector, MakeStatusHead("", readers));
  if (run_.health[roles::kCollector].records_lost != lost_before) processes_.NoteCounters();
}

void CollectorNode::OnPlayerStatus(const PlayerStatus& status) {
  if (OnHealth(OfCamera(roles::kPlayer, status.camera_id), status.head))
    sequences_.OnPublished(status.camera_id, status.frames_published);
}

void CollectorNode::OnFrontendStatus(FrontendStatus status) {
  const std::string process = OfCamera(roles::kFrontend, status.camera_id);
  if (status.camera_id >= options_.NumCameras() || !IsOfThisRun(process, status.head)) return;
  processes_.HearFrontend(process, std::move(status), NumKeyframes(), context_.now_ns());
}

/// A frontend that is silent, or another one by now, does not say again what it had proposed. Whoever comes
/// after it hears it from here.
void CollectorNode::RepeatWhatIsLeft() {
  const auto lives = [this](CameraId camera, int64_t epoch) {
    const StreamReader& reader = *frontend_readers_[camera];
    return reader.term().epoch == epoch && SilentNs(reader) < kSilentFrontendNs;
  };
  const auto is_known = [this](KeyframeId id) { return builder_->map().HasKnown(id); };
  for (const auto& left : proposals_.ToSayAgain(lives, is_known))
    context_.bus->Publish({ChannelOfCamera(channels::kKeyframe, left.id.camera()), left.record, false});
}

/// As all who listen see it: the streams' own time is in it, and whatever the mapper did before.
void CollectorNode::TimeKeyframe(const MapDelta& delta) {
  const std::optional<int64_t> heard_ns = delta.about ? proposals_.HeardNs(*delta.about) : std::nullopt;
  if (!heard_ns) return;
  const double elapsed_ms = static_cast<double>(context_.now_ns() - *heard_ns) * 1e-6;
  if (delta.event == MapEvent::kLandmarksCreated) run_.keyframes.to_landmarks.Add(elapsed_ms);
  if (delta.event == MapEvent::kAdjusted) run_.keyframes.to_adjusted.Add(elapsed_ms);
}

void CollectorNode::OnFramePose(const Record& record) {
  const auto pose = Read<FramePose>(*record.bytes);
  if (!pose) return;
  frames_.Hear(*pose);
  KeepOnDisk(record);
}

/// Kept too: a collector that is started again does not hear it a second time.
void CollectorNode::OnSessionStart(const Record& record) {
  std::optional<SessionStart> start = ReadSessionStart(record.header, *record.bytes);
  if (!start) return;
  JoinSession(*start);
  if (start->camera_id == 0) session_start_ = std::move(start);
  KeepOnDisk(record);
}

void CollectorNode::OnMapReset(const Record& record) {
  const auto reset = Read<MapReset>(*record.bytes);
  if (!reset) return;
  CountReset(*reset);
  KeepOnDisk(record);
}

void CollectorNode::CountReset(const MapReset& reset) {
  ++run_.resets;
  if (reset.fate == MapReset::Fate::kDrop) proposals_.OnGivenUp(reset.map_id);
}

void CollectorNode::KeepOnDisk(const Record& record) {
  const std::optional<std::string> problem = kept_->Keep(record, context_.now_ns());
  if (problem && run_.disk_problems.empty()) run_.disk_problems.push_back(*problem);
}

/// What is in the journal, with all that came before it: a collector after this one goes on behind it.
void CollectorNode::AcceptWhatIsSafe() {
  if (!kept_->complete()) return;
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera)
    frontend_readers_[camera]->Accept(kept_->PositionOf(camera));
}

void CollectorNode::NotePositions() {
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera)
    kept_->NotePosition(camera, frontend_readers_[camera]->held());
  AcceptWhatIsSafe();
}

bool CollectorNode::AllTaken() const {
  return std::ranges::all_of(frontend_readers_, [](const auto& reader) { return reader->AllTaken(); });
}

bool CollectorNode::TakeFrontendRecord() {
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera) {
    if (TakeFrontendRecord(camera)) return true;
  }
  return false;
}

bool CollectorNode::TakeFrontendRecord(CameraId camera) {
  std::optional<Record> record = frontend_readers_[camera]->Take();
  if (!record || IsDoubtful(*record, frontend_readers_[camera].get())) return false;
  record->channel = SplitCamera(record->channel).channel;
  if (record->channel == channels::kSession) {
    OnSessionStart(*record);
  } else if (record->channel == channels::kFramePose) {
    OnFramePose(*record);
  } else if (record->channel == channels::kKeyframe) {
    if (const auto proposal = Read<KeyframeProposal>(*record->bytes)) {
      proposals_.OnProposal(proposal->id, proposal->map_id, record->version(), context_.now_ns());
      if (proposal->id.camera() == camera) proposals_.KeepRecord(proposal->id, record->bytes);
    }
  } else if (record->channel == channels::kInitialMap) {
    if (const auto proposal = Read<InitialMap>(*record->bytes)) {
      const auto propose = [&](KeyframeId id) {
        proposals_.OnProposal(id, proposal->map_id, record->version(), context_.now_ns());
      };
      propose(proposal->first.id);
      for (const InitialMap::View& view : proposal->between) propose(view.keyframe.id);
      propose(proposal->second.id);
    }
  } else if (record->channel == channels::kMapReset) {
    OnMapReset(*record);
  }
  const bool kept = record->channel == channels::kSession || record->channel == channels::kFramePose ||
                    record->channel == channels::kMapReset;
  if (kept) kept_->SetPosition(camera, record->version());
  AcceptWhatIsSafe();
  return true;
}

/// Behind what a collector that was before this one had accepted.
void CollectorNode::OpenJournal() {
  std::error_code error;
  std::filesystem::create_directories(collector_.out_dir, error);
  if (error) throw InputError(collector_.out_dir + ": cannot be made (" + error.message() + "); check --out");
  const bool begins = context_.fresh_system && !context_.resumed;
  if (const auto aside = SetFormerRunAside(collector_.out_dir, session_, begins))
    LogInfo("what another run has left is kept in {}", *aside);
  kept_.emplace(JournalPath(collector_.out_dir));
  bool is_first = true;  // of this run's collectors: what was told before it came, nobody else has
  if (begins) {
    kept_->journal().Begin(session_);
  } else {
    const auto take = [&](std::span<const uint8_t> record) {
      is_first = false;
      TakeJournaled(record);
    };
    kept_->journal().Resume(session_, take, [&](const std::string& note) {
      is_first = false;
      ReadNote(note);
    });
  }
  const auto note = [this](const std::string& text) { kept_->journal().AppendNote(text); };
  sequences_.NoteTo(note);
  proposals_.NoteTo(note);
  processes_.Begin(note, MeasureProcess(context_.pid), context_.now_ns());
  if (context_.resumed) kept_->ForgetPositions();  // the frontend that wrote it is gone, too
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera) {
    frontend_readers_.push_back(MakeReader(StreamId::kFrontend, kept_->PositionOf(camera), camera, is_first));
  }
}

/// A record of the journal that a collector before this one kept.
void CollectorNode::TakeJournaled(std::span<const uint8_t> record) {
  CameraId camera = 0;
  if (const auto pose = wire::Decode<FramePose>(record)) {
    frames_.Hear(*pose);
    camera = pose->camera_id;
  } else if (const auto reset = wire::Decode<MapReset>(record)) {
    CountReset(*reset);
    camera = reset->camera_id;
  } else if (auto start = wire::Decode<SessionStart>(record)) {
    camera = start->camera_id;
    if (camera == 0) session_start_ = std::move(start);
  }
  const std::optional<RecordHeader> header = ParseHeader(record);
  kept_->SetPosition(camera, {header->epoch, header->seq});
}

void CollectorNode::BeginCheckpoints() {
  Checkpointer::Options options;
  options.path = CheckpointPath(collector_.out_dir);
  options.now_ns = context_.now_ns;
  options.every_s = collector_.checkpoints ? options_.settings.Read<CheckpointOptions>().every_s : 0;
  if (collector_.checkpoints && context_.fresh_system && !context_.resumed) RemoveCheckpoints(options.path);
  checkpointer_ = std::make_unique<Checkpointer>(
      options, MakeUnwatchedThread(PlaybackMode::kRealtime, {.lets_others_go_first = true}),
      &kept_->journal());
}

/// It is whole, and no newer than the poses in the journal.
bool CollectorNode::MapMayBeKept() const {
  const Map& map = builder_->map();
  if (map.keyframes().empty() || MapHeld(*map_reader_).empty() || !kept_->complete()) return false;
  return map.progress().ended || frames_.ReachAsFarAs(map, session_);  // ended: no pose comes any more
}

void CollectorNode::KeepCheckpoint() {
  if (IsWritten()) return;
  checkpointer_->OnMap(builder_->map(), MapMayBeKept(), frames_.newest_stamp_ns(), session_start_);
  const std::string problem = checkpointer_->TakeProblem();
  if (problem.empty()) return;
  run_.disk_problems.push_back(problem);
  LogError("{}; the run goes on, with the checkpoint before it", problem);
}

int64_t CollectorNode::WorkDeadline() const {
  if (!builder_) return place_.deadline_ns(context_.now_ns());
  return checkpointer_ && !IsWritten() ? checkpointer_->deadline_ns() : INT64_MAX;
}

bool CollectorNode::TakeMapRecord() {
  const std::optional<Record> record = map_reader_->Take();
  if (!record) return false;
  if (record->begins_anew()) {
    builder_->ForgetMap();
    map_is_fresh_ = map_reader_->parent().empty();
  }
  const auto delta = ReadMapRecord(*record, map_reader_.get());
  if (!delta) return true;
  if (std::exchange(map_is_fresh_, false)) {
    const bool is_saved = delta->event == MapEvent::kSnapshot && !record->in_snapshot();
    proposals_.OnFreshMap(record->term().epoch, is_saved);
  }
  const std::vector<KeyframeId> loops_before = LoopsOf(builder_->map(), delta->about);
  builder_->OnMapDelta(*delta);
  if (!record->in_snapshot()) TimeKeyframe(*delta);
  if (delta->correction_id) run_.corrections.push_back(RecordOf(*delta, loops_before, builder_->map()));
  for (const MapId dropped : delta->dropped_maps) proposals_.OnDropped(dropped);
  AcceptMap();
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera) {
    const StreamPosition mapped = builder_->map().progress(camera).frontend;
    frontend_readers_[camera]->NoteWritten({mapped.epoch, mapped.seq});
    proposals_.OnMapped(camera, mapped);
  }
  return true;
}

/// The last map is acknowledged when it is on the disk: then whoever holds it may go, and this process may
/// still die before the results are written.
void CollectorNode::AcceptMap() {
  if (builder_->map().progress().ended && !EndedMapIsSafe()) return;
  map_reader_->AcceptTaken();
}

bool CollectorNode::EndedMapIsSafe() {
  const Map& map = builder_->map();
  if (IsWritten() || map.keyframes().empty() || !checkpointer_->enabled()) return true;
  if (ended_map_.safe_version == map.version()) return true;
  if (context_.now_ns() < try_again_ns_ || MapHeld(*map_reader_).empty()) return false;
  try_again_ns_ = context_.now_ns() + kTryAgainNs;
  checkpointer_->OnMap(map, false, frames_.newest_stamp_ns(), session_start_);
  const bool kept = MapMayBeKept() && checkpointer_->WriteLast(map, true, session_start_);
  if (!ended_map_.here_ns) ended_map_.here_ns = context_.now_ns();
  const bool too_late = context_.now_ns() - *ended_map_.here_ns > kRoomOnDiskNs;
  if (kept || too_late || !session_start_) ended_map_.safe_version = map.version();
  return ended_map_.safe_version == map.version();
}

bool CollectorNode::WorkOnce() {
  const bool any = TakeFrontendRecord() || TakeMapRecord();
  SayProgress();
  KeepCheckpoint();
  return any ? true : EndIfDone();
}

/// For how long a writer was not heard, as far as this process can know.
int64_t CollectorNode::SilentNs(const StreamReader& reader) const {
  return std::min(reader.silent_ns(context_.now_ns()), place_.AtWorkNs(context_.now_ns()));
}

/// They have said so; or the map says that they have, and they are gone; or the player has said it, and none
/// has been heard for long: then the results are made of what there is.
bool CollectorNode::FrontendsHaveEnded() {
  const auto all_silent = [this](int64_t ns) {
    return std::ranges::all_of(frontend_readers_, [&](const auto& r) { return SilentNs(*r) > ns; });
  };
  if (std::ranges::all_of(frontend_readers_, [](const auto& reader) { return reader->AtEnd(); })) return true;
  if (builder_->map().progress().ended && all_silent(kSilentAfterEndNs)) return true;
  if (!sequences_.AllEnded() || !all_silent(kNoFrontendNs)) return false;
  run_.end_problem = "the sequence had ended, and no frontend was heard for " +
                     std::to_string(kNoFrontendNs / 1'000'000'000) + " s: the map may lack its last changes";
  LogWarning("{}", run_.end_problem);
  return true;
}

/// Frontends that are not there, where the sequence of one has ended, or all of another one is here.
std::string CollectorNode::WaitsFor() const {
  if (!builder_ || ends_.of_frontends) return "";
  std::string missing;
  bool any_ended = sequences_.AnyEnded();
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera) {
    const StreamReader& reader = *frontend_readers_[camera];
    any_ended = any_ended || reader.AtEnd();
    if (!reader.AtEnd() && SilentNs(reader) > kGoneNs)
      missing += (missing.empty() ? "" : ", ") + OfCamera(roles::kFrontend, camera);
  }
  return any_ended ? missing : "";
}

bool CollectorNode::EndIfDone() {
  if (AllTaken()) NotePositions();
  if (GiveUpOnDisk()) return false;
  ends_.of_frontends = ends_.of_frontends || FrontendsHaveEnded();
  if (!ends_.of_frontends) return false;
  if (builder_->map().progress().ended) AcceptMap();
  const bool as_it_is = !run_.end_problem.empty();
  if (!as_it_is && !MapIsOver(builder_->map(), *map_reader_, kSilentAfterEndNs)) return false;
  if (!ends_.drained_ns) ends_.drained_ns = context_.now_ns();
  if (context_.now_ns() - *ends_.drained_ns < kLastStatusesNs) return false;
  WriteAtEnd();
  return false;
}

/// The sequence has ended, all poses are here, and the disk does not take them.
bool CollectorNode::GiveUpOnDisk() {
  if (kept_->complete() || !AllTaken()) {
    ends_.disk_refuses_since_ns.reset();
    return false;
  }
  if (!ends_.disk_refuses_since_ns) ends_.disk_refuses_since_ns = context_.now_ns();
  if (context_.now_ns() - *ends_.disk_refuses_since_ns < kRoomOnDiskNs) return true;
  const std::string lacks = std::to_string(kept_->journal().pending()) + " frame poses could not be written";
  run_.disk_problems.push_back(lacks);
  const std::string problem = WriteResultFiles(false);
  Exit(kExitInput, (problem.empty() ? kept_->journal().problem() : problem) + "; " + lacks +
                       "; make room, then resume the run");
  return true;
}

/// Where there is no room for the results, there may be soon.
void CollectorNode::WriteAtEnd() {
  if (context_.now_ns() < try_again_ns_) return;
  const std::string problem = WriteResultFiles(true);
  if (problem.empty()) return ExitAtEnd();
  try_again_ns_ = context_.now_ns() + kTryAgainNs;
  if (context_.now_ns() - *ends_.drained_ns > kRoomOnDiskNs) return Exit(kExitInput, problem);
  if (std::exchange(results_, Results::kDelayed) != Results::kDelayed) LogError("{}; tries again", problem);
}

void CollectorNode::ExitAtEnd() {
  const bool any_pose = std::any_of(builder_->frame_poses().begin(), builder_->frame_poses().end(),
                                    [](const auto& item) { return item.second.HasPose(); });
  std::string why = run_.cameras[0].frontend.head.reason;
  Exit(any_pose ? kExitDone : kExitNoFrame,
       any_pose ? "" : "no frame was tracked; the frontend's last word: " + why);
}

/// A frontend's reset that no mapper carried out leaves its map as it was: the frontend died as it said so,
/// and the next one went on in that map; or somebody forged it in the name of the dead.
bool CollectorNode::WasCarriedOut(const MapReset& reset) const {
  return proposals_.WasDropped(reset.map_id) || !builder_->map().HasMap(reset.map_id);
}

/// All that the results are made of, once. `ended`: the sequence has come to its end. One that is interrupted
/// can be resumed.
void CollectorNode::Gather(bool ended) {
  if (results_ != Results::kNone) return;
  results_ = Results::kGathered;
  if (ended) checkpointer_->Finish();
  if (!ended) checkpointer_->WriteLast(builder_->map(), MapMayBeKept(), session_start_);
  std::set<TrajectoryBuilder::FrameName> of_the_dead;
  kept_->journal().ForEach([&](std::span<const uint8_t> record) {
    if (const auto pose = wire::Decode<FramePose>(record)) {
      builder_->OnFramePose(*pose);
      const bool its_frontend_lives = ParseHeader(record)->epoch == kept_->PositionOf(pose->camera_id).epoch;
      if (!its_frontend_lives) of_the_dead.insert({pose->camera_id, pose->frame_index});
    }
    const auto reset = wire::Decode<MapReset>(record);
    if (reset && WasCarriedOut(*reset)) builder_->OnMapReset(*reset);
  });
  sequences_.Fill(builder_->frame_poses(), ended, &run_);
  run_.resumes = proposals_.times_all_died();
  CountOwn();
  builder_->BridgeLostKeyframes();
  builder_->JoinPosesOf(of_the_dead);
  proposals_.CountMissing([this](KeyframeId id) { return builder_->map().HasKnown(id); },
                          [this](CameraId camera) { return builder_->map().progress(camera).frontend.epoch; },
                          &run_.keyframes);
  if (kept_->journal().lost() > 0)
    run_.disk_problems.push_back(std::to_string(kept_->journal().lost()) +
                                 " frame poses were lost to a full disk");
}

/// Why not all of them could be written; empty: they are there.
std::string CollectorNode::WriteResultFiles(bool ended) {
  ServiceNotice().Stopping();  // of a run of hours they take minutes
  Gather(ended);
  const WrittenResults results = WriteResults(collector_.out_dir, run_, *builder_, collector_.for_people);
  if (!results.problem.empty() && ended) return results.problem;
  results_ = Results::kWritten;
  if (collector_.progress) std::fputs("\n", stderr);
  if (collector_.for_people) std::fputs(results.table.c_str(), stdout);
  std::fflush(stdout);
  if (!ended || !results.problem.empty()) return results.problem;
  kept_->journal().Remove();
  if (collector_.checkpoints) RemoveCheckpoints(CheckpointPath(collector_.out_dir));
  return "";
}

/// The run is interrupted.
void CollectorNode::Write() {
  if (IsWritten() || !builder_) return;
  const std::string problem = WriteResultFiles(false);
  if (!problem.empty()) Exit(kExitInput, problem);
}

void CollectorNode::Stop() {
  Write();
  Exit(0);
}

/// A camera has no end that is known.
std::string CollectorNode::OfTotal() const {
  const std::optional<int64_t> total = sequences_.NumFrames();
  return total ? " of " + std::to_string(*total) : "";
}

/// Into the log: where a first map stands, and every so many frames.
void CollectorNode::SayProgress() {
  constexpr int64_t kEveryFrames = 20;
  if (frames_.count() < due_.progress_frames || builder_->map().keyframes().empty()) return;
  due_.progress_frames = frames_.count() + kEveryFrames;
  LogInfo("frame {}{}, {} keyframes", frames_.count(), OfTotal(), builder_->map().keyframes().size());
}

void CollectorNode::PublishStatus() {
  if (!kept_ || IsWritten()) return;
  NotePositions();
  kept_->Retry(context_.now_ns());
  AcceptWhatIsSafe();
  RepeatWhatIsLeft();
  if (context_.now_ns() >= due_.sync_ns) {
    due_.sync_ns = context_.now_ns() + kSyncEveryNs;
    checkpointer_->SyncJournal();
  }
  CountOwn();
  if (context_.now_ns() >= due_.counters_ns) {
    due_.counters_ns = context_.now_ns() + kCountersEveryNs;
    processes_.NoteCounters();
  }
  if (!collector_.progress) return;
  std::fprintf(stderr, "\r%s: frame %lld%s, %s, %d static, %zu keyframes, %zu landmarks   ",
               run_.cameras[0].sequence.c_str(), static_cast<long long>(frames_.count()), OfTotal().c_str(),
               run_.cameras[0].frontend.inliers > 0 ? "tracking" : "waiting",
               run_.cameras[0].frontend.inliers, builder_->map().keyframes().size(),
               builder_->map().num_landmarks());
  std::fflush(stderr);
}

}  // namespace dmslam
