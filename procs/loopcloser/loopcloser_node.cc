#include "loopcloser/loopcloser_node.h"

#include <utility>

#include "dmslam/settings/run_options.h"

namespace dmslam {

LoopcloserNode::LoopcloserNode(NodeContext context, NodeOptions options,
                               std::shared_ptr<const Vocabulary> vocabulary)
    : StreamNode(std::move(context), std::move(options), "loopcloser"), vocabulary_(std::move(vocabulary)) {
  Listen({channels::kSession});
}

/// The frontend's word on its settings and its vocabulary. Its stream is not read here; who comes later has
/// the same settings as the one before.
void LoopcloserNode::OnMessage(const std::string&, std::span<const uint8_t> bytes) {
  const std::optional<SessionStart> start = Read<SessionStart>(bytes);
  if (start && !IsForeign(start->session)) JoinsSession(*start, vocabulary_ ? vocabulary_->checksum() : 0);
}

void LoopcloserNode::Begin(const CameraInfo& info) {
  const Settings& settings = options_.settings;
  core_ = std::make_unique<LoopcloserCore>(settings.Read<LoopcloserOptions>(), info.camera,
                                           settings.Read<Pyramid>(), settings.Read<RunOptions>().seed,
                                           vocabulary_);
  if (info.mode == PlaybackMode::kRealtime) core_->SetPump([this] { PumpWithinWork(); });
  map_reader_ = MakeReader(StreamId::kMap, "MAPPER", {channels::kMap});
  ServeReplica(&core_->map(), [this] { return map_reader_->held(); });
  WantWriter({StreamId::kLoopCloser, {"mapper"}, {}, nullptr});
}

void LoopcloserNode::Apply(const MapDelta& delta) {
  core_->ApplyMapDelta(delta);
  if (delta.event == MapEvent::kMapped || delta.event == MapEvent::kMapStarted) Answer(delta.about);
}

void LoopcloserNode::Answer(KeyframeId keyframe) {
  const int64_t begin_ns = context_.now_ns();
  PublishRecord(core_->Check(keyframe));
  check_.Add(static_cast<double>(context_.now_ns() - begin_ns) * 1e-6);
}

bool LoopcloserNode::WorkOnce() {
  const std::optional<Record> record = map_reader_->Take();
  if (!record) return EndIfDone();
  if (record->begins_anew()) core_->ForgetMap();
  if (const auto delta = Read<MapDelta>(*record->bytes)) Apply(*delta);
  // The newest keyframe of a snapshot may be waiting for an answer that the one before this process did not
  // give.
  const Map& map = core_->map();
  const bool may_wait = record->ends_snapshot() && !map.keyframes().empty() && !map.progress().ended;
  if (may_wait) Answer(map.keyframes().rbegin()->first);
  map_reader_->AcceptTaken();
  return true;
}

bool LoopcloserNode::EndIfDone() {
  if (!core_->map().progress().ended) return false;
  if (!ended_) {
    ended_ = true;
    PublishStatus();
    writer_->Complete(context_.now_ns());
  }
  if (MapIsOver(core_->map(), *map_reader_)) Stop();
  return false;
}

void LoopcloserNode::PublishStatus() {
  LoopcloserStatus status;
  status.head = MakeStatusHead(core_ ? "" : "waiting for a camera", {map_reader_.get()});
  status.state = core_ ? LoopcloserStatus::State::kWatching : LoopcloserStatus::State::kStarting;
  status.vocabulary_checksum = vocabulary_ ? vocabulary_->checksum() : 0;
  status.check_p50_ms = check_.Quantile(0.5);
  status.check_p95_ms = check_.Quantile(0.95);
  if (core_) {
    const LoopcloserCounters& counters = core_->counters();
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
  }
  PublishLoose(status);
}

}  // namespace dmslam
