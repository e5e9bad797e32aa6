#include "dmslam/dynamics/motion_belief.h"

#include <algorithm>

namespace dmslam {

LandmarkEvidence Updated(LandmarkEvidence state, const FrameEvidence::Item& item, int64_t stamp_ns,
                         const MotionBeliefOptions& options) {
  state.visible += item.visible;
  state.found += item.found;
  state.moved += item.moved;
  if (item.moved > 0) state.last_moved_ns = std::max(state.last_moved_ns.value_or(stamp_ns), stamp_ns);
  if (options.enabled) {
    const float change = options.moved_step * static_cast<float>(item.moved) -
                         options.found_step * static_cast<float>(item.found);
    state.motion_belief = std::clamp(state.motion_belief + change, kLowestBelief, kHighestBelief);
  }
  return state;
}

bool IsToBeRemoved(const LandmarkEvidence& evidence, const MotionBeliefOptions& options) {
  return options.enabled && evidence.motion_belief > options.remove_above;
}

void KeepStatic(std::vector<const Landmark*>* landmarks) {
  std::erase_if(*landmarks, [](const Landmark* landmark) { return !IsStatic(landmark); });
}

std::vector<uint8_t> StaticFeatures(const Map& map, const Keyframe& keyframe) {
  std::vector<uint8_t> usable(keyframe.landmarks.size(), 0);
  for (size_t i = 0; i < usable.size(); ++i) {
    if (keyframe.landmarks[i].valid()) usable[i] = IsStatic(map.FindLandmark(keyframe.landmarks[i])) ? 1 : 0;
  }
  return usable;
}

LandmarkEvidence Merged(const LandmarkEvidence& stays, const LandmarkEvidence& goes) {
  LandmarkEvidence merged = stays;
  merged.visible += goes.visible;
  merged.found += goes.found;
  merged.moved += goes.moved;
  return merged;
}

EvidenceReport ApplyEvidence(MapEditor& map, const FrameEvidence& evidence,
                             const MotionBeliefOptions& options) {
  EvidenceReport report;
  for (const FrameEvidence::Item& item : evidence.items) {
    const Landmark* landmark = map.Resolve(item.landmark);
    if (landmark == nullptr) {
      ++report.unknown;
      continue;
    }
    const LandmarkEvidence updated = Updated(landmark->evidence, item, evidence.stamp_ns, options);
    ++report.applied;
    if (IsToBeRemoved(updated, options)) {
      map.RemoveLandmark(*landmark);
      ++report.removed;
    } else {
      map.SetEvidence(*landmark, updated);
    }
  }
  return report;
}

}  // namespace dmslam
