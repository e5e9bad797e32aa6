#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "dmslam/map/map_delta.h"
#include "dmslam/mapping/mapper_core.h"
#include "dmslam/runtime/latency_window.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// How long keyframes take, from when their record came.
class KeyframeTiming {
 public:
  /// The record that is handled from now on came at that time.
  void OnRecord(int64_t arrived_ns) { arrived_ns_ = arrived_ns; }
  void OnPublished(MapEvent event, int64_t now_ns);
  void Fill(MapperStatus* status) const;

 private:
  int64_t arrived_ns_ = 0;
  int64_t fused_ns_ = 0;  ///< since then it adjusts
  LatencyWindow to_landmarks_, to_adjusted_, adjustment_;
};

/// What takes a walk over the whole map to count: it is counted once, and then kept up with the map's deltas.
class MapTally {
 public:
  /// The map is there, and no delta has told how it came to be.
  void Count(const Map& map);
  /// `map`: as it is after the delta, its mapper's own.
  void OnDelta(const MapDelta& delta, const Map& map);

  /// That have a keyframe.
  size_t maps() const { return keyframes_of_.size(); }
  /// Landmarks that are believed to move.
  size_t moving() const { return moving_.size(); }

 private:
  void Note(KeyframeId id, std::optional<MapId> map_id);
  void Note(LandmarkId id, const LandmarkEvidence& evidence);

  std::unordered_map<KeyframeId, MapId> map_of_;
  std::map<MapId, size_t> keyframes_of_;
  std::unordered_set<LandmarkId> moving_;
};

/// What the core has to say of itself: sizes of the map, and what it did so far. `tally`: of its map.
MapperStatus StatusOf(const MapperCore& core, const MapTally& tally);

/// What the core did not do as it was asked to, in a sentence for the log; empty: nothing.
std::string NotDoneText(const MapperCounters& counters);

}  // namespace dmslam
