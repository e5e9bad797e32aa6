#include "dmslam/mapping/insertion_order.h"

#include <algorithm>
#include <map>

namespace dmslam {
namespace {

constexpr size_t kRemembered =
    16384;  // keyframes, of which a third lives on; Newest() wants 500 of each camera

}  // namespace

void InsertionOrder::Add(KeyframeId id) {
  ids_.push_back(id);
  if (ids_.size() > kRemembered) ids_.pop_front();
}

void InsertionOrder::Assume(const Map& map) {
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : map.keyframes()) ids.push_back(id);
  for (const auto& [id, tombstone] : map.keyframe_tombstones()) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  const auto settled = std::find(ids.begin(), ids.end(), map.progress().settled);
  if (settled != ids.end()) std::rotate(settled, settled + 1, ids.end());
  ids_.assign(ids.end() - static_cast<std::ptrdiff_t>(std::min(ids.size(), kRemembered)), ids.end());
}

int InsertionOrder::CountSince(const Map& map, KeyframeId id, int most) const {
  int count = 0;
  for (auto it = ids_.rbegin(); it != ids_.rend() && *it != id && count < most; ++it) {
    if (it->camera() == id.camera() && map.HasKnown(*it)) ++count;  // not those of a dropped map
  }
  return count;
}

std::vector<KeyframeId> InsertionOrder::Newest(const Map& map, MapId map_id, int most) const {
  std::vector<KeyframeId> newest;
  std::map<CameraId, int> taken;
  for (auto it = ids_.rbegin(); it != ids_.rend(); ++it) {
    int& of_camera = taken[it->camera()];
    if (of_camera == most) continue;
    const Keyframe* keyframe = map.FindKeyframe(*it);
    if (keyframe == nullptr || keyframe->map_id != map_id) continue;
    ++of_camera;
    newest.push_back(*it);
  }
  return newest;
}

}  // namespace dmslam
