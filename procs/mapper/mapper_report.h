#pragma once

#include <cstdint>

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

/// What the core has to say of itself: sizes of the map, and what it did so far.
MapperStatus StatusOf(const MapperCore& core);

}  // namespace dmslam
