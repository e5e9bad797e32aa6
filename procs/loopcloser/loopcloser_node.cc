#include "loopcloser/loopcloser_node.h"

#include <utility>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/session_check.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/wire/streams.h"
#include "loopcloser/make_loopcloser.h"

namespace dmslam {

std::unique_ptr<Node> MakeLoopcloser(NodeContext context, NodeOptions options,
                                     std::shared_ptr<const Vocabulary> vocabulary) {
  return std::make_unique<LoopcloserNode>(std::move(context), std::move(options), std::move(vocabulary));
}

LoopcloserNode::LoopcloserNode(NodeContext context, NodeOptions options,
                               std::shared_ptr<const Vocabulary> vocabulary)
    : StreamNode(std::move(context), std::move(options), roles::kLoopCloser),
      vocabulary_(std::move(vocabulary)) {
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera)
    Listen({channels::kSession, channels::kSessionAgain}, camera);
}

/// The frontend's word on its settings and its vocabulary. Its stream is not read here.
void LoopcloserNode::OnMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  const std::optional<RecordHeader> header = ParseHeader(bytes);
  for (CameraId camera = 0; header && camera < options_.NumCameras(); ++camera) {
    if (!IsIntact(ChannelOfCamera(channel, camera), bytes)) continue;
    const std::optional<SessionStart> start = ReadSessionStart(*header, bytes);
    if (start && !IsForeign(start->session)) sessions_.Hear(camera, header->epoch, *start, context_.now_ns());
    return;
  }
  CountMalformed(channel, "its checksum does not fit");
}

/// On the core's map, which rests.
void LoopcloserNode::JoinMappedSessions() {
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera) {
    const auto start = sessions_.Mapped(camera, core_->map().progress(camera).frontend.epoch);
    if (start) JoinSession(*start);
  }
}

std::string LoopcloserNode::WhyMisfits(const SessionStart& start) const {
  return WhyMisfit(start, options_.settings,
                   vocabulary_ ? std::optional(vocabulary_->checksum()) : std::nullopt);
}

LoopcloserNode::~LoopcloserNode() { stop_ = true; }

void LoopcloserNode::Begin(const CameraInfo& info) {
  const Settings& settings = options_.settings;
  work_ = MakeCoreThread(info.mode, {.lets_others_go_first = true});
  core_ = std::make_unique<LoopcloserCore>(settings.Read<LoopcloserOptions>(), info.camera,
                                           settings.Read<Pyramid>(), settings.Read<RunOptions>().seed,
                                           vocabulary_);
  core_->KeepFeaturesIn(feature_store_);
  if (info.mode == PlaybackMode::kRealtime) {
    core_->SetInterrupt([this] {
      work_->Beat();
      return stop_.load();
    });
  }
  core_->SetOnStep([this](LoopcloserCore::Step step) { OnStep(step); });
  map_reader_ = MakeReader(StreamId::kMap);
  ServeReplica(
      &core_->map(), [this] { return MapHeld(*map_reader_); }, [this] { return work_->Idle(); });
  WantWriter({StreamId::kLoopCloser, ReadersOf(StreamId::kLoopCloser, 1), {}, nullptr});
}

/// On the core.
void LoopcloserNode::OnStep(LoopcloserCore::Step step) {
  using Step = LoopcloserCore::Step;
  const int64_t now_ns = context_.now_ns();
  if (step == Step::kNamePlaces) query_began_ns_ = now_ns;
  if (step == Step::kVerify)
    work_->Report([this, ms = static_cast<double>(now_ns - query_began_ns_) * 1e-6] { query_.Add(ms); });
  if (step == Step::kCorrect)
    work_->Report([this] { core_status_.state = LoopcloserStatus::State::kCorrecting; });
}

/// On the core.
void LoopcloserNode::Answer(KeyframeId keyframe) {
  const int64_t begin_ns = context_.now_ns();
  const LoopAnswer answer = core_->Check(keyframe);
  const double ms = static_cast<double>(context_.now_ns() - begin_ns) * 1e-6;
  work_->Report([this, answer, ms] {
    PublishChange(answer);
    check_.Add(ms);
  });
}

bool LoopcloserNode::WorkOnce() {
  if (!work_->Idle()) return false;
  LetSnapshotBegin();
  JoinMappedSessions();
  const std::optional<Record> record = map_reader_->Take();
  if (!record) return EndIfDone();
  WorkOn(*record);
  return work_->Idle();
}

void LoopcloserNode::WorkOn(const Record& record) {
  const std::optional<MapDelta> delta = ReadMapRecord(record, map_reader_.get());
  work_->Post([this, delta, begins_anew = record.begins_anew(), ends_snapshot = record.ends_snapshot()] {
    if (begins_anew) core_->ForgetMap();
    if (delta) core_->ApplyMapDelta(*delta);
    const bool asks = delta && (delta->event == MapEvent::kMapped || delta->event == MapEvent::kMapStarted);
    if (asks) Answer(*delta->about);
    // The newest keyframe of a snapshot (of each camera) may be waiting for an answer that the one before
    // this process did not give.
    const bool may_wait = ends_snapshot && !core_->map().progress().ended;
    for (CameraId camera = 0; may_wait && camera < options_.NumCameras(); ++camera) {
      const Keyframe* newest = core_->map().NewestKeyframeOf(camera);
      if (newest != nullptr) Answer(newest->id);
    }
    work_->Report([this, status = CoreStatus(), whole = delta.has_value()] {
      core_status_ = status;
      if (whole) map_reader_->AcceptTaken();
    });
  });
}

void LoopcloserNode::Stop() {
  stop_ = true;
  if (work_ && !stopping_) work_->Finish();
  StreamNode::Stop();
}

bool LoopcloserNode::EndIfDone() {
  if (!core_->map().progress().ended) return false;
  if (!ended_) {
    ended_ = true;
    PublishStatus();
    writer_->Complete(context_.now_ns());
  }
  if (NobodyNeedsTheMap(core_->map(), *map_reader_)) Stop();
  return false;
}

/// The state, and for whom it waits in it.
std::pair<LoopcloserStatus::State, std::string> LoopcloserNode::StateAndReason() const {
  using State = LoopcloserStatus::State;
  if (!core_) return {State::kStarting, "waiting for a camera"};
  if (ended_) return {State::kDone, ""};
  if (!writer_) return {State::kWaiting, "asks who else closes loops"};
  if (core_status_.state == State::kCorrecting) return {State::kCorrecting, ""};
  if (!map_reader_->writer_present(context_.now_ns())) return {State::kWaiting, "waiting for a mapper"};
  return {State::kWatching, ""};
}

std::string LoopcloserNode::WaitsFor() const {
  const bool waits = core_ && !ended_ && writer_ && !map_reader_->writer_present(context_.now_ns());
  return waits ? roles::kMapper : "";
}

void LoopcloserNode::PublishStatus() {
  if (core_ && work_->Idle()) core_status_ = CoreStatus();
  LoopcloserStatus status = core_status_;
  const auto [state, reason] = StateAndReason();
  status.head = MakeStatusHead(reason, {map_reader_.get()});
  status.state = state;
  if (map_reader_) status.keyframe_queue = static_cast<int32_t>(map_reader_->backlog());
  if (vocabulary_) status.vocabulary_checksum = vocabulary_->checksum();
  status.query_p50_ms = query_.Quantile(0.5);
  status.query_p95_ms = query_.Quantile(0.95);
  status.check_p50_ms = check_.Quantile(0.5);
  status.check_p95_ms = check_.Quantile(0.95);
  PublishLoose(status);
}

/// On the core, or while it is idle.
LoopcloserStatus LoopcloserNode::CoreStatus() const {
  LoopcloserStatus status;
  const LoopcloserCounters& counters = core_->counters();
  if (core_->AwaitsMapper()) status.state = LoopcloserStatus::State::kCorrecting;
  status.replica_version = static_cast<int64_t>(core_->map().version());
  status.indexed_keyframes = static_cast<int32_t>(core_->map().keyframes().size());
  status.keyframes_checked = static_cast<int64_t>(counters.checked);
  status.candidates = static_cast<int64_t>(counters.candidates);
  status.refused_consistency = static_cast<int64_t>(counters.refused_consistency);
  status.refused_geometry = static_cast<int64_t>(counters.refused_geometry);
  status.loops_closed = static_cast<int64_t>(counters.loops);
  status.global_adjustments = static_cast<int64_t>(counters.global_adjustments);
  status.last_keyframe = counters.last_keyframe;
  status.last_loop_keyframe = counters.last_loop_keyframe;
  return status;
}

}  // namespace dmslam
