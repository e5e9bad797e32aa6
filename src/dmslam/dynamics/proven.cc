#include "dmslam/dynamics/proven.h"

#include <algorithm>

#include "dmslam/dynamics/motion_belief.h"

namespace dmslam {

bool OutlastsStanding(const std::vector<int64_t>& stamps_ns, const ProvenOptions& options) {
  const auto seconds = [](int64_t ns) { return static_cast<double>(ns) * 1e-9; };
  size_t most = 0;
  for (size_t begin = 0, end = 0; end < stamps_ns.size(); ++end) {
    while (seconds(stamps_ns[end] - stamps_ns[begin]) > options.standing_s) ++begin;
    most = std::max(most, end - begin + 1);
  }
  return stamps_ns.size() - most >= static_cast<size_t>(options.outer_observations);
}

std::vector<int64_t> ObservationStamps(const Map& map, const Landmark& landmark) {
  std::vector<int64_t> stamps_ns;
  stamps_ns.reserve(landmark.observations.size());
  for (const Observation& o : landmark.observations) stamps_ns.push_back(map.At(o.keyframe).stamp_ns);
  std::sort(stamps_ns.begin(), stamps_ns.end());
  return stamps_ns;
}

bool IsProven(const Map& map, const Landmark& landmark, const ProvenOptions& options) {
  return IsStatic(&landmark) && OutlastsStanding(ObservationStamps(map, landmark), options);
}

int CountProven(const Map& map, const std::vector<LandmarkId>& landmarks, const ProvenOptions& options) {
  return static_cast<int>(std::count_if(landmarks.begin(), landmarks.end(), [&](LandmarkId id) {
    const Landmark* landmark = id.valid() ? map.FindLandmark(id) : nullptr;
    return landmark != nullptr && IsProven(map, *landmark, options);
  }));
}

bool CanBeProven(const Map& map, MapId map_id, const ProvenOptions& options) {
  int64_t first_ns = INT64_MAX, last_ns = INT64_MIN;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id != map_id) continue;
    first_ns = std::min(first_ns, keyframe.stamp_ns);
    last_ns = std::max(last_ns, keyframe.stamp_ns);
  }
  return first_ns<last_ns&& static_cast<double>(last_ns - first_ns) * 1e-9> 2 * options.standing_s;
}

}  // namespace dmslam
