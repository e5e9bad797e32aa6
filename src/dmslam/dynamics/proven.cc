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
  for (const Observation& o : landmark.observations)
    stamps_ns.push_back(map.FindKeyframe(o.keyframe)->stamp_ns);
  std::sort(stamps_ns.begin(), stamps_ns.end());
  return stamps_ns;
}

bool IsProven(const Map& map, const Landmark& landmark, const ProvenOptions& options) {
  return IsStatic(&landmark) && OutlastsStanding(ObservationStamps(map, landmark), options);
}

}  // namespace dmslam
