#include "dmslam/map/map_difference.h"

#include <algorithm>
#include <map>
#include <utility>

#include "dmslam/geometry/similarity.h"
#include "dmslam/map/renumbering.h"

namespace dmslam {
namespace {

template <typename Id, typename Ids>
NamesApart<Id> Apart(const Ids& a, const Ids& b) {
  NamesApart<Id> names;
  std::ranges::set_difference(a, b, std::back_inserter(names.only_a));
  std::ranges::set_difference(b, a, std::back_inserter(names.only_b));
  names.both = a.size() - names.only_a.size();
  return names;
}

std::vector<KeyframeId> KeyframeIds(const Map& map) {
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : map.keyframes()) ids.push_back(id);
  return ids;
}

double Middle(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Places of the same things in two maps, and how deep the scene is there.
class Places {
 public:
  /// `depth_a`, `depth_b`: in units of each map; 0: not known.
  void Add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double depth_a, double depth_b) {
    a_.push_back(a);
    b_.push_back(b);
    depth_a_.push_back(depth_a);
    depth_b_.push_back(depth_b);
  }
  size_t size() const { return a_.size(); }
  size_t NumMoved() const {
    size_t moved = 0;
    for (size_t i = 0; i < a_.size(); ++i) moved += a_[i] == b_[i] ? 0 : 1;
    return moved;
  }
  std::optional<Sim3d> Align() const { return AlignSim3(a_, b_); }
  Displacement Beyond(const Sim3d& S_b_a) const {
    Displacement displacement;
    displacement.moved = NumMoved();
    std::vector<double> depths;
    for (size_t i = 0; i < a_.size(); ++i) {
      const double depth = std::max(S_b_a.scale * depth_a_[i], depth_b_[i]);
      if (depth > 0) depths.push_back((b_[i] - S_b_a * a_[i]).norm() / depth);
    }
    if (displacement.moved == 0 || depths.empty()) return displacement;
    displacement.max_depths = *std::ranges::max_element(depths);
    displacement.median_depths = Middle(depths);
    return displacement;
  }

 private:
  std::vector<Eigen::Vector3d> a_, b_;
  std::vector<double> depth_a_, depth_b_;
};

double DepthAt(const Map& map, const Landmark& landmark) {
  const Keyframe* reference = map.FindKeyframe(landmark.reference);
  return reference == nullptr ? 0.0 : (landmark.p_world - reference->T_cam_world.Center()).norm();
}

CommonMap CompareMap(const Map& a, const Map& b, MapId in_a, MapId in_b) {
  CommonMap common;
  common.a = in_a;
  common.b = in_b;
  Places cameras, points;
  for (const Keyframe* keyframe : a.KeyframesOf(in_a)) {
    const Keyframe* other = b.FindKeyframe(keyframe->id);
    if (other == nullptr || other->map_id != in_b) continue;
    cameras.Add(keyframe->T_cam_world.Center(), other->T_cam_world.Center(),
                a.MedianDepth(*keyframe).value_or(0.0), b.MedianDepth(*other).value_or(0.0));
  }
  for (const Landmark* landmark : a.LandmarksOf(in_a)) {
    const Landmark* other = b.FindLandmark(landmark->id);
    if (other != nullptr && other->map_id == in_b)
      points.Add(landmark->p_world, other->p_world, DepthAt(a, *landmark), DepthAt(b, *other));
  }
  common.keyframes = cameras.size();
  common.landmarks = points.size();
  // Where most stand as they stood the map has not moved, though some of it may have.
  if (2 * cameras.NumMoved() > cameras.size()) common.S_b_a = cameras.Align();
  const Sim3d S_b_a = common.S_b_a.value_or(Sim3d());
  common.cameras = cameras.Beyond(S_b_a);
  common.points = points.Beyond(S_b_a);
  return common;
}

/// Which map of `b` has most keyframes of map `in_a`; none: no map has any.
std::optional<MapId> Counterpart(const Map& a, const Map& b, MapId in_a) {
  std::map<MapId, size_t> votes;
  for (const Keyframe* keyframe : a.KeyframesOf(in_a)) {
    if (const Keyframe* other = b.FindKeyframe(keyframe->id)) ++votes[other->map_id];
  }
  const auto best = std::ranges::max_element(votes, {}, [](const auto& vote) { return vote.second; });
  return best == votes.end() ? std::nullopt : std::optional(best->first);
}

bool SameKeyframe(const Keyframe& a, const Keyframe& b) {
  return a.map_id == b.map_id && a.parent == b.parent && a.loop_edges == b.loop_edges && a.scale == b.scale &&
         a.camera_id == b.camera_id && a.T_cam_world.rotation.coeffs() == b.T_cam_world.rotation.coeffs() &&
         a.features->size() == b.features->size();
}

bool SameLandmark(const Landmark& a, const Landmark& b) {
  return a.map_id == b.map_id && a.descriptor == b.descriptor && a.reference == b.reference &&
         a.first_keyframe == b.first_keyframe && a.first_ns == b.first_ns && a.evidence == b.evidence &&
         a.observations == b.observations;
}

}  // namespace

bool MapDifference::Equal() const {
  const auto same = [](const auto& names) { return names.only_a.empty() && names.only_b.empty(); };
  const bool in_place = std::ranges::all_of(
      common, [](const CommonMap& map) { return map.cameras.moved == 0 && map.points.moved == 0; });
  return same(maps) && same(keyframes) && same(landmarks) && other_times.empty() && changed_keyframes == 0 &&
         changed_landmarks == 0 && in_place;
}

MapDifference Compare(const Map& a, const Map& b) {
  MapDifference difference;
  difference.maps = Apart<MapId>(MapsOf(a), MapsOf(b));
  difference.keyframes = Apart<KeyframeId>(KeyframeIds(a), KeyframeIds(b));
  difference.landmarks = Apart<LandmarkId>(a.LandmarkIdsSorted(), b.LandmarkIdsSorted());
  for (const auto& [id, keyframe] : a.keyframes()) {
    const Keyframe* other = b.FindKeyframe(id);
    if (other == nullptr) continue;
    if (other->stamp_ns != keyframe.stamp_ns) difference.other_times.push_back(id);
    if (!SameKeyframe(keyframe, *other)) ++difference.changed_keyframes;
  }
  for (const LandmarkId id : a.LandmarkIdsSorted()) {
    const Landmark* other = b.FindLandmark(id);
    if (other != nullptr && !SameLandmark(a.At(id), *other)) ++difference.changed_landmarks;
  }
  for (const MapId in_a : MapsOf(a)) {
    if (const std::optional<MapId> in_b = Counterpart(a, b, in_a))
      difference.common.push_back(CompareMap(a, b, in_a, *in_b));
  }
  return difference;
}

}  // namespace dmslam
