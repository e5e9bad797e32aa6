#include "dmslam/loops/loop_detector.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "dmslam/loops/same_time.h"

namespace dmslam {
namespace {

constexpr size_t kMostAtThatTime = 2, kMostAlike = 3;  // places of other maps that are tried

bool Overlap(const std::set<KeyframeId>& a, const std::set<KeyframeId>& b) {
  return std::any_of(a.begin(), a.end(), [&](KeyframeId id) { return b.contains(id); });
}

/// Of other maps of its camera than that of `keyframe`: those within `seconds` of it, nearest in time first.
std::vector<const Keyframe*> OfOtherMapsAtThatTime(const Map& map, const Keyframe& keyframe, double seconds) {
  const auto since = [&](const Keyframe* other) { return std::abs(other->stamp_ns - keyframe.stamp_ns); };
  std::vector<const Keyframe*> found;
  for (const auto& [id, other] : map.keyframes()) {
    if (other.map_id != keyframe.map_id && AreAtSameTime(other, keyframe, seconds)) found.push_back(&other);
  }
  std::ranges::stable_sort(found, {}, since);
  return found;
}

std::set<KeyframeId> ConnectedWith(const Keyframe& keyframe, int min_shared) {
  std::set<KeyframeId> connected{keyframe.id};
  if (keyframe.parent) connected.insert(*keyframe.parent);
  for (const auto& [other, shared] : keyframe.covisible) {
    if (shared >= min_shared) connected.insert(other);
  }
  return connected;
}

}  // namespace

std::vector<PlaceCandidate> LoopDetector::Candidates(const Map& map, const MapPlaces& places,
                                                     const Keyframe& keyframe) const {
  const BowVector* words = places.Words(keyframe.id);
  if (words == nullptr) return {};
  const std::set<KeyframeId> connected = ConnectedWith(keyframe, options_.min_covisibility);
  // A place must look at least as much alike as the neighbour that looks least alike.
  double min_score = 1.0;
  for (const KeyframeId id : connected) {
    const BowVector* other = id == keyframe.id ? nullptr : places.Words(id);
    if (other != nullptr) min_score = std::min(min_score, L1Score(*words, *other));
  }
  return places.Query(map, *words, min_score, options_.min_covisibility,
                      [&](const Keyframe& other) { return connected.contains(other.id); });
}

LoopDetector::Found LoopDetector::Detect(const Map& map, const MapPlaces& places, const Keyframe& keyframe) {
  Found found;
  std::vector<Group> groups;
  for (const PlaceCandidate& candidate : Candidates(map, places, keyframe)) {
    ++found.named;
    const Keyframe& place = map.At(candidate.keyframe);
    Group group{ConnectedWith(place, options_.min_covisibility), 1};
    for (const Group& before : groups_[keyframe.camera_id]) {
      if (Overlap(group.members, before.members)) group.seen = std::max(group.seen, before.seen + 1);
    }
    if (group.seen >= options_.consistency) found.candidates.push_back(&place);
    groups.push_back(std::move(group));
  }
  groups_[keyframe.camera_id] = std::move(groups);
  return found;
}

std::vector<const Keyframe*> LoopDetector::DetectInOtherMaps(const Map& map, const MapPlaces& places,
                                                             const Keyframe& keyframe) const {
  const BowVector* words = places.Words(keyframe.id);
  if (words == nullptr || !map.HasAnotherMap(keyframe.map_id)) return {};
  std::vector<const Keyframe*> found;
  const auto add = [&](const Keyframe* other, size_t most) {
    if (found.size() < most && std::ranges::find(found, other) == found.end()) found.push_back(other);
  };
  for (const Keyframe* other : OfOtherMapsAtThatTime(map, keyframe, options_.same_time_s))
    add(other, kMostAtThatTime);
  const size_t most = found.size() + kMostAlike;
  for (const PlaceCandidate& candidate :
       places.Query(map, *words, 0.0, options_.min_covisibility,
                    [&](const Keyframe& other) { return other.map_id == keyframe.map_id; }))
    add(&map.At(candidate.keyframe), most);
  return found;
}

}  // namespace dmslam
