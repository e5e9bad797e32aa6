#include "mapper/map_parts.h"

#include <iterator>
#include <utility>
#include <vector>

namespace dmslam {

void MapParts::Cut(const Map& map, size_t bytes_of_a_part) {
  const KeyframeId newest = map.keyframes().rbegin()->first;
  std::vector<MapDelta> parts = CutSnapshot(map, newest, bytes_of_a_part);
  parts_.assign(std::make_move_iterator(parts.begin()), std::make_move_iterator(parts.end()));
}

std::optional<MapDelta> MapParts::TakeNext(int64_t now_ns, bool has_room) {
  if (empty() || now_ns < next_ns_) return std::nullopt;
  next_ns_ = now_ns + kEveryNs;
  if (!has_room) return std::nullopt;
  MapDelta next = std::move(parts_.front());
  parts_.pop_front();
  return next;
}

}  // namespace dmslam
