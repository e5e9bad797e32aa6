#include "frontend/other_models.h"

namespace dmslam {

void OtherModels::Hear(const CameraInfo& info, const Camera& ours) {
  if (info.camera.SeesAs(ours)) {
    cameras_.erase(info.camera_id);
  } else {
    cameras_.insert(info.camera_id);
  }
}

std::optional<CameraId> OtherModels::GivesWayTo(const Map& map, CameraId us) const {
  const auto is_mapped = [&](CameraId camera) { return map.NewestKeyframeOf(camera) != nullptr; };
  for (const CameraId other : cameras_) {
    const bool theirs = is_mapped(other), ours = is_mapped(us);
    if (theirs == ours ? other < us : theirs) return other;
  }
  return std::nullopt;
}

}  // namespace dmslam
