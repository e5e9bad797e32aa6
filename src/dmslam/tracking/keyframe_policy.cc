#include "dmslam/tracking/keyframe_policy.h"

#include <ranges>

#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr double kWeakShare = 0.5;  // of the expected landmarks
constexpr int kWeak = 60;           // landmarks
constexpr double kSooner = 0.6;     // of the time between two frames: of two as near, the first

/// Young maps have the newest keyframes.
bool IsOfTwoKeyframes(const Map& map, MapId map_id) {
  int found = 0;
  for (const auto& [id, keyframe] : map.keyframes() | std::views::reverse) {
    if (keyframe.map_id == map_id && ++found > 2) return false;
  }
  return true;
}

}  // namespace

bool WantsKeyframe(const KeyframeOptions& options, const KeyframeInputs& inputs) {
  if (inputs.num_static <= options.min_inliers) return false;
  const bool weak = inputs.num_static < kWeakShare * inputs.expected || inputs.num_static < kWeak;
  const double sooner_ns = kSooner * static_cast<double>(inputs.step_ns.value_or(0));
  const auto soonest_ns = static_cast<int64_t>(static_cast<double>(ToNs(options.min_interval_s)) - sooner_ns);
  const bool due = !inputs.since_ns || *inputs.since_ns >= soonest_ns || weak;
  return due && inputs.num_static < options.tracked_ratio * inputs.expected;
}

/// A map of two keyframes has no landmark that three see.
int ExpectedOf(const Map& map, const Keyframe& reference) {
  return map.CountTracked(reference, IsOfTwoKeyframes(map, reference.map_id) ? 2 : 3);
}

}  // namespace dmslam
