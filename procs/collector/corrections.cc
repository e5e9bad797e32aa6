#include "collector/corrections.h"

#include <algorithm>

namespace dmslam {

std::vector<KeyframeId> LoopsOf(const Map& map, std::optional<KeyframeId> id) {
  const Keyframe* keyframe = id ? map.FindKeyframe(*id) : nullptr;
  return keyframe == nullptr ? std::vector<KeyframeId>() : keyframe->loop_edges;
}

CorrectionRecord RecordOf(const MapDelta& delta, const std::vector<KeyframeId>& loops_before,
                          const Map& map) {
  CorrectionRecord correction{delta.event, delta.about.value_or(KeyframeId()), delta.note, {}, {}};
  const std::vector<KeyframeId> loops = LoopsOf(map, delta.about);
  const auto added = std::ranges::find_if(
      loops, [&](KeyframeId id) { return !std::ranges::binary_search(loops_before, id); });
  if (delta.event == MapEvent::kCorrected && added != loops.end()) {
    correction.matched = *added;
    correction.T_matched_keyframe =
        map.FindKeyframe(*added)->T_cam_world * map.FindKeyframe(*delta.about)->T_cam_world.Inverse();
  }
  return correction;
}

}  // namespace dmslam
