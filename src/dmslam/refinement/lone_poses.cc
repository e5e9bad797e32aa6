#include "dmslam/refinement/lone_poses.h"

#include <algorithm>
#include <map>

namespace dmslam {
namespace {

constexpr int64_t kVouchNs = 500'000'000;  // so near in time a tracked frame vouches
constexpr int64_t kGapNs = 500'000'000;    // poses farther apart do not bound where each other may be
constexpr int64_t kSpanNs = 500'000'000;   // so long a row of them vouches for itself

bool IsNear(int64_t stamp_ns, MapId map_id, std::span<const TrackedAt> tracked) {
  const auto begin = std::ranges::lower_bound(tracked, stamp_ns - kVouchNs, {}, &TrackedAt::stamp_ns);
  const auto end = std::ranges::upper_bound(tracked, stamp_ns + kVouchNs, {}, &TrackedAt::stamp_ns);
  return std::any_of(begin, end, [map_id](const TrackedAt& at) { return at.map_id == map_id; });
}

/// Whether the map had tracked frames either before or after, and not both. It may have had none: a camera
/// that others mapped for.
bool IsOutside(int64_t stamp_ns, MapId map_id, std::span<const TrackedAt> tracked) {
  const auto after = std::ranges::upper_bound(tracked, stamp_ns, {}, &TrackedAt::stamp_ns);
  const auto is_there = [map_id](const TrackedAt& at) { return at.map_id == map_id; };
  return std::any_of(tracked.begin(), after, is_there) != std::any_of(after, tracked.end(), is_there);
}

}  // namespace

std::vector<uint8_t> StandAlone(std::span<const FinalPose> poses, std::span<const TrackedAt> tracked) {
  std::map<MapId, std::vector<size_t>> rows;  // of each map, in order of time
  for (size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].pose.map_id) rows[*poses[i].pose.map_id].push_back(i);
  }
  std::vector<uint8_t> alone(poses.size(), 0);
  const auto stamp = [&](size_t i) { return poses[i].pose.stamp_ns; };
  for (auto& [map, row] : rows) {
    const MapId map_id = map;
    std::ranges::sort(row, {}, stamp);
    for (auto begin = row.begin(); begin != row.end();) {
      const auto end = std::adjacent_find(begin, row.end(),
                                          [&](size_t a, size_t b) { return stamp(b) - stamp(a) > kGapNs; });
      const auto behind = end == row.end() ? end : std::next(end);
      const bool is_long = stamp(*std::prev(behind)) - stamp(*begin) >= kSpanNs;
      const bool vouched =
          (is_long && !IsOutside(stamp(*begin), map_id, tracked)) ||
          std::any_of(begin, behind, [&](size_t i) { return IsNear(stamp(i), map_id, tracked); });
      if (!vouched) std::for_each(begin, behind, [&](size_t i) { alone[i] = 1; });
      begin = behind;
    }
  }
  return alone;
}

}  // namespace dmslam
