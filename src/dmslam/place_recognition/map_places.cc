#include "dmslam/place_recognition/map_places.h"

#include <utility>

#include "dmslam/dynamics/motion_belief.h"

namespace dmslam {
namespace {

constexpr int kGroupSize = 10;

/// All features but those on landmarks that are believed to move.
std::vector<uint8_t> CountedFeatures(const Map& map, const Keyframe& keyframe) {
  std::vector<uint8_t> counted(keyframe.landmarks.size(), 1);
  for (size_t i = 0; i < counted.size(); ++i) {
    const Landmark* landmark =
        keyframe.landmarks[i].valid() ? map.FindLandmark(keyframe.landmarks[i]) : nullptr;
    if (landmark != nullptr && !IsStatic(landmark)) counted[i] = 0;
  }
  return counted;
}

}  // namespace

MapPlaces::MapPlaces(std::shared_ptr<const Vocabulary> vocabulary, KeyframeDatabaseOptions options)
    : vocabulary_(std::move(vocabulary)),
      database_(options, vocabulary_ == nullptr ? 0 : vocabulary_->num_words()) {}

void MapPlaces::Update(const Replica& map) {
  if (!usable()) return;
  for (const KeyframeId id : map.applied_removed_keyframes()) {
    database_.Remove(id);
    nodes_.erase(id);
  }
  for (const KeyframeId id : map.applied_new_keyframes()) Refresh(map, id);
}

void MapPlaces::Refresh(const Map& map, KeyframeId id) {
  const Keyframe* keyframe = map.FindKeyframe(id);
  if (!usable() || keyframe == nullptr) return;
  BowImage image = Transform(keyframe->features->set, CountedFeatures(map, *keyframe));
  database_.Add(id, std::move(image.words));
  nodes_[id] = std::move(image.nodes);
}

void MapPlaces::Clear() {
  database_.Clear();
  nodes_.clear();
}

const FeatureVector* MapPlaces::Nodes(KeyframeId id) const {
  const auto found = nodes_.find(id);
  return found == nodes_.end() ? nullptr : &found->second;
}

BowImage MapPlaces::Transform(const FeatureSet& features, std::span<const uint8_t> counted) const {
  return vocabulary_->Transform(features.descriptors, Vocabulary::kDirectIndexLevel, counted);
}

std::vector<PlaceCandidate> MapPlaces::Query(const Map& map, const BowVector& words, double min_score,
                                             int min_shared,
                                             const std::function<bool(const Keyframe&)>& excluded) const {
  PlaceQuery query;
  query.min_score = min_score;
  query.excluded = [&](KeyframeId id) {
    const Keyframe* keyframe = map.FindKeyframe(id);
    return keyframe == nullptr || excluded(*keyframe);
  };
  query.neighbours = [&](KeyframeId id) { return map.BestCovisible(id, kGroupSize, min_shared); };
  return database_.Query(words, query);
}

}  // namespace dmslam
