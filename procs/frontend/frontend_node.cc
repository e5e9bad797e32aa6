#include "frontend/frontend_node.h"

#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/roles.h"
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
constexpr double kMaxBehindS = 2.0;
constexpr int64_t kMostOfOtherSize = 3;       // frames, before the first one that fits
constexpr uint32_t kTheEnd = kMaxFrames - 1;  // in the place of a frame: what is done when none follows

}  // namespace

std::unique_ptr<Node> MakeFrontend(NodeContext context, const NodeOptions& options, FrontendExtras extras) {
  return std::make_unique<FrontendNode>(std::move(context), options, std::move(extras));
}

FrontendNode::FrontendNode(NodeContext context, const NodeOptions& options, FrontendExtras extras)
    : StreamNode(std::move(context), options, OfCamera(roles::kFrontend, options.camera_id)),
      run_(options_.settings.Read<RunOptions>()),
      extras_(std::move(extras)),
      end_(options_.HasPeer(roles::kMapper)) {
  Listen({channels::kFrame, channels::kEndOfSequence, channels::kGroundTruthPose, channels::kKeyframe});
}

void FrontendNode::Begin(const CameraInfo& info) {
  pace_.lockstep = info.mode == PlaybackMode::kLockstep;
  pace_.takes_turns = pace_.lockstep && options_.NumCameras() > 1;
  FrontendCore::Setup setup = FrontendSetup(options_.settings, info.camera, extras_.vocabulary);
  setup.feature_store = feature_store_;
  setup.session = session_;
  setup.camera_id = options_.camera_id;
  setup.in_saved_map = run_.saved_map;
  setup.localize_only = run_.localize_only;
  if (!pace_.lockstep && context_.watch) {
    setup.run_search = [sign = search_sign_](FirstMapSearch search) {
      return InBackground(std::move(search), sign);
    };
  }
  setup.catch_up_in_portions = !pace_.lockstep;
  work_ = MakeCoreThread(info.mode);
  core_ = std::make_unique<FrontendCore>(setup);
  left_ = LeftBehind{LeftKeyframes(session_, options_.camera_id), {}};
  map_reader_ = MakeReader(StreamId::kMap, owners::kMapper, {channels::kMap});
  ServeReplica(
      &core_->map(), [this] { return HandOverVersion(); },
      [this] { return work_->Idle() && held_.IsUpToDate(); });
  WantWriter({StreamId::kFrontend, {roles::kMapper, roles::kCollector}, {}, nullptr});
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
                         !(context_.resumed && core_->map().keyframes().empty());
  if (!caught_up) return false;
  const Map& map = core_->map();
  if (map.progress().ended) {
    // Not before the mapper knows that all of it has come: it would wait for who has left.
    if (NobodyNeedsTheMap(map, *map_reader_)) Exit(0);
    return false;
  }
  core_->Resume();
  if (map.keyframes().empty()) return true;
  const Keyframe* newest = map.NewestKeyframeOf(options_.camera_id);
  if (newest != nullptr && newest->id.frame_index() > 0) newest_ = {newest->id.frame_index() - 1, {}};
  // A player that was started again, too, begins from the front until it hears how far we are.
  if (waiting_ && newest_ && waiting_->frame.frame_index <= newest_->index) waiting_.reset();
  LogInfo("frontend: has the map of {} keyframes and goes on in it", map.keyframes().size());
  return true;
}

/// Nothing that was taken is left behind: a mapper that continued without it would find this reader ahead.
Version FrontendNode::HandOverVersion() {
  if (!work_->Idle() || core_->NeedsMapUnchanged()) return held_.promised();
  TakeMapRecords();
  ApplyHeldRecords(held_.NumReady(true), true);
  return held_.promised();
}

void FrontendNode::OnWriterOpen() {
  left_->until_ns = context_.now_ns() + kBackAfterDeathNs;
  session_start_ = MakeSessionStart();
  PublishRecord(*session_start_);
}

SessionStart FrontendNode::MakeSessionStart() const {
  SessionStart start;
  start.session = session_;
  start.camera_id = options_.camera_id;
  start.first_stamp_ns = 0;
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
  if (channel == channels::kKeyframe) OnKeyframe(bytes);
  if (channel != channels::kGroundTruthPose) return;
  const std::optional<GroundTruthPose> truth = Read<GroundTruthPose>(bytes);
  if (truth && !IsForeignFrame(truth->session))
    error_.OnTruth(truth->frame_index, truth->T_world_cam.translation);
}

void FrontendNode::OnFrame(std::span<const uint8_t> bytes) {
  std::optional<Frame> frame = Read<Frame>(bytes);
  if (!frame) return;
  if (!camera_info_) return ConfirmCamera(frame->session);  // it comes again, or it is too early
  if (IsForeignFrame(frame->session)) return;
  if (frame->frame_index >= kTheEnd)
    return CountMalformed(channels::kFrame, "its number is beyond what a session can hold; begin a new one");
  const bool goes_back = camera_info_->mode == PlaybackMode::kRealtime && newest_ && newest_->stamp_ns &&
                         frame->stamp_ns <= *newest_->stamp_ns;
  if (newest_ && (frame->frame_index <= newest_->index || goes_back)) {
    order_.OnRepeat();
    // A repeat, or a player that was started again: say how far we are, unless that is still being worked on.
    if (!pace_.frame_open) PublishLoose(DoneWithNewest());
    return;
  }
  if (waiting_ && waiting_->frame.frame_index == frame->frame_index) return order_.OnRepeat();
  if (end_.Is(SequenceEnd::Phase::kDone)) return PublishSequenceDone();
  if (pace_.lockstep && pace_.frame_open) order_.OnPlayerWaits();
  if (!order_.Takes({frame->frame_index, frame->stamp_ns}, NewestFrame(), context_.now_ns()))
    return CountMalformed(channels::kFrame,
                          "it is far ahead of those that came; taken when others go on there");
  ++counts_.received;
  if (waiting_) ++counts_.skipped;
  waiting_ = Waiting{std::move(*frame), context_.wall_us()};
}

/// That was taken in; none: none was, or its stamp is not known.
std::optional<PlayOrder::Place> FrontendNode::NewestFrame() const {
  if (waiting_) return PlayOrder::Place{waiting_->frame.frame_index, waiting_->frame.stamp_ns};
  if (!newest_ || !newest_->stamp_ns) return std::nullopt;
  return PlayOrder::Place{newest_->index, *newest_->stamp_ns};
}

FrameDone FrontendNode::DoneWithNewest() const {
  return {session_, newest_->index, newest_->stamp_ns.value_or(0)};
}

void FrontendNode::OnEndOfSequence(std::span<const uint8_t> bytes) {
  const std::optional<EndOfSequence> end = Read<EndOfSequence>(bytes);
  if (!end || !camera_info_ || IsForeignFrame(end->session)) return;
  if (end_.Is(SequenceEnd::Phase::kDone)) PublishSequenceDone();
  order_.OnEnd(*end, context_.now_ns());
}

/// Our own, or what a frontend before this one has left.
void FrontendNode::OnKeyframe(std::span<const uint8_t> bytes) {
  if (!left_) return;
  const bool in_time = !left_->until_ns || context_.now_ns() < *left_->until_ns;
  const std::optional<RecordHeader> header = ParseHeader(bytes);
  const bool ours = writer_ && header && Term{header->epoch, header->writer} == writer_->term();
  if (in_time && !ours) left_->keyframes.Hear(bytes);
}

/// Before this frontend proposes anything itself.
bool FrontendNode::ProposeWhatWasLeft() {
  using Phase = SequenceEnd::Phase;
  if (!end_.Is(Phase::kPlaying) && !end_.Is(Phase::kGrowingBack)) return false;
  const auto proposal = left_->keyframes.Next(core_->map(), writer_->term());
  if (!proposal) return false;
  LogInfo("frontend: the one before it left behind the keyframe of frame {}; it is proposed again",
          proposal->id.frame_index());
  keyframe_seqs_.push_back(PublishRecord(*proposal));
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
    for (; applied < count && (at_once || !core_->IsRefining()); ++applied) {
      const HeldRecords::Held& held = held_[applied];
      if (held.begins_anew) core_->ForgetMap();
      core_->ApplyMapDelta(held.delta);
      work_->Beat();
    }
    work_->Report([this, applied] { OnApplied(applied); });
  });
}

/// Only what is applied is accepted: what is held back could not be handed over.
void FrontendNode::OnApplied(size_t count) {
  for (; count > 0; --count) {
    const HeldRecords::Held held = held_.PopApplied();
    if (held.delta.event == MapEvent::kRequestDone) end_.OnAnswer();
    const bool ours = held.delta.event == MapEvent::kTurn && held.delta.about->camera() == options_.camera_id;
    if (ours && pace_.turn.asked == held.delta.about->frame_index()) pace_.turn.given = pace_.turn.asked;
  }
  map_reader_->Accept(held_.applied());
}

int FrontendNode::UnacceptedKeyframes() {
  const std::optional<int64_t> accepted = writer_->AcknowledgedBy(roles::kMapper);
  while (accepted && !keyframe_seqs_.empty() && keyframe_seqs_.front() <= *accepted)
    keyframe_seqs_.pop_front();
  return static_cast<int>(keyframe_seqs_.size());
}

bool FrontendNode::HoldsBack() const { return pace_.lockstep && core_->awaited(); }

/// Nothing can be done before a saved map has come.
bool FrontendNode::AwaitsSavedMap() const { return run_.saved_map && core_->map().keyframes().empty(); }

/// In lock-step the first frame waits until all follow who are to keep what is told of it: it would die with
/// this process.
bool FrontendNode::AwaitsFirstReaders() const {
  return pace_.lockstep && counts_.processed == 0 && !AwaitedReaders().empty();
}

/// Where several cameras go in lock-step, a frame waits until the mapper has all that comes before it. A
/// mapper that was started again is asked again.
bool FrontendNode::HasTurn(uint32_t frame_index, std::optional<int64_t> stamp_ns) {
  if (!pace_.takes_turns || pace_.turn.given == frame_index) return true;
  if (!map_reader_->term().valid()) return false;
  if (pace_.turn.asked == frame_index && pace_.turn.asked_of == map_reader_->term()) return false;
  pace_.turn = {frame_index, std::nullopt, map_reader_->term()};
  PublishRecord(TurnRequest{frame_index, stamp_ns, options_.camera_id});
  return false;
}

/// Has the core do something, which ends with what it has to say of itself. The core is idle. Returns whether
/// it is idle again.
bool FrontendNode::Run(Job job) {
  work_->Post([this, job = std::move(job)] {
    job();
    work_->Report([this, status = CoreStatus()] { core_status_ = status; });
  });
  return work_->Idle();
}

bool FrontendNode::WorkOnce() {
  if (order_.IsOver(context_.now_ns())) end_.OnEndHeard();
  if (!work_->Idle()) return false;
  LetSnapshotBegin();
  if (core_->IsRefining()) return Refine();
  if (!core_->NeedsMapUnchanged()) {
    TakeMapRecords();
    ApplyHeldRecords(held_.NumReady(!pace_.lockstep || end_.AppliesAllRecords()), false);
    if (!work_->Idle()) return false;
  }
  if (core_->map().progress().ended && !end_.Is(SequenceEnd::Phase::kDone)) LeaveEndedMap();
  if (end_.Is(SequenceEnd::Phase::kDone)) {
    if (!options_.HasPeer(roles::kMapper) || NobodyNeedsTheMap(core_->map(), *map_reader_)) Stop();
    return false;
  }
  if (HoldsBack() || AwaitsSavedMap()) return false;
  if (ProposeWhatWasLeft()) return true;
  if (pace_.frame_open) FinishFrame();
  if (waiting_ && !FallsBehind())
    return !AwaitsFirstReaders() && HasTurn(waiting_->frame.frame_index, waiting_->frame.stamp_ns) &&
           TrackWaiting();
  if (core_->IsBehind()) return (hurries_ || core_->MayCatchUp()) && CatchUp();
  return WorkAtEnd();
}

int64_t FrontendNode::WorkDeadline() const {
  using Phase = SequenceEnd::Phase;
  if (!core_ || !work_->Idle()) return INT64_MAX;
  if (core_->IsRefining()) return 0;
  if (end_.Is(Phase::kTelling)) return last_words_.next_portion_ns();
  if (stopping_ || AwaitsSavedMap() || (pace_.takes_turns && pace_.turn.asked != pace_.turn.given))
    return INT64_MAX;
  const bool grows = end_.Is(Phase::kGrowingBack) && !core_->awaited();
  return grows || end_.Is(Phase::kRefining) || end_.Is(Phase::kJoining) ? 0 : INT64_MAX;
}

// ---- When the sequence has ended ----

/// A portion in a turn: signals and elections are for between. True: the next can begin at once.
bool FrontendNode::WorkAtEnd() {
  using Phase = SequenceEnd::Phase;
  const Phase phase = end_.phase();
  if (phase == Phase::kPlaying) return false;
  if (phase >= Phase::kTelling) return TellLastPoses();
  if (phase == Phase::kGrowingBack && !HasTurn(kTheEnd, std::nullopt)) return false;
  AskForAdjustedMaps();
  return !end_.Waits(*core_) && WorkOn(phase);
}

/// True: the phase is done.
bool FrontendNode::WorkOn(SequenceEnd::Phase phase) {
  Run([this, phase] {
    const auto worked = std::make_shared<const SequenceEnd::Worked>(SequenceEnd::Work(phase, core_.get()));
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
  return Run([this] { core_->RefineNext(); }) && !core_->IsRefining();
}

/// All of them as a whole, so that the last poses are told in the best map.
void FrontendNode::AskForAdjustedMaps() {
  const auto request =
      end_.Ask(core_->map(), context_.now_ns(), newest_ ? DoneWithNewest().stamp_ns : 0, options_.camera_id);
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
  PublishSequenceDone();
  PublishStatus();
  writer_->Complete(context_.now_ns());
  return true;
}

void FrontendNode::PublishSequenceDone() {
  PublishLoose(SequenceDone{context_.wall_us(), session_, 0, counts_.processed, counts_.skipped});
}

// ---- While it goes on ----

/// Catching up has the time between two images. Where that is not enough it comes first until all is done,
/// and images are skipped.
bool FrontendNode::FallsBehind() {
  hurries_ = core_->IsBehind() && (hurries_ || core_->seconds_behind() >= kMaxBehindS);
  return hurries_;
}

bool FrontendNode::CatchUp() {
  return Run([this] { work_->Report([this, output = core_->CatchUp()] { Publish(output.events); }); });
}

bool FrontendNode::TrackWaiting() {
  const auto waiting = std::make_shared<const Waiting>(std::move(*waiting_));
  waiting_.reset();
  newest_ = {waiting->frame.frame_index, waiting->frame.stamp_ns};
  if (!first_map_.since_ns) first_map_.since_ns = newest_->stamp_ns;
  pace_.frame_open = true;
  const bool withheld = UnacceptedKeyframes() >= kMaxUnacceptedKeyframes;
  return Run([this, waiting, withheld] { Track(*waiting, withheld); });
}

/// On the core.
void FrontendNode::Track(const Waiting& waiting, bool withheld) {
  const Frame& frame = waiting.frame;
  FrameTrace trace{session_,         frame.frame_index,  frame.stamp_ns,    frame.capture_us,
                   frame.publish_us, waiting.receive_us, context_.wall_us()};
  if (!DecodeImage(frame)) return;
  trace.decoded_us = context_.wall_us();
  core_->SetWithheld(withheld);
  const auto tracked = std::make_shared<Tracked>();
  tracked->output = core_->ProcessImage(frame.frame_index, frame.stamp_ns,
                                        {image_.data.data(), image_.width, image_.height, image_.width});
  tracked->odometry = core_->odometry();
  tracked->extract_ms = core_->extract_ms();
  trace.tracked_us = context_.wall_us();
  trace.extracted_us = trace.decoded_us + static_cast<int64_t>(1000.0 * tracked->extract_ms);
  tracked->trace = trace;
  tracked->features = ViewOfFeatures();
  work_->Report([this, tracked] { PublishTracked(*tracked); });
  DrawPicture(tracked->output);
}

/// On the core.
bool FrontendNode::DecodeImage(const Frame& frame) {
  const std::string name = "frame " + std::to_string(frame.frame_index);
  try {
    decoder_.Decode(ToImageEncoding(frame.encoding), frame.width_px, frame.height_px, frame.data, name,
                    image_);
  } catch (const InputError& error) {
    work_->Report([this, problem = std::string(error.what())] { OnBadImage(problem); });
    return false;
  }
  const Camera& camera = camera_info_->camera;
  if (image_.width == camera.width_px && image_.height == camera.height_px) return true;
  work_->Report([this, problem = name + " is " + std::to_string(image_.width) + "x" +
                                 std::to_string(image_.height) + " pixels, but the camera file says " +
                                 std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px) +
                                 "; give the camera file that belongs to the sequence (--camera)"] {
    OnImageOfOtherSize(problem);
  });
  return false;
}

/// Where no frame has fitted before, the camera is another one than was said. Later a frame is somebody
/// else's, and costs its place alone.
void FrontendNode::OnImageOfOtherSize(const std::string& problem) {
  ++counts_.of_other_size;
  if (counts_.processed == 0 && counts_.of_other_size >= kMostOfOtherSize) return Exit(kExitMisfit, problem);
  OnBadImage(problem);
}

void FrontendNode::OnBadImage(const std::string& problem) {
  if (counts_.bad++ == 0) LogWarning("frontend: {} (further ones are only counted)", problem);
}

/// On the core.
FeatureView FrontendNode::ViewOfFeatures() const {
  const TrackedFrame& frame = core_->frame();
  FeatureView view{session_, frame.index, frame.stamp_ns, {}};
  view.items.reserve(frame.classes.size());
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const Keypoint& keypoint = frame.features->set.keypoints[i];
    view.items.push_back({keypoint.x_q4, keypoint.y_q4, static_cast<FeatureView::Kind>(frame.classes[i])});
  }
  return view;
}

/// On the core.
void FrontendNode::DrawPicture(const FrontendOutput& output) {
  const TrackedFrame& frame = core_->frame();
  if (extras_.picture_every <= 0 || frame.index % static_cast<uint32_t>(extras_.picture_every) != 0) return;
  for (auto event = output.events.rbegin(); event != output.events.rend(); ++event) {
    const auto* pose = std::get_if<FramePose>(&*event);
    if (pose) return WritePicture(extras_.picture_dir, image_, frame, *pose);
  }
}

void FrontendNode::Publish(const std::vector<FrontendEvent>& events) {
  for (const FrontendEvent& event : events) {
    const int64_t seq = std::visit([this](const auto& record) { return PublishRecord(record); }, event);
    if (std::holds_alternative<KeyframeProposal>(event) || std::holds_alternative<InitialMap>(event)) {
      keyframe_seqs_.push_back(seq);
    }
    if (const auto* pose = std::get_if<FramePose>(&event)) {
      last_pose_ = *pose;
      if (!first_map_.after_s && first_map_.since_ns && pose->HasPose()) {
        first_map_.after_s = static_cast<double>(pose->stamp_ns - *first_map_.since_ns) * 1e-9;
      }
    }
    if (std::holds_alternative<MapReset>(event)) {
      first_map_.after_s.reset();
      error_.Reset();
    }
  }
}

void FrontendNode::PublishTracked(const Tracked& tracked) {
  Publish(tracked.output.events);
  endpoint_.Advance();  // before all that may come late
  ++counts_.processed;
  FrameTrace trace = tracked.trace;
  trace.published_us = context_.wall_us();
  times_.latency.Add(static_cast<double>(trace.published_us - trace.publish_us) * 1e-3);
  times_.decode.Add(static_cast<double>(trace.decoded_us - trace.begin_us) * 1e-3);
  times_.extract.Add(tracked.extract_ms);
  times_.step.Add(static_cast<double>(trace.tracked_us - trace.begin_us) * 1e-3);
  PublishOdometry(tracked.odometry, trace);
  PublishLoose(trace);
  PublishView(trace);
  PublishLoose(tracked.features, options_.link == Link::kLan);
}

void FrontendNode::PublishOdometry(const OdometryState& odometry, const FrameTrace& trace) {
  Odometry told;
  told.session = session_;
  told.frame_index = trace.frame_index;
  told.stamp_ns = trace.stamp_ns;
  told.state = last_pose_.state;
  told.segment = odometry.segment;
  told.measured = odometry.measured;
  told.T_odom_cam = odometry.T_odom_cam;
  told.has_velocity = odometry.velocity.has_value();
  if (odometry.velocity) {
    told.linear_velocity = odometry.velocity->linear_per_s;
    told.angular_velocity = odometry.velocity->angular_rad_per_s;
  }
  told.map_id = odometry.map_id;
  told.T_map_odom = {odometry.map_from_odom.rotation, odometry.map_from_odom.translation};
  told.scale_map_odom = odometry.map_from_odom.scale;
  told.depth = odometry.depth;
  told.latency_ms = static_cast<double>(trace.published_us - trace.publish_us) * 1e-3;
  if (odometry.step) {
    told.step_from = odometry.step->from;
    told.step_covariance = UpperTriangle(odometry.step->covariance);
  }
  PublishLoose(told);
}

void FrontendNode::PublishView(const FrameTrace& trace) {
  const FramePose& pose = last_pose_;
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
  view.latency_ms = static_cast<double>(trace.published_us - trace.publish_us) * 1e-3;
  PublishLoose(view);
}

void FrontendNode::FinishFrame() {
  pace_.frame_open = false;
  PublishLoose(DoneWithNewest());
}

// ---- Status ----

void FrontendNode::PublishStatus() {
  SaySessionAgain();
  if (core_ && work_->Idle()) core_status_ = CoreStatus();
  FrontendStatus status = core_status_;
  status.head = MakeStatusHead(core_ ? last_pose_.reason : "waiting for a camera", {map_reader_.get()});
  status.head.health.dropped_malformed += counts_.bad;
  if (IsHeldUp()) status.head.health.waiting_for = roles::kMapper;
  status.frames_received = counts_.received;
  status.frames_processed = counts_.processed;
  status.frames_skipped = counts_.skipped;
  status.fps =
      static_cast<double>(counts_.processed - std::exchange(counts_.processed_at_status, counts_.processed));
  if (newest_) status.frame_index = static_cast<int32_t>(newest_->index);
  status.latency_p50_ms = times_.latency.Quantile(0.5);
  status.latency_p95_ms = times_.latency.Quantile(0.95);
  status.latency_p99_ms = times_.latency.Quantile(0.99);
  status.decode_ms = times_.decode.Quantile(0.5);
  status.extract_ms = times_.extract.Quantile(0.5);
  status.step_ms = times_.step.Quantile(0.5);
  status.step_p95_ms = times_.step.Quantile(0.95);
  status.track_ms = status.step_ms - status.decode_ms - status.extract_ms;
  status.first_map_s = first_map_.after_s;
  if (core_) FillPoseStatus(&status);
  PublishLoose(status);
}

void FrontendNode::FillPoseStatus(FrontendStatus* status) const {
  status->features = last_pose_.num_features;
  status->inliers = last_pose_.num_static;
  status->moving = last_pose_.num_moving;
  status->unknown = last_pose_.num_unknown;
  status->moving_share = last_pose_.moving_image_share;
  status->map_id = last_pose_.map_id;
  status->keyframes_unacknowledged = static_cast<int32_t>(keyframe_seqs_.size());
}

/// Waits for the mapper before it can go on.
bool FrontendNode::IsHeldUp() const {
  return core_ != nullptr && work_->Idle() &&
         (HoldsBack() || AwaitsSavedMap() || (end_.Is(SequenceEnd::Phase::kGrowingBack) && core_->awaited()));
}

/// On the core, or while it is idle.
FrontendStatus FrontendNode::CoreStatus() const {
  FrontendStatus status;
  const Map& map = core_->map();
  const FrontendCounters& counters = core_->counters();
  status.state = core_->state();
  status.map_version = static_cast<int64_t>(map.version());
  status.map_keyframes = static_cast<int32_t>(map.keyframes().size());
  status.map_landmarks = static_cast<int32_t>(map.num_landmarks());
  status.keyframes_proposed = static_cast<int64_t>(counters.keyframes_proposed);
  status.keyframes_withheld = static_cast<int64_t>(counters.keyframes_withheld);
  status.resets = static_cast<int64_t>(counters.resets);
  status.relocalisations = static_cast<int64_t>(counters.relocalizations);
  return status;
}

bool FrontendNode::Hangs(int64_t now_ns, int64_t longest_ns) const {
  return StreamNode::Hangs(now_ns, longest_ns) || search_sign_->Hangs(now_ns, longest_ns);
}

/// A core in work is waited for.
void FrontendNode::Stop() {
  if (work_ && !stopping_) work_->Finish();
  StreamNode::Stop();
}

}  // namespace dmslam
