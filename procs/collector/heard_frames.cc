#include "collector/heard_frames.h"

#include <algorithm>

namespace dmslam {

/// Those that were placed later have been heard before.
void HeardFrames::Hear(const FramePose& pose) {
  std::optional<uint32_t>& newest = newest_[pose.camera_id];
  if (pose.state == TrackingState::kLocalizedLater || (newest && pose.frame_index <= *newest)) return;
  newest = pose.frame_index;
  newest_stamp_ns_ = pose.stamp_ns;
  ++count_;
}

bool HeardFrames::ReachAsFarAs(const Map& map, uint32_t session) const {
  return std::ranges::all_of(newest_, [&](const auto& item) {
    const Keyframe* newest = map.NewestKeyframeOf(item.first);
    return newest == nullptr || newest->id.session() != session ||
           (item.second && newest->id.frame_index() <= *item.second);
  });
}

}  // namespace dmslam
