#include "dmslam/map/map_editor.h"

#include <algorithm>
#include <utility>

#include "dmslam/util/check.h"
#include "dmslam/util/sorted.h"

namespace dmslam {
namespace {

using KeyframeChange = MapJournal::KeyframeChange;
using LandmarkChange = MapJournal::LandmarkChange;

/// The descriptor with the least median distance to all; null where there is none. Ties go to the first.
const Descriptor* MiddleOf(const std::vector<Descriptor>& seen) {
  int best_median = kNoDistance;
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
  return best;
}

}  // namespace

const Keyframe& MapEditor::AddKeyframe(Keyframe keyframe) {
  const Keyframe& added = Insert(std::move(keyframe));
  journal_.Note(added.id, KeyframeChange::kState);
  journal_.Note(added.id, KeyframeChange::kFeatures);
  return added;
}

const Landmark& MapEditor::AddLandmark(Landmark landmark) {
  const Landmark& added = Insert(std::move(landmark));
  journal_.Note(added.id, LandmarkChange::kState);
  return added;
}

void MapEditor::SetObservation(const Keyframe& keyframe, uint16_t feature, const Landmark& landmark) {
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  if (keyframe.landmarks[feature] == landmark.id) return;
  const std::optional<uint16_t> released = Observe(Mutable(keyframe), feature, Mutable(landmark));
  if (released) journal_.NoteObservation(keyframe.id, *released);
  journal_.NoteObservation(keyframe.id, feature);
}

void MapEditor::ClearObservation(const Keyframe& keyframe, uint16_t feature) {
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  if (!keyframe.landmarks[feature].valid()) return;
  Release(Mutable(keyframe), feature);
  journal_.NoteObservation(keyframe.id, feature);
}

void MapEditor::SetPose(const Keyframe& keyframe, const Rigid3d& T_cam_world) {
  SetPoseAndScale(keyframe, T_cam_world, 1.0);
}

void MapEditor::SetPoseAndScale(const Keyframe& keyframe, const Rigid3d& T_cam_world, double factor) {
  Place(Mutable(keyframe), T_cam_world, keyframe.scale * factor, keyframe.map_id);
  journal_.Note(keyframe.id, KeyframeChange::kPose);
}

void MapEditor::SetPosition(const Landmark& landmark, const Eigen::Vector3d& p_world) {
  Place(Mutable(landmark), p_world);
  journal_.Note(landmark.id, LandmarkChange::kPosition);
}

void MapEditor::MoveWithReference(const Landmark& landmark, const Sim3d& after_from_before) {
  Place(Mutable(landmark), after_from_before * landmark.p_world);
  journal_.NoteMoveWithReference(landmark, after_from_before);
}

void MapEditor::SetEvidence(const Landmark& landmark, const LandmarkEvidence& evidence) {
  Mutable(landmark).evidence = evidence;
  journal_.Note(landmark.id, LandmarkChange::kEvidence);
}

void MapEditor::SetParent(const Keyframe& keyframe, std::optional<KeyframeId> parent) {
  Hang(Mutable(keyframe), parent);
  journal_.Note(keyframe.id, KeyframeChange::kState);
}

void MapEditor::AddLoopEdge(const Keyframe& a, const Keyframe& b) {
  InsertSorted(Mutable(a).loop_edges, b.id);
  InsertSorted(Mutable(b).loop_edges, a.id);
  journal_.Note(a.id, KeyframeChange::kState);
  journal_.Note(b.id, KeyframeChange::kState);
}

void MapEditor::SetMapId(const Keyframe& keyframe, MapId map_id) {
  Place(Mutable(keyframe), keyframe.T_cam_world, keyframe.scale, map_id);
  journal_.Note(keyframe.id, KeyframeChange::kState);
}

void MapEditor::SetMapId(const Landmark& landmark, MapId map_id) {
  Mutable(landmark).map_id = map_id;
  journal_.Note(landmark.id, LandmarkChange::kState);
}

void MapEditor::UpdateDescriptor(const Landmark& landmark) {
  std::vector<Descriptor> seen;
  for (const Observation& o : landmark.observations) {
    const Keyframe* keyframe = FindKeyframe(o.keyframe);
    if (keyframe != nullptr) seen.push_back(keyframe->features->set.descriptors[o.feature]);
  }
  const Descriptor* middle = MiddleOf(seen);
  if (middle == nullptr || *middle == landmark.descriptor) return;
  Mutable(landmark).descriptor = *middle;
  journal_.Note(landmark.id, LandmarkChange::kState);
}

void MapEditor::Fuse(const Landmark& from, const Landmark& into, const LandmarkEvidence& evidence) {
  if (&from == &into) return;
  const std::vector<Observation> observations = from.observations;
  for (const Observation& o : observations) {
    const Keyframe& keyframe = At(o.keyframe);
    ClearObservation(keyframe, o.feature);
    if (into.SeenBy(o.keyframe) == nullptr) SetObservation(keyframe, o.feature, into);
  }
  Landmark& target = Mutable(into);
  target.evidence = evidence;
  target.first_ns = std::min(target.first_ns, from.first_ns);
  target.first_keyframe = std::min(target.first_keyframe, from.first_keyframe);
  journal_.Note(into.id, LandmarkChange::kState);
  EraseAndBury(from, into.id);
  UpdateDescriptor(into);
}

void MapEditor::RemoveLandmark(const Landmark& landmark) {
  const std::vector<Observation> observations = landmark.observations;
  for (const Observation& o : observations) ClearObservation(At(o.keyframe), o.feature);
  EraseAndBury(landmark, std::nullopt);
}

/// Of a landmark that nobody sees any more.
void MapEditor::EraseAndBury(const Landmark& landmark, std::optional<LandmarkId> replaced_by) {
  const LandmarkId id = landmark.id;
  EraseLandmark(id);
  journal_.Forget(id);
  Bury(id, replaced_by);
  journal_.NoteTombstone(id);
}

/// Children hang on whom they share most with: the removed keyframe's parent, or one of them that hangs
/// already.
void MapEditor::ReparentChildren(const Keyframe& removed, KeyframeId parent) {
  std::vector<KeyframeId> orphans = Children(removed.id);
  std::vector<KeyframeId> candidates = {parent};
  while (!orphans.empty()) {
    int best_shared = 0;
    KeyframeId best_child, best_parent;
    for (const KeyframeId child : orphans) {
      const Keyframe& keyframe = At(child);
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
    SetParent(At(best_child), best_parent);
    candidates.push_back(best_child);
    std::erase(orphans, best_child);
  }
  for (const KeyframeId child : orphans) SetParent(At(child), parent);
}

/// The landmark that feature `feature` of a keyframe sees loses it; one that nobody else sees goes.
void MapEditor::TakeFrom(const Keyframe& keyframe, uint16_t feature) {
  const Landmark* landmark = LandmarkSeenBy(keyframe, feature);
  if (landmark == nullptr) return;
  ClearObservation(keyframe, feature);
  if (landmark->observations.empty()) {
    RemoveLandmark(*landmark);
  } else if (landmark->reference == keyframe.id) {
    SetReference(Mutable(*landmark), landmark->observations.front().keyframe);
    journal_.Note(landmark->id, LandmarkChange::kState);
  }
}

void MapEditor::RemoveKeyframe(const Keyframe& keyframe) {
  const KeyframeId id = keyframe.id;
  const Keyframe* parent = keyframe.parent ? FindKeyframe(*keyframe.parent) : nullptr;
  DMSLAM_CHECK(parent != nullptr, "a map's first keyframe stays");
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) TakeFrom(keyframe, static_cast<uint16_t>(i));
  ReparentChildren(keyframe, parent->id);
  for (const KeyframeId other : keyframe.loop_edges) {
    if (Keyframe* end = Find(other)) {
      std::erase(end->loop_edges, id);
      journal_.Note(other, KeyframeChange::kState);
    }
  }
  Rigid3d T_kf_parent = keyframe.T_cam_world * parent->T_cam_world.Inverse();
  T_kf_parent.translation /= keyframe.scale;
  Bury({id, parent->id, keyframe.stamp_ns, T_kf_parent, parent->scale / keyframe.scale});
  journal_.NoteTombstone(id);
  EraseKeyframe(id);
  journal_.Forget(id);
}

void MapEditor::DropMap(MapId map_id) {
  const Forgotten gone = Forget(map_id);
  for (const LandmarkId id : gone.landmarks) journal_.Forget(id);
  for (const KeyframeId id : gone.keyframes) journal_.Forget(id);
  journal_.NoteDroppedMap(map_id);
}

MapDelta MapEditor::TakeDelta(MapEvent event, std::optional<KeyframeId> about, std::optional<MapId> map_id) {
  SetVersion(version() + 1);
  MapDelta delta;
  delta.event = event;
  delta.about = about;
  delta.map_id = map_id;
  delta.version = version();
  delta.progress = progress();
  if (const Keyframe* keyframe = about ? FindKeyframe(*about) : nullptr) delta.stamp_ns = keyframe->stamp_ns;
  journal_.Write(*this, &delta);
  journal_ = {};
  ForgetOldTombstones();
  TidyFeatures();
  return delta;
}

}  // namespace dmslam
