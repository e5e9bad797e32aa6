#include "dmslam/refinement/lone_poses.h"

#include <algorithm>
#include <map>

namespace dmslam {
namespace {

constexpr int64_t kGapNs = 500'000'000;   // poses that are farther apart do not vouch for each other
constexpr int64_t kSpanNs = 500'000'000;  // so long a row of them vouches for itself

bool IsNear(int64_t stamp_ns, std::span<const int64_t> tracked_ns) {
  const auto after = std::ranges::lower_bound(tracked_ns, stamp_ns);
  const bool near_after = after != tracked_ns.end() && *after - stamp_ns <= kGapNs;
  return near_after || (after != tracked_ns.begin() && stamp_ns - *std::prev(after) <= kGapNs);
}

}  // namespace

std::vector<uint8_t> StandAlone(std::span<const FinalPose> poses, std::span<const int64_t> tracked_ns) {
  std::map<MapId, std::vector<size_t>> rows;  // of each map, in order of time
  for (size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].pose.map_id) rows[*poses[i].pose.map_id].push_back(i);
  }
  std::vector<uint8_t> alone(poses.size(), 0);
  const auto stamp = [&](size_t i) { return poses[i].pose.stamp_ns; };
  for (auto& [map_id, row] : rows) {
    std::ranges::sort(row, {}, stamp);
    for (auto begin = row.begin(); begin != row.end();) {
      const auto end = std::adjacent_find(begin, row.end(),
                                          [&](size_t a, size_t b) { return stamp(b) - stamp(a) > kGapNs; });
      const auto behind = end == row.end() ? end : std::next(end);
      const bool vouched = stamp(*std::prev(behind)) - stamp(*begin) >= kSpanNs ||
                           std::any_of(begin, behind, [&](size_t i) { return IsNear(stamp(i), tracked_ns); });
      if (!vouched) std::for_each(begin, behind, [&](size_t i) { alone[i] = 1; });
      begin = behind;
    }
  }
  return alone;
}

}  // namespace dmslam
