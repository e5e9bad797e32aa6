#include "dmslam/loops/loop_detector.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace dmslam {
namespace {

bool Overlap(const std::set<KeyframeId>& a, const std::set<KeyframeId>& b) {
  return std::any_of(a.begin(), a.end(), [&](KeyframeId id) { return b.contains(id); });
}

std::set<KeyframeId> ConnectedWith(const Keyframe& keyframe, int min_shared) {
  std::set<KeyframeId> connected{keyframe.id, keyframe.parent};
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

LoopDetector::Group LoopDetector::GroupOf(const Map& map, KeyframeId id) const {
  return {ConnectedWith(*map.FindKeyframe(id), options_.min_covisibility), 1};
}

LoopDetector::Found LoopDetector::Detect(const Map& map, const MapPlaces& places, const Keyframe& keyframe) {
  Found found;
  std::vector<Group> groups;
  for (const PlaceCandidate& candidate : Candidates(map, places, keyframe)) {
    ++found.named;
    Group group = GroupOf(map, candidate.keyframe);
    for (const Group& before : groups_) {
      if (Overlap(group.members, before.members)) group.seen = std::max(group.seen, before.seen + 1);
    }
    if (group.seen >= options_.consistency) found.candidates.push_back(candidate.keyframe);
    groups.push_back(std::move(group));
  }
  groups_ = std::move(groups);
  return found;
}

}  // namespace dmslam
