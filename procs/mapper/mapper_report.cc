#include "mapper/mapper_report.h"

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

MapperStatus StatusOf(const MapperCore& core) {
  MapperStatus status;
  const Map& map = core.map();
  const MapperCounters& counters = core.counters();
  status.version = static_cast<int64_t>(map.version());
  status.maps = static_cast<int32_t>(counters.maps_started - counters.maps_dropped);
  status.keyframes = static_cast<int32_t>(map.keyframes().size());
  status.landmarks = static_cast<int32_t>(map.num_landmarks());
  status.keyframes_inserted = static_cast<int64_t>(counters.keyframes_inserted);
  status.keyframes_culled = static_cast<int64_t>(counters.keyframes_culled);
  status.landmarks_created = counters.creation.created;
  status.landmarks_culled = static_cast<int64_t>(counters.landmarks_culled);
  status.landmarks_fused = static_cast<int64_t>(counters.fusions);
  status.observations_dropped = static_cast<int64_t>(counters.observations_dropped);
  status.refused_neighbourhood = counters.creation.refused_neighbourhood + counters.creation.refused_count;
  status.refused_motion = static_cast<int64_t>(counters.landmarks_moving_removed);
  status.refused_geometry = counters.creation.refused_parallax + counters.creation.refused_depth +
                            counters.creation.refused_reprojection + counters.creation.refused_scale;
  status.corrections_applied = static_cast<int64_t>(counters.corrections_applied);
  status.corrections_refused = static_cast<int64_t>(counters.corrections_refused);
  return status;
}

}  // namespace dmslam
