#include "dmslam/map/map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <unordered_map>

#include "dmslam/util/check.h"
#include "dmslam/util/sorted.h"

namespace dmslam {
namespace {

auto WhereObserved(std::vector<Observation>& observations, KeyframeId keyframe) {
  return std::ranges::lower_bound(observations, keyframe, {}, &Observation::keyframe);
}

/// Those that came last go first, as a rule.
void TakeOut(LandmarkId id, std::vector<LandmarkId>* ids) {
  const auto at = std::find(ids->rbegin(), ids->rend(), id);
  *at = ids->back();
  ids->pop_back();
}

}  // namespace

Map::Map(const Camera& camera, const Pyramid& pyramid)
    : camera_(camera),
      pyramid_(pyramid.OfImages(camera.width_px, camera.height_px)),
      pyramid_table_(pyramid_),
      log_scale_factor_(std::log(pyramid.scale_factor)) {}

void Map::KeepFeaturesIn(std::shared_ptr<FeatureStore> store) {
  if (feature_store_ == store) return;
  feature_store_ = std::move(store);
  if (feature_store_ == nullptr) return;
  for (auto& [id, keyframe] : keyframes_)
    keyframe.features = feature_store_->Keep(std::move(keyframe.features));
}

void Map::TidyFeatures() {
  if (feature_store_ != nullptr) feature_store_->OnChange();
}

const Keyframe* Map::FindKeyframe(KeyframeId id) const {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

std::vector<LandmarkId> Map::LandmarkIdsSorted() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  landmarks_.ForEach([&](const Landmark& landmark) { ids.push_back(landmark.id); });
  std::sort(ids.begin(), ids.end());
  return ids;
}

uint16_t Map::HighestOrdinal() const {
  uint16_t highest = 0;
  for (const LandmarkId id : LandmarkIdsSorted()) highest = std::max(highest, id.epoch_ordinal());
  for (const auto& [id, by] : landmark_tombstones_) highest = std::max(highest, id.epoch_ordinal());
  return highest;
}

const Keyframe& Map::At(KeyframeId id) const {
  const Keyframe* keyframe = FindKeyframe(id);
  DMSLAM_CHECK(keyframe != nullptr, "a keyframe that must be in the map is not");
  return *keyframe;
}

const Landmark& Map::At(LandmarkId id) const {
  const Landmark* landmark = FindLandmark(id);
  DMSLAM_CHECK(landmark != nullptr, "a landmark that must be in the map is not");
  return *landmark;
}

const Landmark* Map::LandmarkSeenBy(const Keyframe& keyframe, size_t feature) const {
  const LandmarkId id = keyframe.landmarks[feature];
  return id.valid() ? FindLandmark(id) : nullptr;
}

bool Map::HasKnown(KeyframeId id) const {
  return keyframes_.contains(id) || keyframe_tombstones_.contains(id);
}

const Landmark* Map::Resolve(LandmarkId id) const {
  for (int steps = 0; steps < 1000; ++steps) {
    if (const Landmark* landmark = FindLandmark(id)) return landmark;
    const auto it = landmark_tombstones_.find(id);
    if (it == landmark_tombstones_.end() || !it->second) return nullptr;
    id = *it->second;
  }
  return nullptr;
}

Rigid3d Map::ResolvedPose::Compose(const Rigid3d& T_other_kf, double scale_then) const {
  const Rigid3d scaled(T_other_kf.rotation, T_other_kf.translation * (scale / scale_then));
  return scaled * T_cam_world;
}

std::optional<Map::ResolvedPose> Map::ResolvePose(KeyframeId id) const {
  if (const Keyframe* keyframe = FindKeyframe(id)) {
    return ResolvedPose{keyframe->T_cam_world, keyframe->scale, keyframe};
  }
  std::vector<const KeyframeTombstone*> chain;
  while (chain.size() < 100000) {
    const auto it = keyframe_tombstones_.find(id);
    if (it == keyframe_tombstones_.end()) return std::nullopt;
    chain.push_back(&it->second);
    id = it->second.parent;
    if (const Keyframe* keyframe = FindKeyframe(id)) {
      ResolvedPose pose{keyframe->T_cam_world, keyframe->scale, keyframe};
      for (auto link = chain.rbegin(); link != chain.rend(); ++link) {
        pose.T_cam_world = pose.Compose((*link)->T_kf_parent, (*link)->parent_scale);
        pose.scale /= (*link)->parent_scale;
      }
      return pose;
    }
  }
  return std::nullopt;
}

const Keyframe* Map::Resolve(KeyframeId id) const {
  for (size_t steps = 0; steps <= keyframe_tombstones_.size(); ++steps) {
    if (const Keyframe* keyframe = FindKeyframe(id)) return keyframe;
    const auto it = keyframe_tombstones_.find(id);
    if (it == keyframe_tombstones_.end()) return nullptr;
    id = it->second.parent;
  }
  return nullptr;
}

const std::vector<KeyframeId>& Map::Children(KeyframeId id) const {
  static const std::vector<KeyframeId> kNone;
  const auto it = children_.find(id);
  return it == children_.end() ? kNone : it->second;
}

std::vector<const Keyframe*> Map::BestCovisible(const Keyframe& keyframe, int most, int min_shared) const {
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [other, shared] : keyframe.covisible) {
    if (shared >= min_shared) ranked.emplace_back(-shared, other);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<const Keyframe*> best;
  for (const auto& [negative, other] : ranked) {
    if (static_cast<int>(best.size()) >= most) break;
    best.push_back(&At(other));
  }
  return best;
}

std::vector<KeyframeId> Map::BestCovisible(KeyframeId id, int most, int min_shared) const {
  std::vector<KeyframeId> ids;
  const Keyframe* keyframe = FindKeyframe(id);
  if (keyframe == nullptr) return ids;
  for (const Keyframe* other : BestCovisible(*keyframe, most, min_shared)) ids.push_back(other->id);
  return ids;
}

bool Map::HasMap(MapId map_id) const {
  return std::ranges::any_of(standpoints_, [&](const Standpoint& at) { return at.map_id == map_id; });
}

bool Map::HasAnotherMap(MapId map_id) const {
  return std::ranges::any_of(standpoints_, [&](const Standpoint& at) { return at.map_id != map_id; });
}

std::vector<const Keyframe*> Map::KeyframesOf(MapId map_id) const {
  std::vector<const Keyframe*> keyframes;
  for (const auto& [id, keyframe] : keyframes_) {
    if (keyframe.map_id == map_id) keyframes.push_back(&keyframe);
  }
  return keyframes;
}

std::vector<const Landmark*> Map::LandmarksOf(MapId map_id) const {
  std::vector<const Landmark*> landmarks;
  landmarks_.ForEach([&](const Landmark& landmark) {
    if (landmark.map_id == map_id) landmarks.push_back(&landmark);
  });
  std::ranges::sort(landmarks, {}, &Landmark::id);
  return landmarks;
}

std::vector<const Keyframe*> Map::KeyframesNear(const Keyframe& keyframe, double distance,
                                                double angle_rad) const {
  const Eigen::Vector3d center = keyframe.T_cam_world.Center();
  std::vector<std::pair<double, KeyframeId>> near;
  for (const Standpoint& other : standpoints_) {
    if (other.map_id != keyframe.map_id || other.id == keyframe.id) continue;
    const double apart = (other.center - center).norm();
    if (apart < distance) near.emplace_back(apart, other.id);
  }
  std::sort(near.begin(), near.end());
  std::vector<const Keyframe*> keyframes;
  for (const auto& [apart, id] : near) {
    const Keyframe& other = At(id);
    if (AngleBetween(other.T_cam_world.rotation, keyframe.T_cam_world.rotation) < angle_rad)
      keyframes.push_back(&other);
  }
  return keyframes;
}

int Map::CountTracked(const Keyframe& keyframe, int min_observations) const {
  int count = 0;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* landmark = LandmarkSeenBy(keyframe, i);
    if (landmark != nullptr && static_cast<int>(landmark->observations.size()) >= min_observations) ++count;
  }
  return count;
}

std::optional<double> Map::MedianDepth(const Keyframe& keyframe) const {
  std::vector<double> depths;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* landmark = LandmarkSeenBy(keyframe, i);
    if (landmark != nullptr) depths.push_back((keyframe.T_cam_world * landmark->p_world).z());
  }
  if (depths.empty()) return std::nullopt;
  const auto middle = depths.begin() + static_cast<ptrdiff_t>((depths.size() - 1) / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

/// None where no keyframe that is there sees it.
std::optional<ViewingRange> Map::ComputeViewing(const Landmark& landmark) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Observation* scale_from = nullptr;  // the reference's, or the oldest where that sees it no more
  for (const Observation& observation : landmark.observations) {
    const Keyframe* keyframe = FindKeyframe(observation.keyframe);
    if (keyframe == nullptr) continue;
    sum += (landmark.p_world - keyframe->T_cam_world.Center()).normalized();
    if (scale_from == nullptr || observation.keyframe == landmark.reference) scale_from = &observation;
  }
  if (scale_from == nullptr) return std::nullopt;
  const Keyframe& keyframe = keyframes_.at(scale_from->keyframe);
  const double distance = (landmark.p_world - keyframe.T_cam_world.Center()).norm();
  ViewingRange viewing;
  viewing.max_distance =
      distance * pyramid_table_.Scale(keyframe.features->set.keypoints[scale_from->feature].octave);
  viewing.min_distance = viewing.max_distance / pyramid_.Scale(pyramid_.NumLevels() - 1);
  viewing.mean_direction = sum.normalized();
  return viewing;
}

// ---- For editor and replica ----

Keyframe* Map::Find(KeyframeId id) {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

Landmark* Map::Find(LandmarkId id) { return landmarks_.Find(id); }

Keyframe& Map::Mutable(const Keyframe& keyframe) {
  assert(FindKeyframe(keyframe.id) == &keyframe);  // no copy, nor one of another map
  return const_cast<Keyframe&>(keyframe);
}

Landmark& Map::Mutable(const Landmark& landmark) {
  assert(FindLandmark(landmark.id) == &landmark);
  return const_cast<Landmark&>(landmark);
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

void Map::Attach(KeyframeId child, std::optional<KeyframeId> parent) {
  if (parent) InsertSorted(children_[*parent], child);
}

void Map::Detach(KeyframeId child, std::optional<KeyframeId> parent) {
  if (!parent) return;
  const auto it = children_.find(*parent);
  if (it == children_.end()) return;
  EraseSorted(it->second, child);
  if (it->second.empty()) children_.erase(it);
}

Keyframe& Map::Insert(Keyframe keyframe) {
  const KeyframeId id = keyframe.id;
  DMSLAM_CHECK(id.valid() && !keyframes_.contains(id), "keyframe added twice");
  DMSLAM_CHECK(keyframe.features != nullptr, "keyframe without features");
  if (feature_store_ != nullptr) keyframe.features = feature_store_->Keep(std::move(keyframe.features));
  keyframe.landmarks.assign(keyframe.features->size(), LandmarkId{});
  keyframe.seen.clear();
  keyframe.covisible.clear();
  Attach(id, keyframe.parent);
  Keyframe& inserted = keyframes_.emplace(id, std::move(keyframe)).first->second;
  UpdateStandpoint(inserted);
  return inserted;
}

Landmark& Map::Insert(Landmark landmark) {
  const LandmarkId id = landmark.id;
  DMSLAM_CHECK(id.valid() && FindLandmark(id) == nullptr, "landmark added twice");
  landmark.observations.clear();
  landmark.viewing_.MarkStale();
  return landmarks_.Insert(std::move(landmark));
}

void Map::Place(Keyframe& keyframe, const Rigid3d& T_cam_world, double scale, MapId map_id) {
  keyframe.T_cam_world = T_cam_world;
  keyframe.scale = scale;
  keyframe.map_id = map_id;
  UpdateStandpoint(keyframe);
}

void Map::Place(Landmark& landmark, const Eigen::Vector3d& p_world) {
  landmark.p_world = p_world;
  landmark.viewing_.MarkStale();
}

/// Each by itself: the order does not matter.
void Map::MoveLandmarks(const std::vector<ReferenceMove>& moves) {
  if (moves.empty()) return;
  std::unordered_map<KeyframeId, const Sim3d*> move_of;
  for (const ReferenceMove& move : moves) move_of[move.reference] = &move.after_from_before;
  landmarks_.ForEach([&](Landmark& landmark) {
    const auto move = move_of.find(landmark.reference);
    if (move != move_of.end()) Place(landmark, *move->second * landmark.p_world);
  });
}

void Map::Hang(Keyframe& keyframe, std::optional<KeyframeId> parent) {
  Detach(keyframe.id, keyframe.parent);
  keyframe.parent = parent;
  Attach(keyframe.id, parent);
}

void Map::SetReference(Landmark& landmark, KeyframeId reference) {
  landmark.reference = reference;
  landmark.viewing_.MarkStale();
}

void Map::Link(const Landmark& landmark, Keyframe& keyframe, int sign) {
  for (const Observation& o : landmark.observations) {
    Keyframe* other = o.keyframe == keyframe.id ? nullptr : Find(o.keyframe);
    if (other == nullptr) continue;
    if ((keyframe.covisible[other->id] += sign) == 0) keyframe.covisible.erase(other->id);
    if ((other->covisible[keyframe.id] += sign) == 0) other->covisible.erase(keyframe.id);
  }
}

std::optional<uint16_t> Map::Observe(Keyframe& keyframe, uint16_t feature, Landmark& landmark) {
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  if (keyframe.landmarks[feature] == landmark.id) return std::nullopt;
  Release(keyframe, feature);
  std::optional<uint16_t> released;
  if (const Observation* before = landmark.SeenBy(keyframe.id)) {
    released = before->feature;
    Release(keyframe, *released);
  }
  keyframe.landmarks[feature] = landmark.id;
  keyframe.seen.push_back(landmark.id);
  landmark.observations.insert(WhereObserved(landmark.observations, keyframe.id), {keyframe.id, feature});
  landmark.viewing_.MarkStale();
  Link(landmark, keyframe, +1);
  return released;
}

void Map::Release(Keyframe& keyframe, uint16_t feature) {
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  const LandmarkId id = std::exchange(keyframe.landmarks[feature], LandmarkId{});
  if (id.valid()) TakeOut(id, &keyframe.seen);
  Landmark* landmark = id.valid() ? Find(id) : nullptr;
  if (landmark == nullptr) return;
  Link(*landmark, keyframe, -1);
  const auto at = WhereObserved(landmark->observations, keyframe.id);
  if (at != landmark->observations.end() && at->keyframe == keyframe.id) landmark->observations.erase(at);
  landmark->viewing_.MarkStale();
}

void Map::EraseKeyframe(KeyframeId id) {
  const auto it = keyframes_.find(id);
  if (it == keyframes_.end()) return;
  Detach(id, it->second.parent);
  keyframes_.erase(it);
  standpoints_.erase(std::ranges::lower_bound(standpoints_, id, {}, &Standpoint::id));
}

void Map::EraseLandmark(LandmarkId id) { landmarks_.Erase(id); }

void Map::Bury(LandmarkId id, std::optional<LandmarkId> replaced_by) {
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

Map::Forgotten Map::Forget(MapId map_id) {
  Forgotten gone;
  for (const Keyframe* keyframe : KeyframesOf(map_id)) gone.keyframes.push_back(keyframe->id);
  for (const Landmark* landmark : LandmarksOf(map_id)) gone.landmarks.push_back(landmark->id);
  for (const LandmarkId id : gone.landmarks) EraseLandmark(id);
  for (const KeyframeId id : gone.keyframes) EraseKeyframe(id);
  return gone;
}

const Keyframe* Map::NewestKeyframeOf(CameraId camera) const {
  for (auto end = keyframes_.end(); end != keyframes_.begin();) {
    const uint32_t session = std::prev(end)->first.session();
    const auto after = keyframes_.upper_bound(KeyframeId::Make(session, kMaxFrames - 1, camera));
    if (after != keyframes_.begin()) {
      const auto& [id, keyframe] = *std::prev(after);
      if (id.session() == session && id.camera() == camera) return &keyframe;
    }
    end = keyframes_.lower_bound(KeyframeId::Make(session, 0));
  }
  return nullptr;
}

// ---- Progress ----

MapProgress Map::progress(CameraId camera) const {
  MapProgress progress = progress_;
  const auto told = progress_of_.find(camera);
  const MapProgress of_camera = told == progress_of_.end() ? MapProgress() : told->second;
  progress.camera = camera;
  progress.frontend = of_camera.frontend;
  progress.settled = of_camera.settled;
  return progress;
}

std::vector<CameraId> Map::cameras() const {
  std::vector<CameraId> cameras;
  for (const auto& [camera, progress] : progress_of_) cameras.push_back(camera);
  return cameras;
}

void Map::SetProgressTo(const MapProgress& progress) {
  progress_ = progress;
  progress_of_[progress.camera] = progress;
}

void Map::ForgetProgress() {
  progress_of_.clear();
  SetProgressTo({});
}

}  // namespace dmslam
