#include "mapper/mapper_report.h"

#include <utility>

#include "dmslam/dynamics/motion_belief.h"

namespace dmslam {

void KeyframeTiming::OnPublished(MapEvent event, int64_t now_ns) {
  const double elapsed_ms = static_cast<double>(now_ns - arrived_ns_) * 1e-6;
  if (event == MapEvent::kFused) fused_ns_ = now_ns;
  if (event == MapEvent::kAdjusted) adjustment_.Add(static_cast<double>(now_ns - fused_ns_) * 1e-6);
  if (event == MapEvent::kLandmarksCreated) to_landmarks_.Add(elapsed_ms);
  if (event == MapEvent::kAdjusted) to_adjusted_.Add(elapsed_ms);
}

void KeyframeTiming::Fill(MapperStatus* status) const {
  status->landmarks_p50_ms = to_landmarks_.Quantile(0.5);
  status->landmarks_p95_ms = to_landmarks_.Quantile(0.95);
  status->landmarks_p99_ms = to_landmarks_.Quantile(0.99);
  status->adjusted_p50_ms = to_adjusted_.Quantile(0.5);
  status->adjusted_p95_ms = to_adjusted_.Quantile(0.95);
  status->adjusted_p99_ms = to_adjusted_.Quantile(0.99);
  status->adjustment_ms = adjustment_.Quantile(0.5);
}

void MapTally::Count(const Map& map) {
  map_of_.clear();
  keyframes_of_.clear();
  for (const auto& [id, keyframe] : map.keyframes()) Note(id, keyframe.map_id);
  moving_.clear();
  for (const LandmarkId id : map.LandmarkIdsSorted()) Note(id, map.At(id).evidence);
}

void MapTally::OnDelta(const MapDelta& delta, const Map& map) {
  for (const KeyframeState& state : delta.keyframes) Note(state.id, state.map_id);
  for (const KeyframeTombstone& tombstone : delta.keyframe_tombstones) Note(tombstone.id, std::nullopt);
  for (const LandmarkState& state : delta.landmarks) Note(state.id, state.evidence);
  for (const LandmarkEvidenceState& state : delta.landmark_evidence) Note(state.id, state.evidence);
  for (const LandmarkTombstone& tombstone : delta.landmark_tombstones) moving_.erase(tombstone.id);
  if (delta.dropped_maps.empty()) return;
  Count(map);
}

/// No `map_id`: it is gone.
void MapTally::Note(KeyframeId id, std::optional<MapId> map_id) {
  if (const auto known = map_of_.find(id); known != map_of_.end()) {
    if (--keyframes_of_[known->second] == 0) keyframes_of_.erase(known->second);
    map_of_.erase(known);
  }
  if (!map_id) return;
  map_of_[id] = *map_id;
  ++keyframes_of_[*map_id];
}

void MapTally::Note(LandmarkId id, const LandmarkEvidence& evidence) {
  if (IsBelievedToMove(evidence)) {
    moving_.insert(id);
  } else {
    moving_.erase(id);
  }
}

MapperStatus StatusOf(const MapperCore& core, const MapTally& tally) {
  MapperStatus status;
  const Map& map = core.map();
  const MapperCounters& counters = core.counters();
  status.version = static_cast<int64_t>(map.version());
  status.maps = static_cast<int32_t>(tally.maps());
  status.keyframes = static_cast<int32_t>(map.keyframes().size());
  status.landmarks = static_cast<int32_t>(map.num_landmarks());
  status.moving_landmarks = static_cast<int32_t>(tally.moving());
  status.keyframes_inserted = static_cast<int64_t>(counters.keyframes_inserted);
  status.keyframes_culled = static_cast<int64_t>(counters.keyframes_culled);
  status.landmarks_created = counters.creation.created;
  status.landmarks_culled = static_cast<int64_t>(
      counters.landmarks_culled + counters.landmarks_moving_removed + counters.landmarks_seen_through);
  status.landmarks_fused = counters.fused.landmarks;
  status.observations_dropped = static_cast<int64_t>(counters.observations_dropped);
  status.refused_neighbourhood = counters.creation.refused_neighbourhood + counters.creation.refused_count;
  status.refused_motion = counters.creation.refused_motion;
  status.refused_geometry = counters.creation.refused_parallax + counters.creation.refused_depth +
                            counters.creation.refused_reprojection + counters.creation.refused_scale;
  status.corrections_applied = static_cast<int64_t>(counters.corrections_applied);
  status.corrections_refused = static_cast<int64_t>(counters.corrections_refused);
  return status;
}

std::string NotDoneText(const MapperCounters& counters) {
  const std::pair<uint64_t, const char*> items[] = {
      {counters.keyframes_refused, "keyframes refused, whose reference is unknown or of another map"},
      {counters.maps_refused, "first maps refused"},
      {counters.maps_dropped, "maps dropped, which their camera had given up"},
      {counters.evidence_dropped, "pieces of evidence of landmarks that were gone"},
      {counters.adjustments_interrupted, "adjustments cut short, since a keyframe waited"}};
  std::string text;
  for (const auto& [count, what] : items) {
    if (count > 0) text += (text.empty() ? "" : "; ") + std::to_string(count) + ' ' + what;
  }
  return text;
}

}  // namespace dmslam
