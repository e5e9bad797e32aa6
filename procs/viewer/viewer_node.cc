#include "viewer/viewer_node.h"

#include <algorithm>
#include <utility>

#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/process_info.h"
#include "viewer/viewer_json.h"

namespace dmslam {
namespace {

constexpr int64_t kDrawEveryNs = 120'000'000;
constexpr int64_t kReportEveryNs = 250'000'000;
constexpr int64_t kAlignEveryNs = 1'000'000'000;
constexpr int64_t kPlaceHoldsNs = 500'000'000;  // where a stream comes late, what is said beside it counts

std::vector<std::string> Shown(CameraId num_cameras) {
  std::vector<std::string> names;
  for (const char* role : {roles::kPlayer, roles::kFrontend}) {
    for (CameraId camera = 0; camera < num_cameras; ++camera) names.push_back(OfCamera(role, camera));
  }
  names.insert(names.end(), {roles::kMapper, roles::kLoopCloser, roles::kCollector, roles::kViewer});
  return names;
}

}  // namespace

ViewerNode::ViewerNode(NodeContext context, NodeOptions options, ViewerOptions viewer, Exchange* exchange)
    : StreamNode(std::move(context), std::move(options), roles::kViewer),
      viewer_(std::move(viewer)),
      exchange_(exchange),
      board_(Shown(options_.NumCameras())),
      seen_cameras_(options_.NumCameras()) {
  Listen({channels::kMapperStatus, channels::kLoopcloserStatus, AckChannel(owners::kCollector)});
  if (options_.HasPeer(roles::kCollector)) board_.Need(roles::kCollector);
  for (CameraId camera = 0; camera < options_.NumCameras(); ++camera) {
    Listen({channels::kFrame, channels::kEndOfSequence, channels::kGroundTruthPose, channels::kPoseView,
            channels::kFeatureView, channels::kPlayerStatus, channels::kFrontendStatus},
           camera);
  }
}

SeenCamera* ViewerNode::FindCamera(CameraId camera) {
  return camera < seen_cameras_.size() ? &seen_cameras_[camera] : nullptr;
}

std::string ViewerNode::Who(CameraId camera) const {
  return seen_cameras_.size() == 1 ? "the camera" : "camera " + std::to_string(camera);
}

void ViewerNode::OnCamera(const CameraInfo& info) {
  if (SeenCamera* camera = FindCamera(info.camera_id)) camera->info = info;
}

void ViewerNode::Begin(const CameraInfo& info) {
  core_ = std::make_unique<ViewerCore>(info.camera, options_.settings.Read<Pyramid>(), feature_store_);
  if (!viewer_.ground_truth.empty()) core_->SetTruth(ReadGroundTruth(viewer_.ground_truth).poses);
  exchange_->Change([](ViewerScene* scene, CameraSeries* series) {
    scene->Clear();
    series->Clear();
  });
  map_reader_ = MakeReader(StreamId::kMap);
  for (CameraId camera = 0; camera < seen_cameras_.size(); ++camera)
    seen_cameras_[camera].reader = MakeReader(StreamId::kFrontend, {}, camera);
  loop_reader_ = MakeReader(StreamId::kLoopCloser);
}

void ViewerNode::SetInHaste(bool in_haste) {
  const bool over = in_haste_ && !in_haste;
  in_haste_ = in_haste;
  if (!over) return;
  ShowAtOnce();
  for (const auto& [what, bytes] : std::exchange(passed_over_, {})) OnMessage(what.first, bytes);
}

void ViewerNode::OnMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  if (channel == AckChannel(owners::kCollector)) return OnCollector(channel, bytes);
  OnStatusMessage(channel, bytes);
  if (core_) OnLoose(channel, bytes);
}

/// The collector says no status: what it acknowledges, once a second at least, tells that it is there.
void ViewerNode::OnCollector(const std::string& channel, std::span<const uint8_t> bytes) {
  const std::optional<ack_t> ack = DecodeAck(channel, bytes);
  if (!ack || ack->role != roles::kCollector || session_ == 0 || ack->header.session != session_) return;
  board_.OnWord(roles::kCollector, ack->reader, context_.now_ns(), context_.wall_us());
}

/// In haste pictures are kept, each camera's newest, until it is over.
bool ViewerNode::PassOver(const std::string& channel, std::span<const uint8_t> bytes) {
  if (!in_haste_ || (channel != channels::kFrame && channel != channels::kFeatureView)) return false;
  CameraId camera = 0;
  if (seen_cameras_.size() > 1 && channel == channels::kFrame) {
    if (const auto frame = Read<Frame>(bytes)) camera = frame->camera_id;
  } else if (seen_cameras_.size() > 1) {
    if (const auto view = Read<FeatureView>(bytes)) camera = view->camera_id;
  }
  passed_over_[{channel, camera}].assign(bytes.begin(), bytes.end());
  return true;
}

void ViewerNode::OnLoose(const std::string& channel, std::span<const uint8_t> bytes) {
  if (PassOver(channel, bytes)) return;
  if (channel == channels::kFrame) {
    if (auto frame = Read<Frame>(bytes);
        frame && !IsForeignFrame(frame->session) && FindCamera(frame->camera_id) != nullptr)
      exchange_->AddImage(std::move(*frame));
  } else if (channel == channels::kPoseView) {
    if (const auto view = Read<PoseView>(bytes); view && !IsForeign(view->session)) NotePose(*view);
  } else if (channel == channels::kFeatureView) {
    if (const auto view = Read<FeatureView>(bytes); view && !IsForeign(view->session)) ShowFeatures(*view);
  } else if (channel == channels::kGroundTruthPose) {
    const auto pose = Read<GroundTruthPose>(bytes);
    if (pose && !IsForeignFrame(pose->session) && FindCamera(pose->camera_id) != nullptr)
      core_->OnTruth({pose->camera_id, pose->frame_index}, pose->T_world_cam);
  } else if (channel == channels::kEndOfSequence) {
    const auto end = Read<EndOfSequence>(bytes);
    if (end && !IsForeignFrame(end->session)) OnEnd(*end);
  }
}

void ViewerNode::OnEnd(const EndOfSequence& end) {
  SeenCamera* camera = FindCamera(end.camera_id);
  if (camera == nullptr || std::exchange(camera->ended, true)) return;
  board_.Expect(OfCamera(roles::kPlayer, end.camera_id));
  const std::string whose = seen_cameras_.size() == 1 ? "" : " of camera " + std::to_string(end.camera_id);
  Note(BoardEvent::Level::kInfo,
       "the sequence" + whose + " has ended: " + std::to_string(end.frames_published) + " frames");
  NoteWhatFrontendsDo();
}

/// In a word. Once no frame follows it counts no more how the last one was tracked.
std::string ViewerNode::DoesOf(const SeenCamera& camera) const {
  if (map_ended_) return "done";
  return camera.ended ? "ending" : StateWord(camera.frontend.state);
}

void ViewerNode::NoteWhatFrontendsDo() {
  for (CameraId camera = 0; camera < seen_cameras_.size(); ++camera)
    board_.Does(OfCamera(roles::kFrontend, camera), DoesOf(seen_cameras_[camera]));
}

template <typename Status>
void ViewerNode::Board(const std::string& name, const Status& status, const std::string& state) {
  if (status.head.session != 0 && status.head.session != session_) return;
  board_.OnStatus(name, status.head, state, context_.now_ns(), context_.wall_us());
}

void ViewerNode::OnStatusMessage(const std::string& channel, std::span<const uint8_t> bytes) {
  if (channel == channels::kPlayerStatus) {
    if (const auto status = Read<PlayerStatus>(bytes))
      Board(OfCamera(roles::kPlayer, status->camera_id), *status, StateWord(status->state));
  } else if (channel == channels::kFrontendStatus) {
    auto status = Read<FrontendStatus>(bytes);
    SeenCamera* camera = status ? FindCamera(status->camera_id) : nullptr;
    if (camera == nullptr) return;
    camera->frontend = std::move(*status);
    Board(OfCamera(roles::kFrontend, camera->frontend.camera_id), camera->frontend, DoesOf(*camera));
  } else if (channel == channels::kMapperStatus) {
    if (auto status = Read<MapperStatus>(bytes))
      Board(roles::kMapper, mapper_ = std::move(*status), StateWord(mapper_.state));
  } else if (channel == channels::kLoopcloserStatus) {
    if (auto status = Read<LoopcloserStatus>(bytes)) {
      Board(roles::kLoopCloser, loopcloser_ = std::move(*status), StateWord(loopcloser_.state));
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
  for (const JoinedMaps& joined : core_->TakeJoined()) {
    Note(BoardEvent::Level::kGood, Describe(joined));
    next_align_ns_ = next_report_ns_ = 0;  // what the ground truth was laid on has moved
  }
  NoteMapEvent(*delta);
  map_reader_->AcceptTaken();
  return true;
}

void ViewerNode::NoteMapEvent(const MapDelta& delta) {
  const std::string about = std::to_string(delta.about.value_or(KeyframeId()).frame_index());
  const std::string map = delta.map_id ? NameOf(*delta.map_id) : "a map";
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
    case MapEvent::kCorrectionRefused:
      Note(BoardEvent::Level::kBad, "a correction was refused: " + delta.note);
      break;
    case MapEvent::kEnded:
      map_ended_ = true;
      for (const std::string& name : Shown(options_.NumCameras())) board_.Expect(name);
      NoteWhatFrontendsDo();
      break;
    default:
      break;
  }
}

bool ViewerNode::TakeFrontendRecord() {
  return std::ranges::any_of(seen_cameras_,
                             [this](SeenCamera& camera) { return TakeFrontendRecord(&camera); });
}

bool ViewerNode::TakeFrontendRecord(SeenCamera* camera) {
  const std::optional<Record> record = camera->reader->Take();
  if (!record) return false;
  const std::string channel = SplitCamera(record->channel).channel;
  if (channel == channels::kFramePose) {
    const auto pose = Read<FramePose>(*record->bytes);
    if (pose && FindCamera(pose->camera_id) != nullptr) core_->OnFramePose(*pose);
  } else if (channel == channels::kMapReset) {
    const auto reset = Read<MapReset>(*record->bytes);
    if (reset) {
      Note(BoardEvent::Level::kBad, NameOf(reset->map_id) + " is left: " + reset->reason);
    }
  }
  camera->reader->AcceptTaken();
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
  if (!any) ShowPoses();
  ReportIfDue();
  return any;
}

int64_t ViewerNode::WorkDeadline() const {
  if (!core_) return INT64_MAX;
  return core_->dirty() ? std::min(next_draw_ns_, next_report_ns_) : next_report_ns_;
}

void ViewerNode::DrawIfDue() {
  const int64_t now = context_.now_ns();
  if (in_haste_ || !core_->dirty() || (now < next_draw_ns_ && !core_->moves())) return;
  next_draw_ns_ = now + kDrawEveryNs;
  uint64_t version = 0;
  uint32_t generation = 0;
  exchange_->Change([&](ViewerScene* scene, CameraSeries*) {
    core_->Draw(scene);
    version = scene->version();
    generation = scene->generation();
    arrangement_ = scene->arrangement();
  });
  exchange_->hub().Send(EventKind::kMap, "{\"generation\":" + std::to_string(generation) +
                                             ",\"version\":" + std::to_string(version) + "}");
  if (now < next_align_ns_) return;
  next_align_ns_ = now + kAlignEveryNs;
  alignment_ = core_->AlignTruth();
  up_ = core_->Up(alignment_);
}

void ViewerNode::NotePose(const PoseView& view) {
  SeenCamera* camera = FindCamera(view.camera_id);
  if (camera == nullptr) return;
  exchange_->Change([&](ViewerScene*, CameraSeries* series) { series->Add(view); });
  camera->map_id = view.map_id;
  if (in_haste_) passed_over_[{channels::kPoseView, view.camera_id}] = wire::Encode(view);
  if (!in_haste_) camera->to_show = view;
  NoteState(view);
}

/// Once all that has come is in the map and drawn: a pose and the map that it is in change together.
void ViewerNode::ShowPoses() {
  for (SeenCamera& camera : seen_cameras_) {
    const std::optional<PoseView> view = std::exchange(camera.to_show, std::nullopt);
    if (view)
      exchange_->hub().Send(EventKind::kPose, PoseJson(*view, PlaceOf(*view), arrangement_), view->camera_id);
  }
}

/// By the frontend's stream, whose poses are told from keyframes. Where that comes late, or there is none, by
/// what the frontend took for the map then.
std::optional<Rigid3d> ViewerNode::PlaceOf(const PoseView& view) const {
  if (!view.has_pose) return std::nullopt;
  const std::optional<CameraPlace> place = core_->WhereIs(view.camera_id);
  if (place && view.stamp_ns - place->stamp_ns <= kPlaceHoldsNs) return place->T_world_cam;
  return core_->Drawn(view.T_world_cam, view.map_id);
}

void ViewerNode::NoteState(const PoseView& view) {
  const std::optional<TrackingState> before =
      std::exchange(FindCamera(view.camera_id)->shown_state, view.state);
  if (before == view.state) return;
  if (view.state == TrackingState::kLost) Note(BoardEvent::Level::kBad, Who(view.camera_id) + " is lost");
  if (view.state == TrackingState::kTracking)
    Note(BoardEvent::Level::kGood, Who(view.camera_id) + " is tracked");
}

void ViewerNode::ShowFeatures(const FeatureView& view) {
  if (FindCamera(view.camera_id) == nullptr) return;
  exchange_->hub().Send(EventKind::kFeatures,
                        FeaturesJson(view, camera_info_->camera.width_px, camera_info_->camera.height_px),
                        view.camera_id);
}

/// Heartbeats are told of even when nothing else happens.
void ViewerNode::ReportIfDue() {
  const int64_t now = context_.now_ns();
  if (in_haste_ || now < next_report_ns_) return;
  next_report_ns_ = now + kReportEveryNs;
  if (map_reader_ && map_reader_->writer_present(now)) board_.OnSign(roles::kMapper, now);
  for (CameraId camera = 0; camera < seen_cameras_.size(); ++camera) {
    const StreamReader* reader = seen_cameras_[camera].reader.get();
    if (reader != nullptr && reader->writer_present(now))
      board_.OnSign(OfCamera(roles::kFrontend, camera), now);
  }
  if (loop_reader_ && loop_reader_->writer_present(now)) board_.OnSign(roles::kLoopCloser, now);
  board_.OnSign(roles::kViewer, now);
  board_.Advance(now, context_.wall_us());
  exchange_->hub().Send(EventKind::kStatus, StatusJson());
  exchange_->SetHealth(WriteHealth(board_, seen_cameras_[0].frontend, mapper_));
}

void ViewerNode::PublishStatus() {
  std::vector<const StreamReader*> readers = {map_reader_.get(), loop_reader_.get()};
  for (const SeenCamera& camera : seen_cameras_) readers.push_back(camera.reader.get());
  const StatusHead head = MakeStatusHead(core_ ? "" : "waiting for a camera", readers);
  board_.OnStatus(roles::kViewer, head, core_ ? "watching" : "waiting", context_.now_ns(),
                  context_.wall_us());
  ReportIfDue();
}

std::string ViewerNode::StatusJson() const {
  StatusView view;
  view.now_ns = context_.now_ns();
  view.wall_us = context_.wall_us();
  view.session = session_;
  view.camera = camera_info_ ? &*camera_info_ : nullptr;
  view.frontend = &seen_cameras_[0].frontend;
  view.mapper = &mapper_;
  view.loopcloser = &loopcloser_;
  view.board = &board_;
  view.ended = map_ended_ || std::ranges::all_of(seen_cameras_, &SeenCamera::ended);
  for (const SeenCamera& camera : seen_cameras_)
    view.cameras.push_back({camera.info ? &*camera.info : nullptr, camera.map_id, camera.ended});
  view.loops = loops_;
  view.browsers = exchange_->hub().num_listeners();
  view.skipped = exchange_->hub().skipped();
  view.alignment = alignment_ ? &*alignment_ : nullptr;
  view.up = up_;
  if (core_) {
    view.layout = &core_->layout();
    view.keyframes = core_->map().keyframes().size();
    view.map_id = core_->shown_map();
    view.landmarks = core_->map().num_landmarks();
    view.moving = core_->num_moving();
    view.map_version = core_->map().version();
    view.resets = core_->resets();
  }
  return ToJson(view);
}

}  // namespace dmslam
