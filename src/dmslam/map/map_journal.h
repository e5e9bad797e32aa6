#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// What an editor has changed since its last delta: which things, not their values. Values are read when the
/// delta is written, so that a thing that changed often is written once.
class MapJournal {
 public:
  enum class KeyframeChange : uint8_t { kPose = 1, kState = 2, kFeatures = 4 };
  enum class LandmarkChange : uint8_t { kPosition = 1, kEvidence = 2, kState = 4 };

  void Note(KeyframeId id, KeyframeChange change) { keyframes_[id] |= static_cast<uint8_t>(change); }
  void Note(LandmarkId id, LandmarkChange change) { landmarks_[id] |= static_cast<uint8_t>(change); }
  void NoteObservation(KeyframeId keyframe, uint16_t feature) { observations_.emplace(keyframe, feature); }
  /// The landmark was moved with its reference. Where others of the same reference were moved otherwise since
  /// the last delta, its position is noted.
  void NoteMoveWithReference(const Landmark& landmark, const Sim3d& after_from_before);
  /// They are gone: nothing but a tombstone, where there is one, is to be said of them.
  void Forget(KeyframeId id);
  void Forget(LandmarkId id) { landmarks_.erase(id); }
  void NoteTombstone(KeyframeId id) { keyframe_tombstones_.push_back(id); }
  void NoteTombstone(LandmarkId id) { landmark_tombstones_.push_back(id); }
  void NoteDroppedMap(MapId map_id) { dropped_maps_.push_back(map_id); }

  /// Writes what has changed, as the values of now, into an empty delta.
  void Write(const Map& map, MapDelta* delta) const;

 private:
  std::map<KeyframeId, uint8_t> keyframes_;
  std::map<KeyframeId, Sim3d> reference_moves_;
  std::unordered_map<LandmarkId, uint8_t> landmarks_;
  std::set<std::pair<KeyframeId, uint16_t>> observations_;
  std::vector<KeyframeId> keyframe_tombstones_;
  std::vector<LandmarkId> landmark_tombstones_;
  std::vector<MapId> dropped_maps_;
};

}  // namespace dmslam
