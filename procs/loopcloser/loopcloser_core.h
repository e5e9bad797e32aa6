#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "dmslam/place_recognition/vocabulary.h"

namespace dmslam {

/// Loop closing (ORB-SLAM2's constants; the paper keeps it unchanged).
struct LoopcloserOptions {
  bool enabled = true;
};

struct LoopcloserCounters {
  uint64_t checked = 0;
  uint64_t candidates = 0;
  uint64_t refused_consistency = 0;
  uint64_t refused_geometry = 0;
  uint64_t loops = 0;
  uint64_t global_adjustments = 0;
  KeyframeId last_keyframe;
  KeyframeId last_loop_keyframe;
};

/// Finds loops in a replica of the map and works out corrections. Knows no bus, no clock and no thread.
class LoopcloserCore {
 public:
  LoopcloserCore(const LoopcloserOptions& options, const Camera& camera, const Pyramid& pyramid, uint64_t seed,
                 std::shared_ptr<const Vocabulary> vocabulary);

  /// Called now and then during long work. May be empty.
  void SetPump(std::function<void()> pump) { pump_ = std::move(pump); }
  void ApplyMapDelta(const MapDelta& delta);
  /// The replica is void: a fresh map stream, or a snapshot, begins.
  void ForgetMap();
  /// The answer to a keyframe whose local mapping is done: a correction, or none.
  LoopAnswer Check(KeyframeId keyframe);

  const Map& map() const { return map_; }
  const LoopcloserCounters& counters() const { return counters_; }

 private:
  LoopcloserOptions options_;
  Camera camera_;
  Pyramid pyramid_;
  uint64_t seed_;
  std::shared_ptr<const Vocabulary> vocabulary_;
  std::function<void()> pump_;
  Map map_;
  LoopcloserCounters counters_;
};

}  // namespace dmslam
