#include "viewer/viewer_core.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/evaluation/alignment.h"

namespace dmslam {
namespace {

constexpr int kMostLinks = 6;     // covisible neighbours drawn per keyframe
constexpr int kMinShared = 30;    // landmarks that such a neighbour shares
constexpr size_t kMinPairs = 10;  // of path and ground truth
constexpr size_t kMostPairs = 3000;
constexpr int64_t kTruthStepNs = 30'000'000;  // of a ground truth from a file
constexpr int64_t kTruthNearNs = 20'000'000;

SceneFrame FrameOf(const FramePose& pose) { return {pose.camera_id, pose.frame_index}; }

Float3 ToFloats(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

std::array<float, 4> ToFloats(const Eigen::Quaterniond& q) {
  return {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()),
          static_cast<float>(q.w())};
}

/// See ScenePoint. In steps, so that what nobody sees changes nothing; which side of the threshold it is on
/// shows always.
float StepOverThreshold(const Landmark& landmark) {
  constexpr float kStepOfBelief = 1.0F / 8, kMost = 8.0F;
  const float over = std::clamp(landmark.evidence.motion_belief - kBelievedToMove, -kMost, kMost);
  const float step = std::round(over / kStepOfBelief) * kStepOfBelief;
  return IsStatic(&landmark) ? std::min(step, 0.0F) : std::max(step, kStepOfBelief);
}

/// Whether keyframes move far, and many at once.
bool IsCorrection(MapEvent event) {
  return event == MapEvent::kCorrected || event == MapEvent::kGloballyAdjusted ||
         event == MapEvent::kMapAdjusted;
}

}  // namespace

void ViewerCore::OnMapDelta(const MapDelta& delta) {
  NoteJoined(delta);
  map_.Apply(delta);
  if (!delta.dropped_maps.empty()) {
    ++resets_;
    MarkAll();
  }
  if (IsCorrection(delta.event)) moves_ = true;
  Mark(delta);
  HandFramesOn(delta);
  ChooseMap();
  dirty_ = true;
}

/// A keyframe that is in another map now takes its whole map with it.
void ViewerCore::NoteJoined(const MapDelta& delta) {
  for (const KeyframeState& state : delta.keyframes) {
    const Keyframe* before = map_.FindKeyframe(state.id);
    if (before == nullptr || before->map_id == state.map_id) continue;
    moves_ = true;
    const bool known = std::ranges::any_of(joined_, [&](const JoinedMaps& joined) {
      return joined.from == before->map_id && joined.into == state.map_id;
    });
    if (!known) joined_.push_back({before->map_id, state.map_id});
  }
}

void ViewerCore::Mark(const MapDelta& delta) {
  for (const auto& state : delta.landmarks) dirty_points_.insert(state.id);
  for (const auto& state : delta.landmark_positions) dirty_points_.insert(state.id);
  if (!delta.reference_moves.empty()) MarkMoved(delta.reference_moves);
  for (const auto& state : delta.landmark_evidence) dirty_points_.insert(state.id);
  for (const auto& tombstone : delta.landmark_tombstones) dirty_points_.insert(tombstone.id);
  for (const auto& state : delta.keyframes) dirty_keyframes_.insert(state.id);
  for (const auto& state : delta.keyframe_poses) dirty_keyframes_.insert(state.id);
  for (const auto& state : delta.observations) dirty_keyframes_.insert(state.keyframe);
  for (const auto& tombstone : delta.keyframe_tombstones) dirty_keyframes_.insert(tombstone.id);
}

void ViewerCore::MarkMoved(const std::vector<ReferenceMove>& moves) {
  std::set<KeyframeId> references;
  for (const ReferenceMove& move : moves) references.insert(move.reference);
  for (const LandmarkId id : map_.LandmarkIdsSorted()) {
    if (references.contains(map_.At(id).reference)) dirty_points_.insert(id);
  }
}

/// Frames that were told from a keyframe that is culled hang on the one that stands for it; those of a
/// keyframe that moved move with it.
void ViewerCore::HandFramesOn(const MapDelta& delta) {
  for (const KeyframeTombstone& tombstone : delta.keyframe_tombstones) {
    const auto it = frames_of_.find(tombstone.id);
    const Keyframe* heir = map_.Resolve(tombstone.id);
    if (it == frames_of_.end() || heir == nullptr) continue;
    const std::vector<SceneFrame> frames = std::move(it->second);
    frames_of_.erase(it);
    std::vector<SceneFrame>& inherited = frames_of_[heir->id];
    inherited.insert(inherited.end(), frames.begin(), frames.end());
    dirty_frames_.insert(frames.begin(), frames.end());
  }
  const auto moved = [this](KeyframeId id) {
    const auto it = frames_of_.find(id);
    if (it != frames_of_.end()) dirty_frames_.insert(it->second.begin(), it->second.end());
  };
  for (const auto& state : delta.keyframes) moved(state.id);
  for (const auto& state : delta.keyframe_poses) moved(state.id);
}

void ViewerCore::OnFramePose(const FramePose& pose) {
  newest_ns_ = std::max(newest_ns_, pose.stamp_ns);
  dirty_ = true;
  NoteCamera(pose);
  if (!pose.HasPose()) return;
  frames_[FrameOf(pose)] = pose;
  const Keyframe* reference = map_.Resolve(*pose.reference);
  frames_of_[reference != nullptr ? reference->id : *pose.reference].push_back(FrameOf(pose));
  dirty_frames_.insert(FrameOf(pose));
  const bool is_shown = shown_map_ && pose.map_id == shown_map_;
  if (pose.state != TrackingState::kLocalizedLater && !is_shown) ChooseMap();
}

/// A frame that waits its turn behind the first map says nothing of where the camera is, and what is told
/// later of one that had no place does not bring the camera back.
void ViewerCore::NoteCamera(const FramePose& pose) {
  uint32_t& newest = newest_.try_emplace(pose.camera_id, pose.frame_index).first->second;
  if (pose.frame_index < newest) return;
  newest = pose.frame_index;
  if (pose.state == TrackingState::kWaitingForMap || pose.state == TrackingState::kLocalizedLater) return;
  if (pose.HasPose()) {
    present_[pose.camera_id] = pose.frame_index;
  } else {
    present_.erase(pose.camera_id);
  }
}

void ViewerCore::ForgetMap() {
  map_.Clear();
  MarkAll();
}

void ViewerCore::MarkAll() {
  void_ = true;
  dirty_ = true;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    dirty_keyframes_.insert(id);
    for (const LandmarkId landmark : keyframe.landmarks) {
      if (landmark.valid()) dirty_points_.insert(landmark);
    }
  }
  MarkFrames();
}

void ViewerCore::MarkFrames() {
  for (const auto& [frame, pose] : frames_) dirty_frames_.insert(frame);
}

/// It is drawn somewhere else, or in another colour.
void ViewerCore::MarkMap(MapId map_id) {
  for (const Keyframe* keyframe : map_.KeyframesOf(map_id)) dirty_keyframes_.insert(keyframe->id);
  for (const Landmark* landmark : map_.LandmarksOf(map_id)) dirty_points_.insert(landmark->id);
}

/// What it was told from may have become part of another map.
std::optional<MapId> ViewerCore::MapOf(const FramePose& pose) const {
  const Keyframe* reference = map_.Resolve(*pose.reference);
  return reference != nullptr ? std::optional(reference->map_id) : pose.map_id;
}

/// By camera: the map of its newest frame that has a pose.
std::vector<std::optional<MapId>> ViewerCore::WhereCamerasAre() const {
  std::vector<std::optional<MapId>> maps;
  for (auto it = frames_.begin(); it != frames_.end();) {
    it = frames_.lower_bound({it->first.camera + 1, 0});
    maps.push_back(MapOf(std::prev(it)->second));
  }
  return maps;
}

/// The one that is shown, as long as a camera is in it; else the one in which the first camera was last, as
/// long as it is there; else the one with most keyframes.
void ViewerCore::ChooseMap() {
  std::map<MapId, size_t> keyframes_in;
  for (const auto& [id, keyframe] : map_.keyframes()) ++keyframes_in[keyframe.map_id];
  std::optional<MapId> chosen;
  for (const std::optional<MapId> map_id : WhereCamerasAre()) {
    if (!map_id || !keyframes_in.contains(*map_id)) continue;
    if (map_id == shown_map_) return;
    if (!chosen) chosen = map_id;
  }
  if (!chosen) {
    for (const auto& [map_id, count] : keyframes_in) {
      if (!chosen || count > keyframes_in.at(*chosen)) chosen = map_id;
    }
  }
  if (!chosen || chosen == shown_map_) return;
  shown_map_ = chosen;
  MarkFrames();
}

void ViewerCore::OnTruth(const SceneFrame& frame, const Rigid3d& T_world_cam) {
  if (!truth_file_.empty() && frame.camera == 0) return;
  truth_[frame.camera].try_emplace(frame.index, TruePosition{T_world_cam.translation});
  dirty_ = true;
}

std::optional<Rigid3d> ViewerCore::Drawn(const Rigid3d& T_world_cam, std::optional<MapId> map_id) const {
  if (!map_id || layout_.places().empty()) return T_world_cam;
  const MapLayout::Place* place = layout_.Find(*map_id);
  if (place == nullptr) return std::nullopt;
  return Rigid3d(T_world_cam.rotation, T_world_cam.translation + place->offset);
}

std::optional<CameraPlace> ViewerCore::WhereIs(CameraId camera) const {
  const auto present = present_.find(camera);
  if (present == present_.end()) return std::nullopt;
  const FramePose& pose = frames_.at({camera, present->second});
  const std::optional<Map::ResolvedPose> reference = map_.ResolvePose(*pose.reference);
  const MapLayout::Place* place = reference ? layout_.Find(reference->map_id()) : nullptr;
  if (place == nullptr) return std::nullopt;
  const Rigid3d T_world_cam = reference->Compose(pose.T_cam_reference, pose.reference_scale).Inverse();
  return CameraPlace{pose.stamp_ns, Rigid3d(T_world_cam.rotation, T_world_cam.translation + place->offset)};
}

void ViewerCore::Draw(ViewerScene* scene) {
  if (void_) {
    scene->Clear();
    positions_.clear();
    truth_file_next_ = 0;
    for (auto& [camera, truths] : truth_) {
      for (auto& [index, truth] : truths) truth.drawn = false;
    }
  }
  scene->Advance();
  const std::set<MapId> rearranged = layout_.Arrange(map_, shown_map_);
  for (const MapId map_id : rearranged) MarkMap(map_id);
  if (!rearranged.empty()) MarkFrames();
  if (moves_ || !rearranged.empty()) scene->Rearrange();
  for (const LandmarkId id : dirty_points_) DrawPoint(id, scene);
  if (scene->points().size() > map_.num_landmarks()) SweepPoints(scene);
  for (const KeyframeId id : dirty_keyframes_) DrawKeyframe(id, scene);
  for (const KeyframeId id : dirty_keyframes_) {  // once more where the parent has only now got its place
    const Keyframe* keyframe = map_.FindKeyframe(id);
    if (keyframe != nullptr && keyframe->parent > id) DrawKeyframe(id, scene);
  }
  for (const SceneFrame& frame : dirty_frames_) DrawFrame(frame, scene);
  DrawTruth(scene);
  DrawCameras(scene);
  if (!dirty_points_.empty()) {
    num_moving_ = 0;
    for (const auto& slot : scene->points().slots()) num_moving_ += slot.alive && slot.value.moves() ? 1 : 0;
  }
  dirty_points_.clear();
  dirty_keyframes_.clear();
  dirty_frames_.clear();
  void_ = moves_ = dirty_ = false;
}

void ViewerCore::DrawCameras(ViewerScene* scene) const {
  std::map<CameraId, SceneCamera> cameras;
  for (const auto& [camera, frame] : present_) {
    const std::optional<CameraPlace> place = WhereIs(camera);
    if (place)
      cameras[camera] = {ToFloats(place->T_world_cam.translation), ToFloats(place->T_world_cam.rotation)};
  }
  scene->SetCameras(std::move(cameras));
}

void ViewerCore::DrawPoint(LandmarkId id, ViewerScene* scene) {
  const Landmark* landmark = map_.FindLandmark(id);
  const MapLayout::Place* place = landmark == nullptr ? nullptr : layout_.Find(landmark->map_id);
  if (place == nullptr) {
    scene->RemovePoint(id);
    return;
  }
  scene->SetPoint(id, {ToFloats(landmark->p_world + place->offset), StepOverThreshold(*landmark),
                       landmark->first_keyframe.frame_index(), place->colour});
}

/// Takes out what is no longer in the map although nobody said so (landmarks that went with their last
/// keyframe).
void ViewerCore::SweepPoints(ViewerScene* scene) {
  std::vector<LandmarkId> gone;
  for (const auto& [id, slot] : scene->points().index()) {
    if (map_.FindLandmark(id) == nullptr) gone.push_back(id);
  }
  for (const LandmarkId id : gone) scene->RemovePoint(id);
}

void ViewerCore::DrawKeyframe(KeyframeId id, ViewerScene* scene) {
  const Keyframe* keyframe = map_.FindKeyframe(id);
  const MapLayout::Place* place = keyframe == nullptr ? nullptr : layout_.Find(keyframe->map_id);
  if (place == nullptr) {
    scene->RemoveKeyframe(id);
    return;
  }
  SceneKeyframe drawn;
  drawn.colour = place->colour;
  drawn.center = ToFloats(keyframe->T_cam_world.Center() + place->offset);
  drawn.rotation = ToFloats(keyframe->T_cam_world.rotation.conjugate());
  const auto link = [&](KeyframeId other, SceneKeyframe::LinkKind kind) {
    const int64_t slot = scene->keyframes().Find(other);
    const bool known =
        std::any_of(drawn.links.begin(), drawn.links.end(), [slot](const auto& l) { return l.slot == slot; });
    if (slot >= 0 && !known) drawn.links.push_back({static_cast<uint32_t>(slot), kind});
  };
  for (const KeyframeId other : keyframe->loop_edges) link(other, SceneKeyframe::LinkKind::kLoop);
  if (keyframe->parent) link(*keyframe->parent, SceneKeyframe::LinkKind::kParent);
  for (const KeyframeId other : map_.BestCovisible(id, kMostLinks, kMinShared)) {
    if (other < id) link(other, SceneKeyframe::LinkKind::kCovisible);
  }
  scene->SetKeyframe(id, drawn);
}

void ViewerCore::DrawFrame(const SceneFrame& frame, ViewerScene* scene) {
  const FramePose& pose = frames_.at(frame);
  const std::optional<Map::ResolvedPose> reference = map_.ResolvePose(*pose.reference);
  const MapLayout::Place* place = reference ? layout_.Find(reference->map_id()) : nullptr;
  positions_.erase(frame);
  if (place == nullptr) {
    scene->RemovePath(frame);
    return;
  }
  const Eigen::Vector3d position = reference->Compose(pose.T_cam_reference, pose.reference_scale).Center();
  if (reference->map_id() == shown_map_) positions_[frame] = position;
  scene->SetPath(frame, {ToFloats(position + place->offset), pose.state == TrackingState::kLocalizedLater,
                         place->colour});
}

void ViewerCore::DrawTruthFile(ViewerScene* scene) {
  std::optional<int64_t> last_ns;
  if (truth_file_next_ > 0) last_ns = truth_file_[truth_file_next_ - 1].stamp_ns;
  for (; truth_file_next_ < truth_file_.size(); ++truth_file_next_) {
    const StampedPose& pose = truth_file_[truth_file_next_];
    if (pose.stamp_ns > newest_ns_) break;
    if (frames_.empty() || pose.stamp_ns < frames_.begin()->second.stamp_ns - kTruthStepNs) continue;
    if (last_ns && pose.stamp_ns - *last_ns < kTruthStepNs) continue;
    last_ns = pose.stamp_ns;
    scene->SetTruth({0, static_cast<uint32_t>(truth_file_next_)}, ToFloats(pose.T_world_cam.translation));
  }
}

bool ViewerCore::IsInShownMap(CameraId camera) const {
  const auto first = positions_.lower_bound({camera, 0});
  return first != positions_.end() && first->first.camera == camera;
}

/// Of cameras that have a part in the map on which it is laid: the others may be in another world.
void ViewerCore::DrawTruth(ViewerScene* scene) {
  DrawTruthFile(scene);
  for (auto& [camera, truths] : truth_) {
    if (!IsInShownMap(camera)) continue;
    for (auto it = truths.rbegin(); it != truths.rend() && !it->second.drawn; ++it) {
      it->second.drawn = true;
      scene->SetTruth({camera, it->first}, ToFloats(it->second.position));
    }
  }
}

std::optional<Eigen::Vector3d> ViewerCore::TruthAt(const SceneFrame& frame) const {
  if (const auto truths = truth_.find(frame.camera); truths != truth_.end()) {
    const auto it = truths->second.find(frame.index);
    if (it != truths->second.end()) return it->second.position;
  }
  if (frame.camera != 0) return std::nullopt;
  const int64_t stamp_ns = frames_.at(frame).stamp_ns;
  const auto near = std::lower_bound(truth_file_.begin(), truth_file_.end(), stamp_ns - kTruthNearNs,
                                     [](const StampedPose& pose, int64_t ns) { return pose.stamp_ns < ns; });
  if (near == truth_file_.end() || near->stamp_ns > stamp_ns + kTruthNearNs) return std::nullopt;
  return near->T_world_cam.translation;
}

std::optional<TruthAlignment> ViewerCore::AlignTruth() const {
  std::vector<Eigen::Vector3d> on_map, on_truth;
  const size_t step = positions_.size() / kMostPairs + 1;
  size_t number = 0;
  for (const auto& [frame, position] : positions_) {
    if (number++ % step != 0) continue;
    const std::optional<Eigen::Vector3d> truth = TruthAt(frame);
    if (!truth) continue;
    on_map.push_back(position);
    on_truth.push_back(*truth);
  }
  if (on_map.size() < kMinPairs) return std::nullopt;
  const std::optional<Sim3d> truth_from_map = AlignPoints(on_map, on_truth, Alignment::kSim3);
  if (!truth_from_map || !(truth_from_map->scale > 0)) return std::nullopt;
  TruthAlignment alignment{truth_from_map->Inverse(), 0, on_map.size()};
  for (size_t i = 0; i < on_map.size(); ++i)
    alignment.rmse_m += (*truth_from_map * on_map[i] - on_truth[i]).squaredNorm();
  alignment.rmse_m = std::sqrt(alignment.rmse_m / static_cast<double>(on_map.size()));
  return alignment;
}

Eigen::Vector3d ViewerCore::Up(const std::optional<TruthAlignment>& alignment) const {
  if (alignment) return alignment->map_from_truth.rotation * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const auto& [id, keyframe] : map_.keyframes()) {
    if (keyframe.map_id == shown_map_)
      up += keyframe.T_cam_world.rotation.conjugate() * -Eigen::Vector3d::UnitY();
  }
  return up.norm() > 1e-6 ? up.normalized() : -Eigen::Vector3d::UnitY();
}

}  // namespace dmslam
