#include "dmslam/map/map.h"

#include <algorithm>
#include <cmath>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

template <typename T>
void InsertSorted(std::vector<T>& values, const T& value) {
  const auto at = std::lower_bound(values.begin(), values.end(), value);
  if (at == values.end() || *at != value) values.insert(at, value);
}

template <typename T>
void EraseSorted(std::vector<T>& values, const T& value) {
  const auto at = std::lower_bound(values.begin(), values.end(), value);
  if (at != values.end() && *at == value) values.erase(at);
}

auto FindObservation(std::vector<Observation>& observations, KeyframeId keyframe) {
  return std::lower_bound(observations.begin(), observations.end(), keyframe,
                          [](const Observation& o, KeyframeId id) { return o.keyframe < id; });
}

}  // namespace

Map::Map(const Camera& camera, const Pyramid& pyramid) : camera_(camera), pyramid_(pyramid) {}

// ---- Reading ----

const Keyframe* Map::FindKeyframe(KeyframeId id) const {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

const Landmark* Map::FindLandmark(LandmarkId id) const {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

std::vector<LandmarkId> Map::LandmarkIdsSorted() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  for (const auto& [id, landmark] : landmarks_) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

uint16_t Map::HighestOrdinal() const {
  uint16_t highest = 0;
  for (const LandmarkId id : LandmarkIdsSorted()) highest = std::max(highest, id.epoch_ordinal());
  for (const auto& [id, by] : landmark_tombstones_) highest = std::max(highest, id.epoch_ordinal());
  return highest;
}

std::optional<LandmarkId> Map::Resolve(LandmarkId id) const {
  for (int steps = 0; steps < 1000; ++steps) {
    if (landmarks_.contains(id)) return id;
    const auto it = landmark_tombstones_.find(id);
    if (it == landmark_tombstones_.end() || !it->second.valid()) return std::nullopt;
    id = it->second;
  }
  return std::nullopt;
}

Rigid3d Map::ResolvedPose::Compose(const Rigid3d& T_other_kf, double scale_then) const {
  const Rigid3d scaled(T_other_kf.rotation, T_other_kf.translation * (scale / scale_then));
  return scaled * T_cam_world;
}

std::optional<Map::ResolvedPose> Map::ResolvePose(KeyframeId id) const {
  if (const Keyframe* keyframe = FindKeyframe(id)) {
    return ResolvedPose{keyframe->T_cam_world, keyframe->scale, keyframe->map_id};
  }
  std::vector<const KeyframeTombstone*> chain;
  while (chain.size() < 100000) {
    const auto it = keyframe_tombstones_.find(id);
    if (it == keyframe_tombstones_.end()) return std::nullopt;
    chain.push_back(&it->second);
    id = it->second.parent;
    if (const Keyframe* keyframe = FindKeyframe(id)) {
      ResolvedPose pose{keyframe->T_cam_world, keyframe->scale, keyframe->map_id};
      for (auto link = chain.rbegin(); link != chain.rend(); ++link) {
        pose.T_cam_world = pose.Compose((*link)->T_kf_parent, (*link)->parent_scale);
      }
      return pose;
    }
  }
  return std::nullopt;
}

std::optional<KeyframeId> Map::ResolveKeyframe(KeyframeId id) const {
  for (size_t steps = 0; steps <= keyframe_tombstones_.size(); ++steps) {
    if (keyframes_.contains(id)) return id;
    const auto it = keyframe_tombstones_.find(id);
    if (it == keyframe_tombstones_.end()) return std::nullopt;
    id = it->second.parent;
  }
  return std::nullopt;
}

const std::vector<KeyframeId>& Map::Children(KeyframeId id) const {
  static const std::vector<KeyframeId> kNone;
  const auto it = children_.find(id);
  return it == children_.end() ? kNone : it->second;
}

std::vector<KeyframeId> Map::BestCovisible(KeyframeId id, int most, int min_shared) const {
  const Keyframe* keyframe = FindKeyframe(id);
  if (keyframe == nullptr) return {};
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [other, shared] : keyframe->covisible) {
    if (shared >= min_shared) ranked.emplace_back(-shared, other);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<KeyframeId> best;
  for (const auto& [negative, other] : ranked) {
    if (static_cast<int>(best.size()) >= most) break;
    best.push_back(other);
  }
  return best;
}

std::vector<KeyframeId> Map::KeyframesNear(KeyframeId id, double distance, double angle_rad) const {
  std::vector<KeyframeId> ids;
  const Keyframe* keyframe = FindKeyframe(id);
  if (keyframe == nullptr) return ids;
  const Eigen::Vector3d center = keyframe->T_cam_world.Center();
  std::vector<std::pair<double, KeyframeId>> near;
  for (const Standpoint& other : standpoints_) {
    if (other.map_id != keyframe->map_id || other.id == id) continue;
    const double apart = (other.center - center).norm();
    if (apart < distance) near.emplace_back(apart, other.id);
  }
  std::sort(near.begin(), near.end());
  for (const auto& [apart, other] : near) {
    const Eigen::Quaterniond& rotation = keyframes_.at(other).T_cam_world.rotation;
    if (AngleBetween(rotation, keyframe->T_cam_world.rotation) < angle_rad) ids.push_back(other);
  }
  return ids;
}

int Map::CountTracked(const Keyframe& keyframe, int min_observations) const {
  int count = 0;
  for (const LandmarkId id : keyframe.landmarks) {
    const Landmark* landmark = id.valid() ? FindLandmark(id) : nullptr;
    if (landmark != nullptr && static_cast<int>(landmark->observations.size()) >= min_observations) ++count;
  }
  return count;
}

std::optional<double> Map::MedianDepth(const Keyframe& keyframe) const {
  std::vector<double> depths;
  for (const LandmarkId id : keyframe.landmarks) {
    const Landmark* landmark = id.valid() ? FindLandmark(id) : nullptr;
    if (landmark != nullptr) depths.push_back((keyframe.T_cam_world * landmark->p_world).z());
  }
  if (depths.empty()) return std::nullopt;
  const auto middle = depths.begin() + static_cast<ptrdiff_t>((depths.size() - 1) / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

const Landmark::ViewingRange& Map::Viewing(LandmarkId id) const {
  const auto it = landmarks_.find(id);
  DMSLAM_CHECK(it != landmarks_.end(), "viewing range of an unknown landmark");
  if (it->second.viewing_stale) RefreshViewing(it->second);
  return it->second.viewing;
}

void Map::RefreshViewing(Landmark& landmark) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  landmark.last_ns = landmark.first_ns;
  const Observation* scale_from = nullptr;  // the reference's, or the oldest where that sees it no more
  for (const Observation& observation : landmark.observations) {
    const Keyframe* keyframe = FindKeyframe(observation.keyframe);
    if (keyframe == nullptr) continue;
    sum += (landmark.p_world - keyframe->T_cam_world.Center()).normalized();
    landmark.last_ns = std::max(landmark.last_ns, keyframe->stamp_ns);
    if (scale_from == nullptr || observation.keyframe == landmark.reference) scale_from = &observation;
  }
  landmark.viewing_stale = false;
  if (scale_from == nullptr) return;
  const Keyframe& keyframe = keyframes_.at(scale_from->keyframe);
  const double distance = (landmark.p_world - keyframe.T_cam_world.Center()).norm();
  Landmark::ViewingRange& viewing = landmark.viewing;
  viewing.max_distance =
      distance * pyramid_.Scale(keyframe.features->set.keypoints[scale_from->feature].octave);
  viewing.min_distance = viewing.max_distance / pyramid_.Scale(pyramid_.levels - 1);
  viewing.mean_direction = sum.normalized();
}

// ---- Editing ----

Keyframe& Map::MutableKeyframe(KeyframeId id) {
  const auto it = keyframes_.find(id);
  DMSLAM_CHECK(it != keyframes_.end(), "edit of an unknown keyframe");
  return it->second;
}

Landmark& Map::MutableLandmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  DMSLAM_CHECK(it != landmarks_.end(), "edit of an unknown landmark");
  return it->second;
}

void Map::UpdateStandpoint(const Keyframe& keyframe) {
  const Standpoint standpoint{keyframe.id, keyframe.map_id, keyframe.T_cam_world.Center()};
  const auto at = std::ranges::lower_bound(standpoints_, keyframe.id, {}, &Standpoint::id);
  if (at != standpoints_.end() && at->id == keyframe.id) {
    *at = standpoint;
  } else {
    standpoints_.insert(at, standpoint);
  }
}

void Map::Attach(KeyframeId child, KeyframeId parent) {
  if (parent.valid()) InsertSorted(children_[parent], child);
}

void Map::Detach(KeyframeId child, KeyframeId parent) {
  const auto it = children_.find(parent);
  if (it == children_.end()) return;
  EraseSorted(it->second, child);
  if (it->second.empty()) children_.erase(it);
}

void Map::AddKeyframe(Keyframe keyframe) {
  const KeyframeId id = keyframe.id;
  DMSLAM_CHECK(id.valid() && !keyframes_.contains(id), "keyframe added twice");
  DMSLAM_CHECK(keyframe.features != nullptr, "keyframe without features");
  keyframe.landmarks.assign(keyframe.features->size(), LandmarkId{});
  keyframe.covisible.clear();
  Attach(id, keyframe.parent);
  UpdateStandpoint(keyframes_.emplace(id, std::move(keyframe)).first->second);
  dirty_keyframes_[id] |= kKeyframeStateDirty | kFeaturesDirty;
}

void Map::AddLandmark(Landmark landmark) {
  const LandmarkId id = landmark.id;
  DMSLAM_CHECK(id.valid() && !landmarks_.contains(id), "landmark added twice");
  landmark.observations.clear();
  landmark.viewing_stale = true;
  landmarks_.emplace(id, std::move(landmark));
  dirty_landmarks_[id] |= kStateDirty;
}

void Map::Link(const Landmark& landmark, KeyframeId keyframe, int sign) {
  Keyframe& self = MutableKeyframe(keyframe);
  for (const Observation& other : landmark.observations) {
    if (other.keyframe == keyframe) continue;
    const auto it = keyframes_.find(other.keyframe);
    if (it == keyframes_.end()) continue;
    if ((self.covisible[other.keyframe] += sign) == 0) self.covisible.erase(other.keyframe);
    if ((it->second.covisible[keyframe] += sign) == 0) it->second.covisible.erase(keyframe);
  }
}

void Map::SetObservation(KeyframeId keyframe_id, uint16_t feature, LandmarkId landmark_id) {
  Keyframe& keyframe = MutableKeyframe(keyframe_id);
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  if (keyframe.landmarks[feature] == landmark_id) return;
  Landmark& landmark = MutableLandmark(landmark_id);
  ClearObservation(keyframe_id, feature);
  const auto at = FindObservation(landmark.observations, keyframe_id);
  if (at != landmark.observations.end() && at->keyframe == keyframe_id)
    ClearObservation(keyframe_id, at->feature);
  keyframe.landmarks[feature] = landmark_id;
  landmark.observations.insert(FindObservation(landmark.observations, keyframe_id), {keyframe_id, feature});
  landmark.viewing_stale = true;
  Link(landmark, keyframe_id, +1);
  dirty_observations_.emplace(keyframe_id, feature);
}

void Map::ClearObservation(KeyframeId keyframe_id, uint16_t feature) {
  Keyframe& keyframe = MutableKeyframe(keyframe_id);
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  const LandmarkId landmark_id = keyframe.landmarks[feature];
  if (!landmark_id.valid()) return;
  keyframe.landmarks[feature] = LandmarkId{};
  dirty_observations_.emplace(keyframe_id, feature);
  const auto it = landmarks_.find(landmark_id);
  if (it == landmarks_.end()) return;
  Landmark& landmark = it->second;
  Link(landmark, keyframe_id, -1);
  const auto at = FindObservation(landmark.observations, keyframe_id);
  if (at != landmark.observations.end() && at->keyframe == keyframe_id) landmark.observations.erase(at);
  landmark.viewing_stale = true;
}

void Map::SetPose(KeyframeId id, const Rigid3d& T_cam_world) {
  Keyframe& keyframe = MutableKeyframe(id);
  keyframe.T_cam_world = T_cam_world;
  UpdateStandpoint(keyframe);
  dirty_keyframes_[id] |= kPoseDirty;
}

void Map::SetPoseAndScale(KeyframeId id, const Rigid3d& T_cam_world, double factor) {
  MutableKeyframe(id).scale *= factor;
  SetPose(id, T_cam_world);
}

void Map::SetPosition(LandmarkId id, const Eigen::Vector3d& p_world) {
  Landmark& landmark = MutableLandmark(id);
  landmark.p_world = p_world;
  landmark.viewing_stale = true;
  dirty_landmarks_[id] |= kPositionDirty;
}

void Map::SetEvidence(LandmarkId id, const LandmarkEvidence& evidence) {
  MutableLandmark(id).evidence = evidence;
  dirty_landmarks_[id] |= kEvidenceDirty;
}

void Map::SetParent(KeyframeId id, KeyframeId parent) {
  Keyframe& keyframe = MutableKeyframe(id);
  Detach(id, keyframe.parent);
  keyframe.parent = parent;
  Attach(id, parent);
  dirty_keyframes_[id] |= kKeyframeStateDirty;
}

void Map::AddLoopEdge(KeyframeId a, KeyframeId b) {
  InsertSorted(MutableKeyframe(a).loop_edges, b);
  InsertSorted(MutableKeyframe(b).loop_edges, a);
  dirty_keyframes_[a] |= kKeyframeStateDirty;
  dirty_keyframes_[b] |= kKeyframeStateDirty;
}

void Map::SetMapId(KeyframeId id, MapId map_id) {
  Keyframe& keyframe = MutableKeyframe(id);
  keyframe.map_id = map_id;
  UpdateStandpoint(keyframe);
  dirty_keyframes_[id] |= kKeyframeStateDirty;
}

void Map::SetMapId(LandmarkId id, MapId map_id) {
  MutableLandmark(id).map_id = map_id;
  dirty_landmarks_[id] |= kStateDirty;
}

void Map::UpdateDescriptor(LandmarkId id) {
  Landmark& landmark = MutableLandmark(id);
  std::vector<Descriptor> seen;
  for (const Observation& o : landmark.observations) {
    const Keyframe* keyframe = FindKeyframe(o.keyframe);
    if (keyframe != nullptr) seen.push_back(keyframe->features->set.descriptors[o.feature]);
  }
  if (seen.empty()) return;
  int best_median = 257;
  const Descriptor* best = nullptr;
  std::vector<int> distances(seen.size());
  for (const Descriptor& candidate : seen) {
    for (size_t i = 0; i < seen.size(); ++i) distances[i] = HammingDistance(candidate, seen[i]);
    const auto middle = distances.begin() + static_cast<ptrdiff_t>((distances.size() - 1) / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle < best_median) {
      best_median = *middle;
      best = &candidate;
    }
  }
  if (*best == landmark.descriptor) return;
  landmark.descriptor = *best;
  dirty_landmarks_[id] |= kStateDirty;
}

void Map::Fuse(LandmarkId from, LandmarkId into) {
  if (from == into) return;
  const std::vector<Observation> observations = MutableLandmark(from).observations;
  for (const Observation& o : observations) {
    ClearObservation(o.keyframe, o.feature);
    Landmark& target = MutableLandmark(into);
    const auto at = FindObservation(target.observations, o.keyframe);
    if (at == target.observations.end() || at->keyframe != o.keyframe)
      SetObservation(o.keyframe, o.feature, into);
  }
  const Landmark& gone = MutableLandmark(from);
  Landmark& target = MutableLandmark(into);
  target.evidence.visible += gone.evidence.visible;
  target.evidence.found += gone.evidence.found;
  target.evidence.moved += gone.evidence.moved;
  target.first_ns = std::min(target.first_ns, gone.first_ns);
  target.first_keyframe = std::min(target.first_keyframe, gone.first_keyframe);
  dirty_landmarks_[into] |= kStateDirty;
  EraseLandmark(from);
  Bury(from, into);
  new_landmark_tombstones_.push_back(from);
  UpdateDescriptor(into);
}

void Map::RemoveLandmark(LandmarkId id) {
  const std::vector<Observation> observations = MutableLandmark(id).observations;
  for (const Observation& o : observations) ClearObservation(o.keyframe, o.feature);
  EraseLandmark(id);
  Bury(id, LandmarkId{});
  new_landmark_tombstones_.push_back(id);
}

void Map::Bury(LandmarkId id, LandmarkId replaced_by) {
  if (landmark_tombstones_.insert_or_assign(id, replaced_by).second) burials_.push_back(id);
}

/// Without that of the highest id: HighestOrdinal must not fall.
void Map::ForgetOldTombstones() {
  while (landmark_tombstones_.size() > kLandmarkTombstones) {
    const LandmarkId oldest = burials_.front();
    burials_.pop_front();
    if (oldest == landmark_tombstones_.rbegin()->first) {
      burials_.push_back(oldest);
    } else {
      landmark_tombstones_.erase(oldest);
    }
  }
}

void Map::EraseLandmark(LandmarkId id) {
  landmarks_.erase(id);
  dirty_landmarks_.erase(id);
}

void Map::ReparentChildren(const Keyframe& removed) {
  std::vector<KeyframeId> orphans = Children(removed.id);
  std::vector<KeyframeId> candidates = {removed.parent};
  while (!orphans.empty()) {
    int best_shared = 0;
    KeyframeId best_child, best_parent;
    for (const KeyframeId child : orphans) {
      const Keyframe& keyframe = MutableKeyframe(child);
      for (const KeyframeId candidate : candidates) {
        const auto it = keyframe.covisible.find(candidate);
        if (it != keyframe.covisible.end() && it->second > best_shared) {
          best_shared = it->second;
          best_child = child;
          best_parent = candidate;
        }
      }
    }
    if (best_shared == 0) break;
    SetParent(best_child, best_parent);
    candidates.push_back(best_child);
    EraseSorted(orphans, best_child);
  }
  for (const KeyframeId child : orphans) SetParent(child, removed.parent);
}

void Map::RemoveKeyframe(KeyframeId id) {
  const Keyframe& keyframe = MutableKeyframe(id);
  DMSLAM_CHECK(keyframe.parent.valid() && keyframes_.contains(keyframe.parent),
               "a map's first keyframe stays");
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const LandmarkId landmark_id = keyframe.landmarks[i];
    if (!landmark_id.valid()) continue;
    ClearObservation(id, static_cast<uint16_t>(i));
    Landmark& landmark = MutableLandmark(landmark_id);
    if (landmark.observations.empty()) {
      RemoveLandmark(landmark_id);
    } else if (landmark.reference == id) {
      landmark.reference = landmark.observations.front().keyframe;
      landmark.viewing_stale = true;
      dirty_landmarks_[landmark_id] |= kStateDirty;
    }
  }
  ReparentChildren(keyframe);
  for (const KeyframeId other : keyframe.loop_edges) {
    if (!keyframes_.contains(other)) continue;
    EraseSorted(MutableKeyframe(other).loop_edges, id);
    dirty_keyframes_[other] |= kKeyframeStateDirty;
  }
  const Keyframe& parent = MutableKeyframe(keyframe.parent);
  keyframe_tombstones_[id] = {id, keyframe.parent, keyframe.stamp_ns,
                              keyframe.T_cam_world * parent.T_cam_world.Inverse(), parent.scale};
  new_keyframe_tombstones_.push_back(id);
  EraseKeyframe(id);
}

void Map::EraseKeyframe(KeyframeId id) {
  const auto it = keyframes_.find(id);
  if (it == keyframes_.end()) return;
  Detach(id, it->second.parent);
  keyframes_.erase(it);
  standpoints_.erase(std::ranges::lower_bound(standpoints_, id, {}, &Standpoint::id));
  dirty_keyframes_.erase(id);
  dirty_observations_.erase(dirty_observations_.lower_bound({id, 0}),
                            dirty_observations_.upper_bound({id, 0xffff}));
}

void Map::ForgetMap(MapId map_id) {
  std::vector<KeyframeId> gone;
  for (const auto& [id, keyframe] : keyframes_) {
    if (keyframe.map_id == map_id) gone.push_back(id);
  }
  for (const LandmarkId id : LandmarkIdsSorted()) {
    if (landmarks_.at(id).map_id == map_id) EraseLandmark(id);
  }
  for (const KeyframeId id : gone) EraseKeyframe(id);
}

void Map::DropMap(MapId map_id) {
  ForgetMap(map_id);
  dropped_maps_.push_back(map_id);
}

// ---- Deltas ----

KeyframeState Map::StateOf(const Keyframe& keyframe, bool with_features) const {
  KeyframeState state{keyframe.id,          keyframe.map_id, keyframe.stamp_ns,
                      keyframe.T_cam_world, keyframe.scale,  keyframe.parent,
                      keyframe.loop_edges,  with_features,   {}};
  if (with_features) state.features = keyframe.features->set;
  return state;
}

LandmarkState Map::StateOf(const Landmark& landmark) {
  return {landmark.id,        landmark.map_id,         landmark.p_world,  landmark.descriptor,
          landmark.reference, landmark.first_keyframe, landmark.first_ns, landmark.evidence};
}

MapDelta Map::TakeDelta(MapEvent event, KeyframeId about, MapId map_id) {
  MapDelta delta;
  delta.event = event;
  delta.about = about;
  delta.map_id = map_id;
  delta.version = ++version_;
  delta.progress = progress_;
  if (const Keyframe* keyframe = FindKeyframe(about)) delta.stamp_ns = keyframe->stamp_ns;
  for (const auto& [id, dirty] : dirty_keyframes_) {
    const Keyframe& keyframe = keyframes_.at(id);
    if (dirty & (kKeyframeStateDirty | kFeaturesDirty)) {
      delta.keyframes.push_back(StateOf(keyframe, (dirty & kFeaturesDirty) != 0));
    } else {
      delta.keyframe_poses.push_back({id, keyframe.T_cam_world, keyframe.scale});
    }
  }
  std::vector<std::pair<LandmarkId, uint8_t>> dirty_landmarks(dirty_landmarks_.begin(),
                                                              dirty_landmarks_.end());
  std::sort(dirty_landmarks.begin(), dirty_landmarks.end());
  for (const auto& [id, dirty] : dirty_landmarks) {
    const Landmark& landmark = landmarks_.at(id);
    if (dirty & kStateDirty) {
      delta.landmarks.push_back(StateOf(landmark));
      continue;
    }
    if (dirty & kPositionDirty) delta.landmark_positions.push_back({id, landmark.p_world});
    if (dirty & kEvidenceDirty) delta.landmark_evidence.push_back({id, landmark.evidence});
  }
  for (const auto& [keyframe, feature] : dirty_observations_) {
    delta.observations.push_back({keyframe, feature, keyframes_.at(keyframe).landmarks[feature]});
  }
  for (const KeyframeId id : new_keyframe_tombstones_)
    delta.keyframe_tombstones.push_back(keyframe_tombstones_.at(id));
  for (const LandmarkId id : new_landmark_tombstones_) {
    delta.landmark_tombstones.push_back({id, landmark_tombstones_.at(id)});
  }
  delta.dropped_maps = dropped_maps_;
  ClearJournal();
  ForgetOldTombstones();
  return delta;
}

void Map::ClearJournal() {
  dirty_keyframes_.clear();
  dirty_landmarks_.clear();
  dirty_observations_.clear();
  new_keyframe_tombstones_.clear();
  new_landmark_tombstones_.clear();
  dropped_maps_.clear();
}

void Map::ApplyKeyframes(const MapDelta& delta) {
  for (const KeyframeState& state : delta.keyframes) {
    auto it = keyframes_.find(state.id);
    if (it == keyframes_.end()) {
      if (!state.has_features || keyframe_tombstones_.contains(state.id)) {
        ++skipped_references_;
        continue;
      }
      Keyframe keyframe;
      keyframe.id = state.id;
      keyframe.features = MakeFrameFeatures(state.features, camera_, pyramid_);
      keyframe.parent = state.parent;
      AddKeyframe(std::move(keyframe));
      applied_new_keyframes_.push_back(state.id);
      it = keyframes_.find(state.id);
    }
    Keyframe& keyframe = it->second;
    keyframe.map_id = state.map_id;
    keyframe.stamp_ns = state.stamp_ns;
    keyframe.T_cam_world = state.T_cam_world;
    keyframe.scale = state.scale;
    keyframe.loop_edges = state.loop_edges;
    Detach(state.id, keyframe.parent);
    keyframe.parent = state.parent;
    Attach(state.id, state.parent);
    UpdateStandpoint(keyframe);
  }
  for (const KeyframePose& pose : delta.keyframe_poses) {
    const auto it = keyframes_.find(pose.id);
    if (it == keyframes_.end()) {
      ++skipped_references_;
      continue;
    }
    it->second.T_cam_world = pose.T_cam_world;
    it->second.scale = pose.scale;
    UpdateStandpoint(it->second);
  }
}

void Map::ApplyLandmarks(const MapDelta& delta) {
  for (const LandmarkState& state : delta.landmarks) {
    Landmark& landmark = landmarks_[state.id];
    landmark.id = state.id;
    landmark.map_id = state.map_id;
    landmark.p_world = state.p_world;
    landmark.descriptor = state.descriptor;
    landmark.reference = state.reference;
    landmark.first_keyframe = state.first_keyframe;
    landmark.first_ns = state.first_ns;
    landmark.evidence = state.evidence;
    landmark.viewing_stale = true;
  }
  for (const LandmarkPosition& position : delta.landmark_positions) {
    const auto it = landmarks_.find(position.id);
    if (it == landmarks_.end()) {
      ++skipped_references_;
      continue;
    }
    it->second.p_world = position.p_world;
    it->second.viewing_stale = true;
  }
  for (const LandmarkEvidenceState& state : delta.landmark_evidence) {
    const auto it = landmarks_.find(state.id);
    if (it == landmarks_.end()) {
      ++skipped_references_;
      continue;
    }
    it->second.evidence = state.evidence;
  }
  // First all releases, then all observations: a landmark may have changed its feature within a keyframe.
  for (const ObservationState& o : delta.observations) {
    const auto it = keyframes_.find(o.keyframe);
    if (it == keyframes_.end() || o.feature >= it->second.landmarks.size()) {
      ++skipped_references_;
    } else if (it->second.landmarks[o.feature] != o.landmark) {
      ClearObservation(o.keyframe, o.feature);
    }
  }
  for (const ObservationState& o : delta.observations) {
    const auto it = keyframes_.find(o.keyframe);
    if (!o.landmark.valid() || it == keyframes_.end() || o.feature >= it->second.landmarks.size()) continue;
    if (!landmarks_.contains(o.landmark)) {
      ++skipped_references_;
      continue;
    }
    SetObservation(o.keyframe, o.feature, o.landmark);
  }
}

void Map::ApplyTombstones(const MapDelta& delta) {
  for (const LandmarkTombstone& tombstone : delta.landmark_tombstones) {
    const auto it = landmarks_.find(tombstone.id);
    if (it != landmarks_.end()) {
      const std::vector<Observation> observations = it->second.observations;
      for (const Observation& o : observations) ClearObservation(o.keyframe, o.feature);
      EraseLandmark(tombstone.id);
    }
    Bury(tombstone.id, tombstone.replaced_by);
  }
  for (const KeyframeTombstone& tombstone : delta.keyframe_tombstones) {
    keyframe_tombstones_[tombstone.id] = tombstone;
    const auto it = keyframes_.find(tombstone.id);
    if (it == keyframes_.end()) continue;
    for (size_t i = 0; i < it->second.landmarks.size(); ++i)
      ClearObservation(tombstone.id, static_cast<uint16_t>(i));
    EraseKeyframe(tombstone.id);
    applied_removed_keyframes_.push_back(tombstone.id);
  }
}

void Map::Apply(const MapDelta& delta) {
  applied_new_keyframes_.clear();
  applied_removed_keyframes_.clear();
  for (const MapId map_id : delta.dropped_maps) {
    for (const auto& [id, keyframe] : keyframes_) {
      if (keyframe.map_id == map_id) applied_removed_keyframes_.push_back(id);
    }
    ForgetMap(map_id);
  }
  ApplyKeyframes(delta);
  ApplyLandmarks(delta);
  ApplyTombstones(delta);
  version_ = std::max(version_, delta.version);
  progress_ = delta.progress;
  ClearJournal();
  ForgetOldTombstones();
}

std::vector<MapDelta> Map::Snapshot(KeyframeId center, size_t max_bytes_hint) const {
  constexpr size_t kFeatureBytes = 42, kLandmarkBytes = 120, kObservationBytes = 18, kSmallBytes = 90;
  std::vector<KeyframeId> order = BestCovisible(center, static_cast<int>(keyframes_.size()), 1);
  if (keyframes_.contains(center)) order.insert(order.begin(), center);
  std::set<KeyframeId> listed(order.begin(), order.end());
  for (auto it = keyframes_.rbegin(); it != keyframes_.rend(); ++it) {
    if (listed.insert(it->first).second) order.push_back(it->first);
  }
  std::vector<MapDelta> parts(1);
  size_t bytes = 0;
  const auto room_for = [&](size_t more) -> MapDelta& {
    if (bytes + more > max_bytes_hint && bytes > 0) {
      parts.emplace_back();
      bytes = 0;
    }
    bytes += more;
    return parts.back();
  };
  std::set<LandmarkId> sent;
  for (const KeyframeId id : order) {
    const Keyframe& keyframe = keyframes_.at(id);
    room_for(kFeatureBytes * keyframe.features->size() + kSmallBytes)
        .keyframes.push_back(StateOf(keyframe, true));
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const LandmarkId landmark_id = keyframe.landmarks[i];
      if (!landmark_id.valid()) continue;
      if (sent.insert(landmark_id).second) {
        room_for(kLandmarkBytes).landmarks.push_back(StateOf(landmarks_.at(landmark_id)));
      }
      room_for(kObservationBytes).observations.push_back({id, static_cast<uint16_t>(i), landmark_id});
    }
  }
  if (sent.size() <
      landmarks_.size()) {  // some that nobody observes: their last feature was given to another
    for (const LandmarkId id : LandmarkIdsSorted())
      if (!sent.contains(id)) room_for(kLandmarkBytes).landmarks.push_back(StateOf(landmarks_.at(id)));
  }
  for (const auto& [id, tombstone] : keyframe_tombstones_)
    room_for(kSmallBytes).keyframe_tombstones.push_back(tombstone);
  for (const LandmarkId id : burials_) {
    room_for(16).landmark_tombstones.push_back({id, landmark_tombstones_.at(id)});
  }
  for (MapDelta& part : parts) {
    part.event = MapEvent::kSnapshot;
    part.version = version_;
    part.progress = progress_;
    part.about = center;
  }
  return parts;
}

}  // namespace dmslam
