#include "dmslam/map/snapshot.h"

#include <algorithm>
#include <set>
#include <unordered_set>
#include <utility>

#include "dmslam/map/map_states.h"

namespace dmslam {
namespace {

constexpr size_t kFeatureBytes = 42, kLandmarkBytes = 120, kObservationBytes = 18, kSmallBytes = 90,
                 kTombstoneBytes = 16;

/// Those that see what `center` sees first, most first; then the newest.
std::vector<const Keyframe*> NearestFirst(const Map& map, std::optional<KeyframeId> center) {
  std::vector<const Keyframe*> order;
  if (const Keyframe* keyframe = center ? map.FindKeyframe(*center) : nullptr) {
    order = map.BestCovisible(*keyframe, static_cast<int>(map.keyframes().size()), 1);
    order.insert(order.begin(), keyframe);
  }
  const std::set<const Keyframe*> listed(order.begin(), order.end());
  for (auto it = map.keyframes().rbegin(); it != map.keyframes().rend(); ++it) {
    if (!listed.contains(&it->second)) order.push_back(&it->second);
  }
  return order;
}

class Cutter {
 public:
  Cutter(const Map& map, size_t max_bytes_hint) : map_(map), max_bytes_(max_bytes_hint), parts_(1) {
    sent_.reserve(map.num_landmarks());
  }

  /// The keyframe, the landmarks that it is the first to see, and what it sees with which feature.
  void Add(const Keyframe& keyframe) {
    RoomFor(kFeatureBytes * keyframe.features->size() + kSmallBytes)
        .keyframes.push_back(StateOf(keyframe, true));
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const LandmarkId id = keyframe.landmarks[i];
      if (!id.valid()) continue;
      Add(id);
      RoomFor(kObservationBytes).observations.push_back({keyframe.id, static_cast<uint16_t>(i), id});
    }
  }
  /// Some have no observer: their last feature was given to another.
  void AddUnobserved() {
    if (sent_.size() == map_.num_landmarks()) return;
    for (const LandmarkId id : map_.LandmarkIdsSorted()) Add(id);
  }
  void AddTombstones() {
    for (const auto& [id, tombstone] : map_.keyframe_tombstones())
      RoomFor(kSmallBytes).keyframe_tombstones.push_back(tombstone);
    for (const LandmarkId id : map_.landmark_burials())
      RoomFor(kTombstoneBytes).landmark_tombstones.push_back({id, map_.landmark_tombstones().at(id)});
  }
  std::vector<MapDelta> Take() { return std::move(parts_); }

 private:
  void Add(LandmarkId id) {
    if (sent_.insert(id).second) RoomFor(kLandmarkBytes).landmarks.push_back(StateOf(map_.At(id)));
  }
  MapDelta& RoomFor(size_t more) {
    if (bytes_ + more > max_bytes_ && bytes_ > 0) {
      parts_.emplace_back();
      bytes_ = 0;
    }
    bytes_ += more;
    return parts_.back();
  }

  const Map& map_;
  size_t max_bytes_;
  size_t bytes_ = 0;
  std::vector<MapDelta> parts_;
  std::unordered_set<LandmarkId> sent_;
};

}  // namespace

std::vector<MapDelta> CutSnapshot(const Map& map, std::optional<KeyframeId> center, size_t max_bytes_hint) {
  Cutter cutter(map, max_bytes_hint);
  for (const Keyframe* keyframe : NearestFirst(map, center)) cutter.Add(*keyframe);
  cutter.AddUnobserved();
  cutter.AddTombstones();
  std::vector<MapDelta> parts = cutter.Take();
  const std::vector<CameraId> cameras = map.cameras();
  parts.resize(std::max(parts.size(), cameras.size()));  // each tells of one
  for (size_t i = 0; i < parts.size(); ++i) {
    MapDelta& part = parts[i];
    part.event = MapEvent::kSnapshot;
    part.version = map.version();
    part.progress = cameras.empty() ? map.progress() : map.progress(cameras[i % cameras.size()]);
    if (center) part.about = center;
  }
  return parts;
}

}  // namespace dmslam
