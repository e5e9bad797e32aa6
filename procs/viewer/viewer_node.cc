#include "viewer/viewer_node.h"

#include <algorithm>
#include <utility>

#include "dmslam/runtime/process_info.h"
#include "viewer/viewer_json.h"

namespace dmslam {
namespace {

constexpr int64_t kDrawEveryNs = 120'000'000;
constexpr int64_t kReportEveryNs = 250'000'000;
constexpr int64_t kAlignEveryNs = 1'000'000'000;

const std::vector<std::string>& Shown() {
  static const std::vector<std::string> names = {"player", "frontend", "mapper", "loopcloser", "viewer"};
  return names;
}

}  // namespace

ViewerNode::ViewerNode(NodeContext context, NodeOptions options, ViewerOptions viewer, Exchange* exchange)
    : StreamNode(std::move(context), std::move(options), "viewer"),
      viewer_(std::move(viewer)),
      exchange_(exchange),
      board_(Shown()) {
  Listen({channels::kFrame, channels::kEndOfSequence, channels::kGroundTruthPose, channels::kPoseView,
          channels::kFeatureView, channels::kPlayerStatus, channels::kFrontendStatus, channels::kMapperStatus,
          channels::kLoopcloserStatus});
}

void ViewerNode::Begin(const CameraInfo& info) {
  core_ = std::make_unique<ViewerCore>(info.camera, options_.settings.Read<Pyramid>());
  if (!viewer_.ground_truth.empty()) core_->SetTruth(ReadGroundTruth(viewer_.ground_truth).poses);
  exchange_->Change([](Scene* scene, FrameSeries* series) {
    scene->Clear();
    series->Clear();
  });
  map_reader_ = MakeReader(StreamId::kMap, "MAPPER", {channels::kMap});
  frontend_reader_ =
      MakeReader(StreamId::kFrontend, "FRONTEND",
                 {channels::kSession, channels::kInitialMap, channels::kKeyframe, channels::kFramePose,
                  channels::kFrameEvidence, channels::kMapReset, channels::kAdjustRequest});
  loop_reader_ = MakeReader(StreamId::kLoopCloser, "LOOPCLOSER", {channels::kChecked});
}

void ViewerNode::SetInHaste(bool in_haste) {
  const bool over = in_haste_ && !in_haste;
  in_haste_ = in_haste;
  if (!over) return;
  next_draw_ns_ = next_report_ns_ = next_align_ns_ = 0;
  for (const auto& [channel, bytes] : std::exchange(passed_over_, {})) OnMessage(channel, bytes);
}

void ViewerNode::OnMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  OnStatusMessage(channel, bytes);
  if (core_) OnLoose(channel, bytes);
}

void ViewerNode::OnLoose(const std::string& channel, std::span<const uint8_t> bytes) {
  const bool is_picture = channel == channels::kFrame || channel == channels::kFeatureView;
  if (in_haste_ && is_picture) {
    passed_over_[channel].assign(bytes.begin(), bytes.end());
    return;
  }
  if (channel == channels::kFrame) {
    if (auto frame = Read<Frame>(bytes); frame && !IsForeignFrame(frame->session))
      exchange_->AddImage(std::move(*frame));
  } else if (channel == channels::kPoseView) {
    if (const auto view = Read<PoseView>(bytes); view && !IsForeign(view->session)) ShowPose(*view);
  } else if (channel == channels::kFeatureView) {
    if (const auto view = Read<FeatureView>(bytes); view && !IsForeign(view->session)) ShowFeatures(*view);
  } else if (channel == channels::kGroundTruthPose) {
    const auto pose = Read<GroundTruthPose>(bytes);
    if (pose && !IsForeignFrame(pose->session)) core_->OnTruth(pose->frame_index, pose->T_world_cam);
  } else if (channel == channels::kEndOfSequence) {
    const auto end = Read<EndOfSequence>(bytes);
    if (!end || IsForeignFrame(end->session) || std::exchange(ended_, true)) return;
    board_.Expect("player");
    Note(BoardEvent::Level::kInfo,
         "the sequence has ended: " + std::to_string(end->frames_published) + " frames");
  }
}

template <typename Status>
void ViewerNode::Board(const std::string& name, const Status& status, const std::string& state) {
  if (status.head.session != 0 && status.head.session != session_) return;
  board_.OnStatus(name, status.head, state, context_.now_ns(), context_.wall_us());
}

void ViewerNode::OnStatusMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  if (channel == channels::kPlayerStatus) {
    if (auto status = Read<PlayerStatus>(bytes))
      Board("player", player_ = std::move(*status), StateWord(player_.state));
  } else if (channel == channels::kFrontendStatus) {
    if (auto status = Read<FrontendStatus>(bytes)) {
      Board("frontend", frontend_ = std::move(*status), StateWord(frontend_.state));
    }
  } else if (channel == channels::kMapperStatus) {
    if (auto status = Read<MapperStatus>(bytes))
      Board("mapper", mapper_ = std::move(*status), StateWord(mapper_.state));
  } else if (channel == channels::kLoopcloserStatus) {
    if (auto status = Read<LoopcloserStatus>(bytes)) {
      Board("loopcloser", loopcloser_ = std::move(*status), StateWord(loopcloser_.state));
    }
  }
}

bool ViewerNode::TakeMapRecord() {
  const std::optional<Record> record = map_reader_->Take();
  if (!record) return false;
  if (record->begins_anew()) {
    core_->ForgetMap();
    if (map_records_ > 0)
      Note(BoardEvent::Level::kInfo,
           record->in_snapshot() ? "a snapshot of the map begins" : "a fresh map begins");
  }
  ++map_records_;
  const auto delta = ReadMapRecord(*record, map_reader_.get());
  if (!delta) return true;
  core_->OnMapDelta(*delta);
  NoteMapEvent(*delta);
  map_reader_->AcceptTaken();
  return true;
}

void ViewerNode::NoteMapEvent(const MapDelta& delta) {
  const std::string about = std::to_string(delta.about.value_or(KeyframeId()).frame_index());
  const std::string map = "map " + std::to_string(delta.map_id.value_or(0));
  switch (delta.event) {
    case MapEvent::kMapStarted:
      Note(BoardEvent::Level::kGood, map + " begins");
      break;
    case MapEvent::kMapDropped:
    case MapEvent::kFirstMapRefused:
      Note(BoardEvent::Level::kBad, map + " is given up");
      break;
    case MapEvent::kCorrected:
      ++loops_;
      Note(BoardEvent::Level::kGood,
           "loop closed at keyframe " + about + (delta.note.empty() ? "" : ": " + delta.note));
      break;
    case MapEvent::kGloballyAdjusted:
    case MapEvent::kMapAdjusted:
      Note(BoardEvent::Level::kInfo, "the whole map was adjusted");
      break;
    case MapEvent::kRefused:
      Note(BoardEvent::Level::kBad, "a correction was refused: " + delta.note);
      break;
    case MapEvent::kEnded:
      map_ended_ = true;
      for (const std::string& name : Shown()) board_.Expect(name);
      break;
    default:
      break;
  }
}

bool ViewerNode::TakeFrontendRecord() {
  const std::optional<Record> record = frontend_reader_->Take();
  if (!record) return false;
  if (record->channel == channels::kFramePose) {
    if (const auto pose = Read<FramePose>(*record->bytes)) core_->OnFramePose(*pose);
  } else if (record->channel == channels::kMapReset) {
    const auto reset = Read<MapReset>(*record->bytes);
    if (reset) {
      Note(BoardEvent::Level::kBad, "map " + std::to_string(reset->map_id) + " is left: " + reset->reason);
    }
  }
  frontend_reader_->AcceptTaken();
  return true;
}

bool ViewerNode::TakeLoopRecord() {
  if (!loop_reader_->Take()) return false;
  loop_reader_->AcceptTaken();
  return true;
}

bool ViewerNode::WorkOnce() {
  const bool any = TakeMapRecord() || TakeFrontendRecord() || TakeLoopRecord();
  DrawIfDue();
  ReportIfDue();
  return any;
}

int64_t ViewerNode::WorkDeadline() const {
  if (!core_) return INT64_MAX;
  return core_->dirty() ? std::min(next_draw_ns_, next_report_ns_) : next_report_ns_;
}

void ViewerNode::DrawIfDue() {
  const int64_t now = context_.now_ns();
  if (in_haste_ || !core_->dirty() || now < next_draw_ns_) return;
  next_draw_ns_ = now + kDrawEveryNs;
  uint64_t version = 0;
  uint32_t generation = 0;
  exchange_->Change([&](Scene* scene, FrameSeries*) {
    core_->Draw(scene);
    version = scene->version();
    generation = scene->generation();
  });
  exchange_->hub().Send(EventKind::kMap, "{\"generation\":" + std::to_string(generation) +
                                             ",\"version\":" + std::to_string(version) + "}");
  if (now < next_align_ns_) return;
  next_align_ns_ = now + kAlignEveryNs;
  alignment_ = core_->AlignTruth();
  up_ = core_->Up(alignment_);
}

void ViewerNode::ShowPose(const PoseView& view) {
  exchange_->Change([&](Scene*, FrameSeries* series) { series->Add(view); });
  if (in_haste_) passed_over_[channels::kPoseView] = wire::Encode(view);
  if (!in_haste_) exchange_->hub().Send(EventKind::kPose, PoseJson(view));
  if (shown_state_ != view.state) {
    const bool was_tracking = shown_state_ == TrackingState::kTracking;
    if (view.state == TrackingState::kLost) Note(BoardEvent::Level::kBad, "the camera is lost");
    if (view.state == TrackingState::kTracking && !was_tracking)
      Note(BoardEvent::Level::kGood, "the camera is tracked");
    shown_state_ = view.state;
  }
}

void ViewerNode::ShowFeatures(const FeatureView& view) {
  exchange_->hub().Send(EventKind::kFeatures,
                        FeaturesJson(view, camera_info_->camera.width_px, camera_info_->camera.height_px));
}

/// Heartbeats are told of even when nothing else happens.
void ViewerNode::ReportIfDue() {
  const int64_t now = context_.now_ns();
  if (in_haste_ || now < next_report_ns_) return;
  next_report_ns_ = now + kReportEveryNs;
  if (map_reader_ && map_reader_->writer_present(now)) board_.OnSign("mapper", now);
  if (frontend_reader_ && frontend_reader_->writer_present(now)) board_.OnSign("frontend", now);
  if (loop_reader_ && loop_reader_->writer_present(now)) board_.OnSign("loopcloser", now);
  board_.OnSign("viewer", now);
  board_.Advance(now, context_.wall_us());
  exchange_->hub().Send(EventKind::kStatus, StatusJson());
  exchange_->SetHealth(WriteHealth(board_, frontend_, mapper_));
}

void ViewerNode::PublishStatus() {
  const std::vector<const StreamReader*> readers = {map_reader_.get(), frontend_reader_.get(),
                                                    loop_reader_.get()};
  const StatusHead head = MakeStatusHead(core_ ? "" : "waiting for a camera", readers);
  board_.OnStatus("viewer", head, core_ ? "watching" : "waiting", context_.now_ns(), context_.wall_us());
  ReportIfDue();
}

std::string ViewerNode::StatusJson() const {
  StatusView view;
  view.now_ns = context_.now_ns();
  view.wall_us = context_.wall_us();
  view.session = session_;
  view.camera = camera_info_ ? &*camera_info_ : nullptr;
  view.player = &player_;
  view.frontend = &frontend_;
  view.mapper = &mapper_;
  view.loopcloser = &loopcloser_;
  view.board = &board_;
  view.ended = ended_ || map_ended_;
  view.loops = loops_;
  view.browsers = exchange_->hub().num_listeners();
  view.skipped = exchange_->hub().skipped();
  view.alignment = alignment_ ? &*alignment_ : nullptr;
  view.up = up_;
  if (core_) {
    for (const auto& [id, keyframe] : core_->map().keyframes())
      view.keyframes += keyframe.map_id == core_->shown_map() ? 1 : 0;
    view.map_id = core_->shown_map();
    view.landmarks = core_->map().num_landmarks();
    view.moving = core_->num_moving();
    view.map_version = core_->map().version();
    view.resets = core_->resets();
  }
  return ToJson(view);
}

}  // namespace dmslam
