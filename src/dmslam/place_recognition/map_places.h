#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "dmslam/map/replica.h"
#include "dmslam/place_recognition/keyframe_database.h"
#include "dmslam/place_recognition/vocabulary.h"

namespace dmslam {

/// The words of a map's keyframes, kept in step with a replica. Features on landmarks that are believed to
/// move do not enter the words.
class MapPlaces {
 public:
  explicit MapPlaces(std::shared_ptr<const Vocabulary> vocabulary, KeyframeDatabaseOptions options = {});

  /// Call after each delta that was applied to `map`.
  void Update(const Replica& map);
  /// Words of a keyframe anew, with what is known of it by now.
  void Refresh(const Map& map, KeyframeId id);
  void Clear();

  /// False without a vocabulary: then there are no places.
  bool usable() const { return vocabulary_ != nullptr; }
  size_t size() const { return nodes_.size(); }
  const BowVector* Words(KeyframeId id) const { return database_.Find(id); }
  /// Direct index of a keyframe; null when it is not there.
  const FeatureVector* Nodes(KeyframeId id) const;
  /// An image in the same words; `counted` as in Vocabulary::Transform.
  BowImage Transform(const FeatureSet& features, std::span<const uint8_t> counted = {}) const;

  /// Keyframes of `map` that look like `words`, best first. `excluded`: may not be found. Groups are made of
  /// covisible keyframes that share at least `min_shared` landmarks.
  std::vector<PlaceCandidate> Query(const Map& map, const BowVector& words, double min_score, int min_shared,
                                    const std::function<bool(const Keyframe&)>& excluded) const;

 private:
  std::shared_ptr<const Vocabulary> vocabulary_;
  KeyframeDatabase database_;
  std::map<KeyframeId, FeatureVector> nodes_;
};

}  // namespace dmslam
