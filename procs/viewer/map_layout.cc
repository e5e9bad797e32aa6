#include "viewer/map_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace dmslam {
namespace {

// In units of a map, whose scene was about one unit deep when it began.
constexpr double kAround = 1.5;  // what a keyframe sees lies within this of it, mostly
constexpr double kStep = 2.0;    // a map that grows moves the others only now and then

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  size_t keyframes = 0;
};

std::map<MapId, Extent> Extents(const Map& map) {
  std::map<MapId, Extent> extents;
  for (const auto& [id, keyframe] : map.keyframes()) {
    Extent& extent = extents[keyframe.map_id];
    const double x = keyframe.T_cam_world.Center().x();
    extent.low = std::min(extent.low, x);
    extent.high = std::max(extent.high, x);
    ++extent.keyframes;
  }
  for (auto& [map_id, extent] : extents) {
    extent.low = kStep * std::floor((extent.low - kAround) / kStep);
    extent.high = kStep * std::ceil((extent.high + kAround) / kStep);
  }
  return extents;
}

}  // namespace

const MapLayout::Place* MapLayout::Find(MapId map_id) const {
  const auto it = places_.find(map_id);
  return it == places_.end() ? nullptr : &it->second;
}

/// The one it had, where that is free; else the first that is.
uint32_t MapLayout::ColourFor(MapId map_id) {
  const auto is_free = [this](uint32_t colour) {
    return std::ranges::none_of(places_, [colour](const auto& item) { return item.second.colour == colour; });
  };
  const auto before = last_colour_.find(map_id);
  if (before != last_colour_.end() && is_free(before->second)) return before->second;
  uint32_t colour = 0;
  while (!is_free(colour)) ++colour;
  return last_colour_[map_id] = colour;
}

std::set<MapId> MapLayout::Arrange(const Map& map, std::optional<MapId> first) {
  const std::map<MapId, Extent> extents = Extents(map);
  std::set<MapId> changed;
  std::erase_if(places_, [&](const auto& item) { return !extents.contains(item.first); });
  const auto shown = first ? extents.find(*first) : extents.end();
  double next = shown == extents.end() ? 0 : shown->second.high;
  for (const auto& [map_id, extent] : extents) {
    const bool is_new = !places_.contains(map_id);
    if (is_new) {
      const uint32_t colour = ColourFor(map_id);
      places_[map_id].colour = colour;
    }
    Place& place = places_.at(map_id);
    place.keyframes = extent.keyframes;
    const double x = map_id == first ? 0 : next - extent.low;
    if (map_id != first) next += extent.high - extent.low;
    if (is_new || place.offset.x() != x) changed.insert(map_id);
    place.offset.x() = x;
  }
  return changed;
}

}  // namespace dmslam
