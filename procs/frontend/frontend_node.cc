#include "frontend/frontend_node.h"

#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/recording/recorded_frames.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/runtime/session_check.h"
#include "dmslam/settings/frontend_setup.h"
#include "dmslam/util/check.h"
#include "frontend/background_search.h"
#include "frontend/pictures.h"

namespace dmslam {
namespace {

constexpr int kMaxUnacceptedKeyframes = 64;
constexpr size_t kMaxBehind = 15;  // frames: half a second

}  // namespace

FrontendNode::FrontendNode(NodeContext context, NodeOptions options, Extras extras)
    : StreamNode(std::move(context), std::move(options), "frontend"),
      run_(options_.settings.Read<RunOptions>()),
      extras_(std::move(extras)) {
  Listen({channels::kFrame, channels::kEndOfSequence, channels::kGroundTruthPose});
}

void FrontendNode::Begin(const CameraInfo& info) {
  lockstep_ = info.mode == PlaybackMode::kLockstep;
  FrontendCore::Setup setup = FrontendSetup(options_.settings, info.camera, extras_.vocabulary);
  setup.session = session_;
  setup.in_saved_map = run_.saved_map;
  setup.localize_only = run_.localize_only;
  if (!lockstep_) setup.run_search = InBackground;
  setup.catch_up_in_portions = !lockstep_;
  core_ = std::make_unique<FrontendCore>(setup);
  map_reader_ = MakeReader(StreamId::kMap, "MAPPER", {channels::kMap});
  ServeReplica(&core_->map(), [this] { return HandOverVersion(); });
  WantWriter({StreamId::kFrontend, {"mapper", "collector"}, {}, nullptr});
}

/// Into a running system a frontend comes with the map; where nobody has one it begins with a first.
bool FrontendNode::ReadyToWrite() {
  if (context_.fresh_system) return true;
  if (!map_reader_->term().valid()) return !options_.HasPeer("mapper");
  TakeMapRecords(true);
  const bool caught_up =
      map_reader_->state() == StreamReader::State::kFollowing && map_reader_->backlog() == 0 && held_.empty();
  if (!caught_up) return false;
  const Map& map = core_->map();
  if (map.progress().ended) {
    Exit(0);
    return false;
  }
  core_->Resume();
  if (map.keyframes().empty()) return true;
  last_index_ = static_cast<int64_t>(map.keyframes().rbegin()->first.frame_index()) - 1;
  LogInfo("frontend: has the map of {} keyframes and goes on in it", map.keyframes().size());
  return true;
}

Version FrontendNode::HandOverVersion() {
  if (core_->NeedsMapUnchanged()) return applied_;
  TakeMapRecords(true);
  while (core_->IsRefining()) {  // what is taken must be applied
    core_->RefineNext();
    ApplyHeldRecords(NumReadyRecords(true));
  }
  return applied_;
}

void FrontendNode::OnWriterOpen() {
  SessionStart start;
  start.session = session_;
  start.first_stamp_ns = 0;
  start.seed = run_.seed;
  start.configuration_hash = options_.settings.Hash();
  if (extras_.vocabulary) start.vocabulary_checksum = extras_.vocabulary->checksum();
  start.mode = camera_info_->mode;
  start.camera = camera_info_->camera;
  start.pyramid = options_.settings.Read<Pyramid>();
  start.sequence = camera_info_->sequence;
  start.profile = options_.settings.profile();
  PublishRecord(start);
}

void FrontendNode::OnMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  if (channel == channels::kFrame) OnFrame(bytes);
  if (channel == channels::kEndOfSequence) OnEndOfSequence(bytes);
  if (channel != channels::kGroundTruthPose) return;
  const std::optional<GroundTruthPose> truth = Read<GroundTruthPose>(bytes);
  if (truth && !IsForeignFrame(truth->session))
    error_.OnTruth(truth->frame_index, truth->T_world_cam.translation);
}

void FrontendNode::OnFrame(std::span<const uint8_t> bytes) {
  if (!camera_info_) return;  // it comes again, or it is too early
  std::optional<Frame> frame = Read<Frame>(bytes);
  if (!frame || IsForeignFrame(frame->session)) return;
  const int64_t index = frame->frame_index;
  if (index <= last_index_) {
    // A repeat, or a player that was started again: say how far we are, unless that is still being worked on.
    if (!frame_open_) PublishLoose(FrameDone{session_, static_cast<uint32_t>(last_index_), last_stamp_ns_});
    return;
  }
  if (waiting_ && waiting_->frame.frame_index == frame->frame_index) return;
  ++frames_received_;
  if (waiting_) ++frames_skipped_;
  waiting_ = Waiting{std::move(*frame), context_.wall_us()};
}

void FrontendNode::OnEndOfSequence(std::span<const uint8_t> bytes) {
  const std::optional<EndOfSequence> end = Read<EndOfSequence>(bytes);
  if (!end || !camera_info_ || IsForeignFrame(end->session)) return;
  if (end_.Is(SequenceEnd::Phase::kDone)) PublishSequenceDone();
  end_.OnEndHeard();
}

/// In real time records are applied as they come. In lock-step they are applied up to a settled record, so
/// that which frame sees what does not depend on how fast the mapper was with what nobody waits for
/// (evidence). A snapshot takes the place of the replica when all of it is here.
void FrontendNode::TakeMapRecords(bool all) {
  while (std::optional<Record> record = map_reader_->Take()) {
    if (record->begins_anew()) held_.clear();
    auto delta = ReadMapRecord(*record, map_reader_.get());
    if (!delta) continue;
    held_.push_back({std::move(*delta), record->version(), record->begins_anew(), record->in_snapshot(),
                     record->ends_snapshot()});
  }
  ApplyHeldRecords(NumReadyRecords(all));
}

size_t FrontendNode::NumReadyRecords(bool all) const {
  size_t ready = held_.size();
  const auto is_ready = [&](const HeldRecord& held) {
    if (held.in_snapshot) return held.ends_snapshot;
    return all || !lockstep_ || held.delta.event == MapEvent::kSettled;
  };
  while (ready > 0 && !is_ready(held_[ready - 1])) --ready;
  return ready;
}

/// Only what is applied is accepted: what is held back could not be handed over.
void FrontendNode::ApplyHeldRecords(size_t count) {
  for (; count > 0 && !core_->IsRefining(); --count) {
    const HeldRecord& held = held_.front();
    if (held.begins_anew) core_->ForgetMap();
    core_->ApplyMapDelta(held.delta);
    if (held.delta.event == MapEvent::kRequestDone) end_.OnAnswer();
    applied_ = held.version;
    held_.pop_front();
  }
  map_reader_->Accept(applied_);
}

int FrontendNode::UnacceptedKeyframes() {
  const std::optional<int64_t> accepted = writer_->AcknowledgedBy("mapper");
  while (accepted && !keyframe_seqs_.empty() && keyframe_seqs_.front() <= *accepted)
    keyframe_seqs_.pop_front();
  return static_cast<int>(keyframe_seqs_.size());
}

bool FrontendNode::HoldsBack() const { return lockstep_ && core_->awaited().valid(); }

/// Nothing can be done before a saved map has come.
bool FrontendNode::AwaitsSavedMap() const { return run_.saved_map && core_->map().keyframes().empty(); }

bool FrontendNode::WorkOnce() {
  if (core_->IsRefining()) {
    core_->RefineNext();
    return false;  // one in a turn: it takes a while, and signals and elections are for between
  }
  if (!core_->NeedsMapUnchanged()) TakeMapRecords(end_.AppliesAllRecords());
  if (end_.Is(SequenceEnd::Phase::kDone)) {
    if (!options_.HasPeer("mapper") || MapIsOver(core_->map(), *map_reader_)) Stop();
    return false;
  }
  if (HoldsBack() || AwaitsSavedMap()) return false;
  if (frame_open_) FinishFrame();
  if (waiting_ && !FallsBehind()) return ProcessWaiting();
  if (core_->IsBehind()) return CatchUp();
  return WorkAtEnd();
}

int64_t FrontendNode::WorkDeadline() const {
  using Phase = SequenceEnd::Phase;
  if (!core_) return INT64_MAX;
  if (core_->IsRefining()) return 0;
  if (end_.Is(Phase::kTelling)) return end_.next_portion_ns();
  if (stopping_ || AwaitsSavedMap()) return INT64_MAX;
  const bool grows = end_.Is(Phase::kGrowingBack) && !core_->awaited().valid();
  return grows || end_.Is(Phase::kRefining) || end_.Is(Phase::kJoining) ? 0 : INT64_MAX;
}

/// A portion in a turn: the node answers in between. True: the next step can begin at once.
bool FrontendNode::WorkAtEnd() {
  using Phase = SequenceEnd::Phase;
  if (end_.Is(Phase::kPlaying)) return false;
  if (end_.Is(Phase::kGrowingBack)) {
    if (GrowBack()) return false;
    end_.OnGrown();
  }
  if (end_.Is(Phase::kAwaitingAdjustedMap)) {
    if (!MapsAreAdjusted()) return false;
    core_->RefineRest();
    end_.OnAdjusted();
  }
  if (core_->IsRefining()) return true;
  if (end_.Is(Phase::kRefining)) {
    ReturnFreeMemory();  // the features that were kept are not needed now
    end_.OnRefined();
  }
  if (end_.Is(Phase::kJoining)) {
    if (core_->WorkAtEnd([this] { AnswerWithinWork(); })) return false;
    end_.Tell(core_->Finish());
  }
  return TellLastPoses();
}

/// Catching up has the time between two images. Where that is not enough it comes first until all is done,
/// and images are skipped.
bool FrontendNode::FallsBehind() {
  hurries_ = core_->IsBehind() && (hurries_ || core_->num_behind() > kMaxBehind);
  return hurries_;
}

bool FrontendNode::CatchUp() {
  Publish(core_->CatchUp().events);
  endpoint_.Advance();
  return true;
}

/// One frame in a turn, and one keyframe at a time. True: there is more to do.
bool FrontendNode::GrowBack() {
  if (!options_.HasPeer("mapper")) return false;
  if (core_->awaited().valid() && !core_->map().keyframes().empty()) return true;
  core_->SetWithheld(false);  // one at a time, the mapper has time for it
  const std::optional<FrontendOutput> output = core_->GrowBack();
  if (output) Publish(output->events);
  endpoint_.Advance();
  return output.has_value();
}

/// The mapper is asked once to adjust its maps as a whole, so that the last poses are told in the best map.
bool FrontendNode::MapsAreAdjusted() {
  if (!options_.HasPeer("mapper") || core_->map().keyframes().empty()) return true;
  if (end_.Asks(context_.now_ns()))
    PublishRecord(AdjustRequest{++requests_, "the sequence has ended", last_stamp_ns_});
  return end_.IsAnswered();
}

bool FrontendNode::DecodeImage(const Frame& frame) {
  const std::string name = "frame " + std::to_string(frame.frame_index);
  try {
    decoder_.Decode(ToImageEncoding(frame.encoding), frame.width_px, frame.height_px, frame.data, name,
                    image_);
  } catch (const InputError& error) {
    if (frames_bad_++ == 0) LogWarning("frontend: {} (further ones are only counted)", error.what());
    return false;
  }
  const Camera& camera = camera_info_->camera;
  if (image_.width == camera.width_px && image_.height == camera.height_px) return true;
  Exit(kExitMisfit, name + " is " + std::to_string(image_.width) + "x" + std::to_string(image_.height) +
                        " pixels, but the camera file says " + std::to_string(camera.width_px) + "x" +
                        std::to_string(camera.height_px) +
                        "; give the camera file that belongs to the sequence (--camera)");
  return false;
}

bool FrontendNode::ProcessWaiting() {
  const Waiting waiting = std::move(*waiting_);
  waiting_.reset();
  last_index_ = waiting.frame.frame_index;
  last_stamp_ns_ = waiting.frame.stamp_ns;
  if (first_stamp_ns_ == 0) first_stamp_ns_ = last_stamp_ns_;
  frame_open_ = true;
  FrameTrace trace{session_,
                   waiting.frame.frame_index,
                   waiting.frame.stamp_ns,
                   waiting.frame.capture_us,
                   waiting.frame.publish_us,
                   waiting.receive_us,
                   context_.wall_us()};
  if (!DecodeImage(waiting.frame)) return true;
  trace.decoded_us = context_.wall_us();
  core_->SetWithheld(UnacceptedKeyframes() >= kMaxUnacceptedKeyframes);
  const FrontendOutput output =
      core_->ProcessImage(waiting.frame.frame_index, waiting.frame.stamp_ns,
                          {image_.data.data(), image_.width, image_.height, image_.width});
  trace.tracked_us = context_.wall_us();
  trace.extracted_us = trace.decoded_us + static_cast<int64_t>(1000.0 * core_->extract_ms());
  Publish(output.events);
  endpoint_.Advance();
  ++frames_processed_;
  PublishViews(waiting, last_pose_, trace);
  DrawPicture();
  if (!HoldsBack()) FinishFrame();
  return true;
}

void FrontendNode::Publish(const std::vector<FrontendEvent>& events) {
  for (const FrontendEvent& event : events) {
    const int64_t seq = std::visit([this](const auto& record) { return PublishRecord(record); }, event);
    if (std::holds_alternative<KeyframeProposal>(event) || std::holds_alternative<InitialMap>(event)) {
      keyframe_seqs_.push_back(seq);
    }
    if (const auto* pose = std::get_if<FramePose>(&event)) {
      last_pose_ = *pose;
      if (first_map_s_ < 0 && pose->HasPose()) {
        first_map_s_ = static_cast<double>(pose->stamp_ns - first_stamp_ns_) * 1e-9;
      }
    }
    if (std::holds_alternative<MapReset>(event)) {
      first_map_s_ = -1;
      error_.Reset();
    }
  }
}

void FrontendNode::PublishViews(const Waiting& waiting, const FramePose& pose, FrameTrace trace) {
  trace.published_us = context_.wall_us();
  latency_.Add(static_cast<double>(trace.published_us - waiting.frame.publish_us) * 1e-3);
  decode_.Add(static_cast<double>(trace.decoded_us - trace.begin_us) * 1e-3);
  extract_.Add(core_->extract_ms());
  step_.Add(static_cast<double>(trace.tracked_us - trace.begin_us) * 1e-3);
  PublishLoose(trace);
  PoseView view;
  view.session = session_;
  view.frame_index = pose.frame_index;
  view.stamp_ns = pose.stamp_ns;
  view.state = pose.state;
  view.map_id = pose.map_id;
  view.has_pose = pose.HasPose();
  if (pose.HasPose()) {
    view.T_world_cam = pose.T_cam_world.Inverse();
    view.error_m = error_.OnPose(pose.frame_index, view.T_world_cam.translation);
  }
  view.inliers = pose.num_static;
  view.moving = pose.num_moving;
  view.unknown = pose.num_unknown;
  view.moving_share = pose.moving_image_share;
  view.latency_ms = static_cast<double>(trace.published_us - waiting.frame.publish_us) * 1e-3;
  PublishLoose(view);
  FeatureView features{session_, pose.frame_index, pose.stamp_ns, {}};
  const TrackedFrame& frame = core_->frame();
  features.items.reserve(frame.classes.size());
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const Keypoint& keypoint = frame.features->set.keypoints[i];
    features.items.push_back(
        {keypoint.x_q4, keypoint.y_q4, static_cast<FeatureView::Kind>(frame.classes[i])});
  }
  PublishLoose(features, options_.link == Link::kLan);
}

void FrontendNode::FinishFrame() {
  frame_open_ = false;
  PublishLoose(FrameDone{session_, static_cast<uint32_t>(last_index_), last_stamp_ns_});
}

void FrontendNode::DrawPicture() {
  if (extras_.picture_every <= 0 || last_index_ % extras_.picture_every != 0) return;
  WritePicture(extras_.picture_dir, image_, core_->frame(), last_pose_);
}

void FrontendNode::PublishSequenceDone() {
  PublishLoose(SequenceDone{context_.wall_us(), session_, 0, frames_processed_, frames_skipped_});
}

/// The smoothing of a long trajectory takes seconds.
void FrontendNode::AnswerWithinWork() {
  PumpWithinWork();
  PublishStatusIfDue();
}

bool FrontendNode::TellLastPoses() {
  Publish(end_.NextPortion(context_.now_ns()));
  if (!end_.Is(SequenceEnd::Phase::kDone)) return false;
  PublishSequenceDone();
  PublishStatus();
  writer_->Complete(context_.now_ns());
  return true;
}

void FrontendNode::PublishStatus() {
  FrontendStatus status;
  status.head = MakeStatusHead(core_ ? last_pose_.reason : "waiting for a camera", {map_reader_.get()});
  status.head.health.dropped_malformed += frames_bad_;
  if (HoldsBackForStatus()) status.head.health.waiting_for = "mapper";
  status.frames_received = frames_received_;
  status.frames_processed = frames_processed_;
  status.frames_skipped = frames_skipped_;
  status.fps = static_cast<double>(frames_processed_ - std::exchange(status_frames_, frames_processed_));
  status.frame_index = static_cast<int32_t>(last_index_);
  status.latency_p50_ms = latency_.Quantile(0.5);
  status.latency_p95_ms = latency_.Quantile(0.95);
  status.latency_p99_ms = latency_.Quantile(0.99);
  status.decode_ms = decode_.Quantile(0.5);
  status.extract_ms = extract_.Quantile(0.5);
  status.step_ms = step_.Quantile(0.5);
  status.step_p95_ms = step_.Quantile(0.95);
  status.track_ms = status.step_ms - status.decode_ms - status.extract_ms;
  status.first_map_s = first_map_s_;
  if (core_) FillCoreStatus(&status);
  PublishLoose(status);
}

bool FrontendNode::HoldsBackForStatus() const {
  return core_ != nullptr && (HoldsBack() || AwaitsSavedMap() ||
                              (end_.Is(SequenceEnd::Phase::kGrowingBack) && core_->awaited().valid()));
}

void FrontendNode::FillCoreStatus(FrontendStatus* status) const {
  status->state = core_->state();
  status->features = last_pose_.num_features;
  status->inliers = last_pose_.num_static;
  status->moving = last_pose_.num_moving;
  status->unknown = last_pose_.num_unknown;
  status->moving_share = last_pose_.moving_image_share;
  status->map_id = last_pose_.map_id;
  status->map_version = static_cast<int64_t>(core_->map().version());
  status->map_keyframes = static_cast<int32_t>(core_->map().keyframes().size());
  status->map_landmarks = static_cast<int32_t>(core_->map().num_landmarks());
  const FrontendCounters& counters = core_->counters();
  status->keyframes_proposed = static_cast<int64_t>(counters.keyframes_proposed);
  status->keyframes_withheld = static_cast<int64_t>(counters.keyframes_withheld);
  status->keyframes_unacknowledged = static_cast<int32_t>(keyframe_seqs_.size());
  status->resets = static_cast<int64_t>(counters.resets);
  status->relocalisations = static_cast<int64_t>(counters.relocalizations);
}

}  // namespace dmslam
