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

void MapEditor::SetObservation(KeyframeId keyframe_id, uint16_t feature, LandmarkId landmark_id) {
  Keyframe& keyframe = Mutable(keyframe_id);
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  if (keyframe.landmarks[feature] == landmark_id) return;
  const std::optional<uint16_t> released = Observe(keyframe, feature, Mutable(landmark_id));
  if (released) journal_.NoteObservation(keyframe_id, *released);
  journal_.NoteObservation(keyframe_id, feature);
}

void MapEditor::ClearObservation(KeyframeId keyframe_id, uint16_t feature) {
  Keyframe& keyframe = Mutable(keyframe_id);
  DMSLAM_CHECK(feature < keyframe.landmarks.size(), "observation by an unknown feature");
  if (!keyframe.landmarks[feature].valid()) return;
  Release(keyframe, feature);
  journal_.NoteObservation(keyframe_id, feature);
}

void MapEditor::SetPose(KeyframeId id, const Rigid3d& T_cam_world) { SetPoseAndScale(id, T_cam_world, 1.0); }

void MapEditor::SetPoseAndScale(KeyframeId id, const Rigid3d& T_cam_world, double factor) {
  Keyframe& keyframe = Mutable(id);
  Place(keyframe, T_cam_world, keyframe.scale * factor, keyframe.map_id);
  journal_.Note(id, KeyframeChange::kPose);
}

void MapEditor::SetPosition(LandmarkId id, const Eigen::Vector3d& p_world) {
  Place(Mutable(id), p_world);
  journal_.Note(id, LandmarkChange::kPosition);
}

void MapEditor::SetEvidence(LandmarkId id, const LandmarkEvidence& evidence) {
  Mutable(id).evidence = evidence;
  journal_.Note(id, LandmarkChange::kEvidence);
}

void MapEditor::SetParent(KeyframeId id, KeyframeId parent) {
  Hang(Mutable(id), parent);
  journal_.Note(id, KeyframeChange::kState);
}

void MapEditor::AddLoopEdge(KeyframeId a, KeyframeId b) {
  InsertSorted(Mutable(a).loop_edges, b);
  InsertSorted(Mutable(b).loop_edges, a);
  journal_.Note(a, KeyframeChange::kState);
  journal_.Note(b, KeyframeChange::kState);
}

void MapEditor::SetMapId(KeyframeId id, MapId map_id) {
  Keyframe& keyframe = Mutable(id);
  Place(keyframe, keyframe.T_cam_world, keyframe.scale, map_id);
  journal_.Note(id, KeyframeChange::kState);
}

void MapEditor::SetMapId(LandmarkId id, MapId map_id) {
  Mutable(id).map_id = map_id;
  journal_.Note(id, LandmarkChange::kState);
}

void MapEditor::UpdateDescriptor(LandmarkId id) {
  Landmark& landmark = Mutable(id);
  std::vector<Descriptor> seen;
  for (const Observation& o : landmark.observations) {
    const Keyframe* keyframe = FindKeyframe(o.keyframe);
    if (keyframe != nullptr) seen.push_back(keyframe->features->set.descriptors[o.feature]);
  }
  const Descriptor* middle = MiddleOf(seen);
  if (middle == nullptr || *middle == landmark.descriptor) return;
  landmark.descriptor = *middle;
  journal_.Note(id, LandmarkChange::kState);
}

void MapEditor::Fuse(LandmarkId from, LandmarkId into) {
  if (from == into) return;
  const Landmark& gone = Mutable(from);
  Landmark& target = Mutable(into);
  const std::vector<Observation> observations = gone.observations;
  for (const Observation& o : observations) {
    ClearObservation(o.keyframe, o.feature);
    if (target.SeenBy(o.keyframe) == nullptr) SetObservation(o.keyframe, o.feature, into);
  }
  target.evidence.visible += gone.evidence.visible;
  target.evidence.found += gone.evidence.found;
  target.evidence.moved += gone.evidence.moved;
  target.first_ns = std::min(target.first_ns, gone.first_ns);
  target.first_keyframe = std::min(target.first_keyframe, gone.first_keyframe);
  journal_.Note(into, LandmarkChange::kState);
  EraseAndForget(from);
  Bury(from, into);
  journal_.NoteTombstone(from);
  UpdateDescriptor(into);
}

void MapEditor::RemoveLandmark(LandmarkId id) {
  const std::vector<Observation> observations = Mutable(id).observations;
  for (const Observation& o : observations) ClearObservation(o.keyframe, o.feature);
  EraseAndForget(id);
  Bury(id, LandmarkId{});
  journal_.NoteTombstone(id);
}

/// Children hang on whom they share most with: the removed keyframe's parent, or one of them that hangs
/// already.
void MapEditor::ReparentChildren(const Keyframe& removed) {
  std::vector<KeyframeId> orphans = Children(removed.id);
  std::vector<KeyframeId> candidates = {removed.parent};
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
    SetParent(best_child, best_parent);
    candidates.push_back(best_child);
    std::erase(orphans, best_child);
  }
  for (const KeyframeId child : orphans) SetParent(child, removed.parent);
}

void MapEditor::RemoveKeyframe(KeyframeId id) {
  const Keyframe& keyframe = Mutable(id);
  DMSLAM_CHECK(FindKeyframe(keyframe.parent) != nullptr, "a map's first keyframe stays");
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const LandmarkId landmark_id = keyframe.landmarks[i];
    if (!landmark_id.valid()) continue;
    ClearObservation(id, static_cast<uint16_t>(i));
    Landmark& landmark = Mutable(landmark_id);
    if (landmark.observations.empty()) {
      RemoveLandmark(landmark_id);
    } else if (landmark.reference == id) {
      SetReference(landmark, landmark.observations.front().keyframe);
      journal_.Note(landmark_id, LandmarkChange::kState);
    }
  }
  ReparentChildren(keyframe);
  for (const KeyframeId other : keyframe.loop_edges) {
    if (Keyframe* end = Find(other)) {
      std::erase(end->loop_edges, id);
      journal_.Note(other, KeyframeChange::kState);
    }
  }
  const Keyframe& parent = At(keyframe.parent);
  Bury({id, parent.id, keyframe.stamp_ns, keyframe.T_cam_world * parent.T_cam_world.Inverse(), parent.scale});
  journal_.NoteTombstone(id);
  EraseAndForget(id);
}

void MapEditor::EraseAndForget(KeyframeId id) {
  EraseKeyframe(id);
  journal_.Forget(id);
}

void MapEditor::EraseAndForget(LandmarkId id) {
  EraseLandmark(id);
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
  return delta;
}

}  // namespace dmslam
