#include "frontend/frontend_node.h"

#include <utility>
#include <variant>

#include "dmslam/console/log.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/runtime/session_check.h"
#include "dmslam/settings/frontend_setup.h"
#include "dmslam/wire/streams.h"
#include "frontend/background_search.h"

namespace dmslam {
namespace {

constexpr double kMaxBehindS = 2.0;

}  // namespace

std::unique_ptr<Node> MakeFrontend(NodeContext context, const NodeOptions& options, FrontendExtras extras) {
  return std::make_unique<FrontendNode>(std::move(context), options, std::move(extras));
}

FrontendNode::FrontendNode(NodeContext context, const NodeOptions& options, FrontendExtras extras)
    : StreamNode(std::move(context), options, OfCamera(roles::kFrontend, options.camera_id)),
      run_(options_.settings.Read<RunOptions>()),
      extras_(std::move(extras)),
      end_(options_.HasPeer(roles::kMapper), options.camera_id) {
  Listen({channels::kFrame, channels::kEndOfSequence, channels::kGroundTruthPose, channels::kKeyframe});
}

void FrontendNode::Begin(const CameraInfo& info) {
  const bool lockstep = info.mode == PlaybackMode::kLockstep;
  frames_.SetMode(info.mode);
  if (lockstep && options_.NumCameras() > 1) turns_ = CameraTurns(options_.camera_id);
  tracking_.emplace(FrameTracking::Options{session_, info.camera.width_px, info.camera.height_px,
                                           extras_.picture_dir, extras_.picture_every, context_.wall_us});
  FrontendCore::Setup setup = FrontendSetup(options_.settings, info.camera, extras_.vocabulary);
  setup.feature_store = feature_store_;
  setup.session = session_;
  setup.camera_id = options_.camera_id;
  setup.in_saved_map = run_.saved_map;
  setup.localize_only = run_.localize_only;
  if (!lockstep && context_.watch) {
    setup.run_search = [sign = search_sign_](FirstMapSearch search) {
      return InBackground(std::move(search), sign);
    };
  }
  setup.catch_up_in_portions = !lockstep;
  remembered_.emplace(extras_.frame_memory, session_, options_.camera_id);
  if (!extras_.frame_memory.empty())
    setup.remember = [this](const RememberedFrame& frame) { remembered_->Add(frame); };
  work_ = std::make_unique<FrontendWork>(setup, MakeCoreThread(info.mode));
  left_.emplace(session_, options_.camera_id);
  map_reader_ = MakeReader(StreamId::kMap);
  ServeReplica(
      &core().map(), [this] { return HandOverVersion(); },
      [this] { return work_->Idle() && held_.IsUpToDate(); });
  WantWriter({StreamId::kFrontend, ReadersOf(StreamId::kFrontend, 1), {}, nullptr});
}

/// Into a running system a frontend comes with the map; where nobody has one it begins with a first.
bool FrontendNode::ReadyToWrite() {
  if (context_.fresh_system && !context_.resumed) return true;
  if (!map_reader_->term().valid()) return !options_.HasPeer(roles::kMapper);
  if (!work_->Idle()) return false;
  TakeMapRecords();
  ApplyHeldRecords(held_.NumReady(true), true);
  if (!work_->Idle()) return false;
  const bool caught_up = map_reader_->state() == StreamReader::State::kFollowing &&
                         map_reader_->backlog() == 0 && held_.empty() && !MapComesInParts() &&
                         !(context_.resumed && core().map().keyframes().empty());
  if (!caught_up) return false;
  const Map& map = core().map();
  if (map.progress().ended) {
    // Not before the mapper knows that all of it has come: it would wait for who has left.
    if (NobodyNeedsTheMap(map, *map_reader_)) Exit(0);
    return false;
  }
  if (GivesWay()) return false;
  core().Resume();
  if (map.keyframes().empty()) return true;
  const Keyframe* newest = map.NewestKeyframeOf(options_.camera_id);
  if (newest != nullptr && newest->id.frame_index() > 0) frames_.GoOnBehind(newest->id.frame_index() - 1);
  LogInfo("frontend: has the map of {} keyframes and goes on in it", map.keyframes().size());
  return true;
}

void FrontendNode::OnOtherCamera(const CameraInfo& info) { other_models_.Hear(info, camera_info_->camera); }

/// True: a camera of another model was here first, and this process ends.
bool FrontendNode::GivesWay() {
  const std::optional<CameraId> first = other_models_.GivesWayTo(core().map(), options_.camera_id);
  if (!first) return false;
  Exit(kExitMisfit, "camera " + std::to_string(options_.camera_id) + " is another model than camera " +
                        std::to_string(*first) +
                        "; all cameras of a session need the same calibration (--camera), or to be told by "
                        "it (dmslam-player --as-camera)");
  return true;
}

/// Nothing that was taken is left behind: a mapper that continued without it would find this reader ahead.
Version FrontendNode::HandOverVersion() {
  if (!work_->Idle() || core().NeedsMapUnchanged()) return held_.promised();
  TakeMapRecords();
  ApplyHeldRecords(held_.NumReady(true), true);
  return held_.promised();
}

void FrontendNode::OnWriterOpen() {
  left_->BeginTerm(writer_->term(), context_.now_ns() + kBackAfterDeathNs);
  session_start_ = MakeSessionStart();
  PublishRecord(*session_start_);
}

SessionStart FrontendNode::MakeSessionStart() const {
  SessionStart start;
  start.session = session_;
  start.camera_id = options_.camera_id;
  if (frames_.waiting()) start.first_stamp_ns = frames_.waiting()->frame.stamp_ns;
  start.seed = run_.seed;
  start.configuration_hash = options_.settings.Hash();
  if (extras_.vocabulary) start.vocabulary_checksum = extras_.vocabulary->checksum();
  start.mode = camera_info_->mode;
  start.camera = camera_info_->camera;
  start.pyramid = options_.settings.Read<Pyramid>();
  start.sequence = camera_info_->sequence;
  start.profile = options_.settings.profile();
  return start;
}

/// On a channel of its own: who reads the stream has it from there.
void FrontendNode::SaySessionAgain() {
  if (!session_start_) return;
  Bytes bytes = wire::Encode(*session_start_);
  const std::string channel = ChannelOfCamera(channels::kSessionAgain, options_.camera_id);
  Seal(writer_->HeaderOf(1), channel, bytes);
  context_.bus->Publish({channel, std::make_shared<const Bytes>(std::move(bytes)), false});
}

void FrontendNode::OnMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  if (channel == channels::kFrame) OnFrame(bytes);
  if (channel == channels::kEndOfSequence) OnEndOfSequence(bytes);
  if (channel == channels::kKeyframe && left_) left_->Hear(bytes, context_.now_ns());
  if (channel != channels::kGroundTruthPose) return;
  const std::optional<GroundTruthPose> truth = Read<GroundTruthPose>(bytes);
  if (truth && !IsForeignFrame(truth->session)) pose_.OnTruth(*truth);
}

void FrontendNode::OnFrame(std::span<const uint8_t> bytes) {
  std::optional<Frame> frame = Read<Frame>(bytes);
  if (!frame) return;
  if (!camera_info_) return ConfirmCamera(frame->session);  // it comes again, or it is too early
  if (IsForeignFrame(frame->session)) return;
  if (end_.Is(SequenceEnd::Phase::kDone) && frames_.IsNew(*frame)) return PublishSequenceDone();
  using Verdict = IncomingFrames::Verdict;
  switch (frames_.Hear({std::move(*frame), context_.wall_us()}, context_.now_ns())) {
    case Verdict::kWaits:
    case Verdict::kKnown:
      return;
    case Verdict::kOld:  // a repeat, or a player that was started again
      return PublishLoose(DoneWithNewest());
    case Verdict::kOutOfRange:
      return CountMalformed(channels::kFrame,
                            "its number is beyond what a session can hold; begin a new one");
    case Verdict::kFarAhead:
      return CountMalformed(channels::kFrame,
                            "it is far ahead of those that came; taken when others go on there");
  }
}

FrameDone FrontendNode::DoneWithNewest() const {
  const IncomingFrames::Newest& newest = *frames_.newest();
  return {session_, newest.index, newest.stamp_ns.value_or(0)};
}

void FrontendNode::OnEndOfSequence(std::span<const uint8_t> bytes) {
  const std::optional<EndOfSequence> end = Read<EndOfSequence>(bytes);
  if (!end || !camera_info_ || IsForeignFrame(end->session)) return;
  if (end_.Is(SequenceEnd::Phase::kDone)) PublishSequenceDone();
  frames_.OnEnd(*end, context_.now_ns());
}

/// Before this frontend proposes anything itself.
bool FrontendNode::ProposeWhatWasLeft() {
  using Phase = SequenceEnd::Phase;
  if (!end_.Is(Phase::kPlaying) && !end_.Is(Phase::kGrowingBack)) return false;
  const auto proposal = left_->Next(core().map());
  if (!proposal) return false;
  LogInfo("frontend: the one before it left behind the keyframe of frame {}; it is proposed again",
          proposal->id.frame_index());
  unaccepted_.OnPublished(PublishRecord(*proposal));
  return true;
}

// ---- The map ----

void FrontendNode::TakeMapRecords() {
  while (std::optional<Record> record = map_reader_->Take()) {
    if (record->begins_anew()) held_.BeginAnew();
    auto delta = ReadMapRecord(*record, map_reader_.get());
    if (delta)
      held_.Add(std::move(*delta), record->version(), record->in_snapshot(), record->ends_snapshot());
  }
}

/// Where the maps have been adjusted, frames are refined before the next record; `at_once`: within this job,
/// else one by one in jobs of their own.
void FrontendNode::ApplyHeldRecords(size_t count, bool at_once) {
  if (count == 0) return;
  held_.Promise(count);
  work_->Post([this, count, at_once] {
    size_t applied = 0;
    for (; applied < count && (at_once || !core().IsRefining()); ++applied) {
      const HeldRecords::Held& held = held_[applied];
      if (held.begins_anew) core().ForgetMap();
      core().ApplyMapDelta(held.delta);
      work_->Beat();
    }
    work_->Report([this, applied] { OnApplied(applied); });
  });
}

/// Only what is applied is accepted: what is held back could not be handed over.
void FrontendNode::OnApplied(size_t count) {
  for (; count > 0; --count) {
    const HeldRecords::Held held = held_.PopApplied();
    const MapProgress& progress = held.delta.progress;
    if (held.delta.event == MapEvent::kRequestDone)
      end_.OnAnswer({progress.camera, progress.frontend.epoch, *held.delta.request});
    if (held.delta.event == MapEvent::kTurn) turns_.OnTurn(*held.delta.about);
  }
  map_reader_->Accept(held_.applied());
}

bool FrontendNode::HoldsBack() const { return InLockstep() && core().awaited(); }

/// Nothing can be done before a saved map has come.
bool FrontendNode::AwaitsSavedMap() const { return run_.saved_map && core().map().keyframes().empty(); }

/// In lock-step the first frame waits until all follow who are to keep what is told of it: it would die with
/// this process.
bool FrontendNode::AwaitsFirstReaders() const {
  return InLockstep() && timing_.frames() == 0 && !AwaitedReaders().empty();
}

bool FrontendNode::HasTurn(uint32_t frame_index, const TurnTime& time) {
  if (turns_.Has(frame_index)) return true;
  if (const auto request = turns_.Ask(frame_index, time, map_reader_->term())) PublishRecord(*request);
  return false;
}

bool FrontendNode::WorkOnce() {
  if (frames_.IsOver(context_.now_ns())) end_.OnEndHeard();
  if (!work_->Idle() || GivesWay()) return false;
  LetSnapshotBegin();
  if (core().IsRefining()) return Refine();
  if (!core().NeedsMapUnchanged()) {
    TakeMapRecords();
    ApplyHeldRecords(held_.NumReady(!InLockstep() || end_.AppliesAllRecords()), false);
    if (!work_->Idle()) return false;
  }
  if (core().map().progress().ended && !end_.Is(SequenceEnd::Phase::kDone)) LeaveEndedMap();
  if (end_.HandsOver()) return WorkAtEnd();
  if (end_.Is(SequenceEnd::Phase::kDone)) {
    if (!options_.HasPeer(roles::kMapper) || NobodyNeedsTheMap(core().map(), *map_reader_)) Stop();
    return false;
  }
  if (HoldsBack() || AwaitsSavedMap()) return false;
  if (ProposeWhatWasLeft()) return true;
  if (frames_.in_work()) FinishFrame();
  if (frames_.waiting() && !FallsBehind()) return MayTrackWaiting() && TrackWaiting();
  if (core().IsBehind()) return (hurries_ || core().MayCatchUp()) && CatchUp();
  return WorkAtEnd();
}

int64_t FrontendNode::WorkDeadline() const {
  using Phase = SequenceEnd::Phase;
  if (!work_ || !work_->Idle()) return INT64_MAX;
  if (core().IsRefining()) return 0;
  if (end_.Is(Phase::kTelling)) return last_words_.next_portion_ns();
  if (stopping_ || AwaitsSavedMap() || turns_.Waits()) return INT64_MAX;
  const bool grows = end_.Is(Phase::kGrowingBack) && !core().awaited();
  const bool hands_over = end_.HandsOver() && end_.Is(Phase::kAwaitingAdjustedMap);
  return grows || hands_over || end_.Is(Phase::kRefining) || end_.Is(Phase::kJoining) ? 0 : INT64_MAX;
}

// ---- When the sequence has ended ----

/// A portion in a turn: signals and elections are for between. True: the next can begin at once.
bool FrontendNode::WorkAtEnd() {
  using Phase = SequenceEnd::Phase;
  const Phase phase = end_.phase();
  if (phase == Phase::kPlaying || phase == Phase::kHandedOver) return false;
  if (phase >= Phase::kTelling) return TellLastPoses();
  if (phase == Phase::kGrowingBack && !HasTurn(CameraTurns::kTheEnd, TurnTime::AtTheEnd())) return false;
  AskForAdjustedMaps();
  return !end_.Waits(core()) && WorkOn(phase);
}

/// True: the phase is done.
bool FrontendNode::WorkOn(SequenceEnd::Phase phase) {
  work_->Run([this, phase] {
    remembered_->TakeOver(&core());
    const auto worked = std::make_shared<const SequenceEnd::Worked>(SequenceEnd::Work(phase, &core()));
    work_->Report([this, phase, worked] { OnWorked(phase, *worked); });
  });
  return work_->Idle() && !end_.Is(phase) && !end_.Is(SequenceEnd::Phase::kTelling);
}

void FrontendNode::OnWorked(SequenceEnd::Phase phase, const SequenceEnd::Worked& worked) {
  using Phase = SequenceEnd::Phase;
  end_.OnWorked(worked.is_done);
  if (phase == Phase::kGrowingBack) Publish(worked.output.events);
  if (phase == Phase::kRefining && worked.is_done)
    ReturnFreeMemory();  // the features that were kept are not needed now
  if (phase == Phase::kJoining && worked.is_done) last_words_ = LastWords(worked.output);
}

/// One frame, as soon as its map is adjusted: it takes a while.
bool FrontendNode::Refine() {
  return work_->Run([this] { core().RefineNext(); }) && !core().IsRefining();
}

/// All of them as a whole, so that the last poses are told in the best map.
void FrontendNode::AskForAdjustedMaps() {
  const std::optional<int64_t> newest_ns = frames_.newest() ? frames_.newest()->stamp_ns : std::nullopt;
  const auto request = end_.Ask(core().map(), context_.now_ns(), newest_ns, writer_->term().epoch);
  if (request) PublishRecord(*request);
}

/// Who waits for this stream's end to let go of the map need not wait for it.
void FrontendNode::LeaveEndedMap() {
  end_.OnMapEnded();
  PublishStatus();
  writer_->Complete(context_.now_ns());
}

bool FrontendNode::TellLastPoses() {
  Publish(last_words_.NextPortion(context_.now_ns()));
  if (!last_words_.AreTold()) return false;
  end_.OnTold();
  if (end_.HandsOver()) return true;
  remembered_->Remove();
  PublishSequenceDone();
  PublishStatus();
  writer_->Complete(context_.now_ns());
  return true;
}

void FrontendNode::PublishSequenceDone() {
  PublishLoose(SequenceDone{context_.wall_us(), session_, 0, timing_.frames(), frames_.skipped()});
}

// ---- While it goes on ----

/// Catching up has the time between two images. Where that is not enough it comes first until all is done,
/// and images are skipped.
bool FrontendNode::FallsBehind() {
  hurries_ = core().IsBehind() && (hurries_ || core().seconds_behind() >= kMaxBehindS);
  return hurries_;
}

bool FrontendNode::CatchUp() {
  return work_->Run([this] { work_->Report([this, output = core().CatchUp()] { Publish(output.events); }); });
}

bool FrontendNode::MayTrackWaiting() {
  const Frame& next = frames_.waiting()->frame;
  return !AwaitsFirstReaders() && HasTurn(next.frame_index, TurnTime::Of(next.stamp_ns));
}

bool FrontendNode::TrackWaiting() {
  const auto received = std::make_shared<const ReceivedFrame>(frames_.Take());
  pose_.OnFrame(received->frame.stamp_ns);
  unaccepted_.OnAccepted(writer_->AcknowledgedBy(roles::kMapper));
  return work_->Run([this, received, withheld = unaccepted_.AreTooMany()] { Track(*received, withheld); });
}

/// On the core.
void FrontendNode::Track(const ReceivedFrame& received, bool withheld) {
  const auto result = std::make_shared<const std::variant<Tracked, ImageProblem>>(
      tracking_->Track(received, withheld, &core()));
  if (std::holds_alternative<ImageProblem>(*result))
    return work_->Report([this, result] { OnRefused(std::get<ImageProblem>(*result)); });
  const auto& tracked = std::get<Tracked>(*result);
  work_->Report([this, result] { PublishTracked(std::get<Tracked>(*result)); });
  tracking_->DrawPicture(tracked.output, core().frame());
}

void FrontendNode::OnRefused(const ImageProblem& problem) {
  switch (refused_.Count(problem, timing_.frames() > 0)) {
    case RefusedImages::Consequence::kOtherCamera:
      return Exit(kExitMisfit, problem.text);
    case RefusedImages::Consequence::kWarn:
      return LogWarning("frontend: {} (further ones are only counted)", problem.text);
    case RefusedImages::Consequence::kNone:
      return;
  }
}

void FrontendNode::Publish(const std::vector<FrontendEvent>& events) {
  for (const FrontendEvent& event : events) {
    const int64_t seq = std::visit([this](const auto& record) { return PublishRecord(record); }, event);
    if (std::holds_alternative<KeyframeProposal>(event) || std::holds_alternative<InitialMap>(event))
      unaccepted_.OnPublished(seq);
    pose_.OnEvent(event);
  }
}

void FrontendNode::PublishTracked(const Tracked& tracked) {
  Publish(tracked.output.events);
  endpoint_.Advance();  // before all that may come late
  FrameTrace trace = tracked.trace;
  trace.published_us = context_.wall_us();
  timing_.Add(trace, tracked.extract_ms);
  PublishLoose(pose_.OdometryOf(tracked.odometry, trace));
  PublishLoose(trace);
  PublishLoose(pose_.ViewOf(trace));
  PublishLoose(tracked.features, options_.link == Link::kLan);
}

void FrontendNode::FinishFrame() {
  frames_.Settle();
  PublishLoose(DoneWithNewest());
}

// ---- Status ----

void FrontendNode::PublishStatus() {
  SaySessionAgain();
  FrontendStatus status = work_ ? work_->Status() : FrontendStatus();
  status.head = MakeStatusHead(work_ ? pose_.reason() : "waiting for a camera", {map_reader_.get()});
  status.head.health.dropped_malformed += refused_.bad();
  if (IsHeldUp()) status.head.health.waiting_for = roles::kMapper;
  frames_.Fill(&status);
  timing_.TakeStatus(&status);
  pose_.Fill(&status);
  status.keyframes_unacknowledged = static_cast<int32_t>(unaccepted_.size());
  PublishLoose(status);
}

std::string FrontendNode::WaitsFor() const {
  if (!work_ || stopping_ || end_.Is(SequenceEnd::Phase::kDone)) return "";
  if (writer_ && AwaitsFirstReaders()) return AwaitedReaders();
  const bool lacks_mapper =
      options_.HasPeer(roles::kMapper) && !map_reader_->writer_present(context_.now_ns());
  const bool needs_it = !writer_ || !end_.Is(SequenceEnd::Phase::kPlaying);
  return lacks_mapper && needs_it ? roles::kMapper : "";
}

/// Waits for the mapper before it can go on.
bool FrontendNode::IsHeldUp() const {
  return work_ != nullptr && work_->Idle() &&
         (HoldsBack() || AwaitsSavedMap() || (end_.Is(SequenceEnd::Phase::kGrowingBack) && core().awaited()));
}

bool FrontendNode::Hangs(int64_t now_ns, int64_t longest_ns) const {
  return StreamNode::Hangs(now_ns, longest_ns) || search_sign_->Hangs(now_ns, longest_ns);
}

/// In real time the camera waits for nobody: the collector joins the poses as they were told.
bool FrontendNode::MayHandOver() {
  using Phase = SequenceEnd::Phase;
  if (!InLockstep() || core().map().keyframes().empty()) return true;
  end_.OnHandOver();
  return end_.Is(Phase::kHandedOver) || end_.Is(Phase::kDone);
}

/// A core in work is waited for.
void FrontendNode::Stop() {
  if (work_ && !stopping_) work_->Finish();
  StreamNode::Stop();
}

}  // namespace dmslam
