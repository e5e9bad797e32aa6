#include "dmslam/map/map_difference.h"

#include <algorithm>
#include <map>
#include <utility>

#include "dmslam/geometry/similarity.h"
#include "dmslam/map/renumbering.h"

namespace dmslam {
namespace {

/// A landmark by what it is called in its own run, wherever that has come to.
struct NameInRun {
  uint32_t session = 0;
  size_t mapper = 0;  ///< of those of the session that made landmarks, one after another
  uint64_t number = 0;
  auto operator<=>(const NameInRun&) const = default;
};

std::map<NameInRun, LandmarkId> LandmarksByName(const Map& map) {
  struct Maker {
    uint32_t session = 0;
    size_t mapper = 0;
  };
  std::map<uint32_t, size_t> mappers;  // by session
  std::map<uint16_t, Maker> makers;
  for (const auto& [ordinal, session] : SessionsByOrdinal(map))
    makers[ordinal] = {session, mappers[session]++};
  std::map<NameInRun, LandmarkId> landmarks;
  for (const LandmarkId id : map.LandmarkIdsSorted()) {
    const Maker& maker = makers.at(id.epoch_ordinal());
    landmarks[{maker.session, maker.mapper, id.number()}] = id;
  }
  return landmarks;
}

/// When each keyframe that a map knows was taken, living or culled [ns].
std::map<KeyframeId, int64_t> StampsOf(const Map& map) {
  std::map<KeyframeId, int64_t> stamps;
  for (const auto& [id, keyframe] : map.keyframes()) stamps[id] = keyframe.stamp_ns;
  for (const auto& [id, tombstone] : map.keyframe_tombstones()) stamps[id] = tombstone.stamp_ns;
  return stamps;
}

/// By the keyframes of the sessions that both maps know: one run takes each frame once.
void JudgeByKeyframes(const Map& a, const Map& b, MapDifference* difference) {
  const std::map<KeyframeId, int64_t> in_a = StampsOf(a), in_b = StampsOf(b);
  std::set<uint32_t> of_a, of_b, shared;
  for (const auto& [id, stamp_ns] : in_b) of_b.insert(id.session());
  for (const auto& [id, stamp_ns] : in_a) {
    of_a.insert(id.session());
    const auto other = in_b.find(id);
    if (other == in_b.end()) continue;
    shared.insert(id.session());
    if (other->second == stamp_ns) continue;
    difference->other_runs.emplace(id.session(), OtherRun::kOtherTimes);
    difference->other_times.push_back({id, stamp_ns, other->second});
  }
  for (const uint32_t session : of_a) {
    if (of_b.contains(session) && !shared.contains(session))
      difference->other_runs.emplace(session, OtherRun::kNoKeyframe);
  }
}

/// Whether they may be one landmark at two times: it is seen as it was seen, or was made when it was made.
bool MayBeOne(const Landmark& a, const Landmark& b) {
  if (a.first_ns == b.first_ns) return true;
  std::vector<Observation> common;
  std::ranges::set_intersection(a.observations, b.observations, std::back_inserter(common));
  return !common.empty();
}

/// By their landmarks: in one run most of them are what they were. `in_a`, `in_b`: all.
void JudgeByLandmarks(const Map& a, const Map& b, const std::map<NameInRun, LandmarkId>& in_a,
                      const std::map<NameInRun, LandmarkId>& in_b, MapDifference* difference) {
  struct Votes {
    size_t all = 0, may_be_one = 0;
  };
  std::map<uint32_t, Votes> votes;
  for (const auto& [name, id] : in_a) {
    const auto other = in_b.find(name);
    if (other == in_b.end()) continue;
    ++votes[name.session].all;
    votes[name.session].may_be_one += MayBeOne(a.At(id), b.At(other->second)) ? 1 : 0;
  }
  for (const auto& [session, counted] : votes) {
    if (2 * counted.may_be_one < counted.all)
      difference->other_runs.emplace(session, OtherRun::kOtherLandmarks);
  }
}

/// Which things of two maps are the same.
class Matches {
 public:
  /// `other_runs`: of which nothing is.
  Matches(const Map& a, const Map& b, const std::map<NameInRun, LandmarkId>& landmarks_a,
          const std::map<NameInRun, LandmarkId>& landmarks_b, const OtherRuns& other_runs);

  const Map& a() const { return a_; }
  const Map& b() const { return b_; }
  /// The same in `b`; null: it is not there.
  const Keyframe* Of(const Keyframe& of_a) const {
    return other_runs_.contains(of_a.id.session()) ? nullptr : b_.FindKeyframe(of_a.id);
  }
  const Landmark* Of(const Landmark& of_a) const {
    const auto match = landmarks_.find(of_a.id);
    return match == landmarks_.end() ? nullptr : &b_.At(match->second);
  }
  NamesApart<KeyframeId> Keyframes() const;
  NamesApart<LandmarkId> Landmarks() const;

 private:
  const Map& a_;
  const Map& b_;
  const OtherRuns& other_runs_;
  std::map<LandmarkId, LandmarkId> landmarks_;  ///< of `a` and `b`
};

Matches::Matches(const Map& a, const Map& b, const std::map<NameInRun, LandmarkId>& landmarks_a,
                 const std::map<NameInRun, LandmarkId>& landmarks_b, const OtherRuns& other_runs)
    : a_(a), b_(b), other_runs_(other_runs) {
  for (const auto& [name, id] : landmarks_a) {
    const auto match = landmarks_b.find(name);
    if (match != landmarks_b.end() && !other_runs.contains(name.session)) landmarks_[id] = match->second;
  }
}

NamesApart<KeyframeId> Matches::Keyframes() const {
  NamesApart<KeyframeId> names;
  for (const auto& [id, keyframe] : a_.keyframes()) {
    if (Of(keyframe) != nullptr) {
      ++names.both;
    } else {
      names.only_a.push_back(id);
    }
  }
  for (const auto& [id, keyframe] : b_.keyframes()) {
    if (other_runs_.contains(id.session()) || a_.FindKeyframe(id) == nullptr) names.only_b.push_back(id);
  }
  return names;
}

NamesApart<LandmarkId> Matches::Landmarks() const {
  NamesApart<LandmarkId> names;
  std::set<LandmarkId> matched;
  for (const auto& [of_a, of_b] : landmarks_) matched.insert(of_b);
  names.both = matched.size();
  for (const LandmarkId id : a_.LandmarkIdsSorted()) {
    if (!landmarks_.contains(id)) names.only_a.push_back(id);
  }
  std::ranges::set_difference(b_.LandmarkIdsSorted(), matched, std::back_inserter(names.only_b));
  return names;
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

CommonMap CompareMap(const Matches& matches, MapId in_a, MapId in_b) {
  const Map &a = matches.a(), &b = matches.b();
  CommonMap common;
  common.a = in_a;
  common.b = in_b;
  Places cameras, points;
  for (const Keyframe* keyframe : a.KeyframesOf(in_a)) {
    const Keyframe* other = matches.Of(*keyframe);
    if (other == nullptr || other->map_id != in_b) continue;
    cameras.Add(keyframe->T_cam_world.Center(), other->T_cam_world.Center(),
                a.MedianDepth(*keyframe).value_or(0.0), b.MedianDepth(*other).value_or(0.0));
  }
  for (const Landmark* landmark : a.LandmarksOf(in_a)) {
    const Landmark* other = matches.Of(*landmark);
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
std::optional<MapId> Counterpart(const Matches& matches, MapId in_a) {
  std::map<MapId, size_t> votes;
  for (const Keyframe* keyframe : matches.a().KeyframesOf(in_a)) {
    if (const Keyframe* other = matches.Of(*keyframe)) ++votes[other->map_id];
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

/// What is in both, and how it has changed there.
void CompareMatches(const Matches& matches, MapDifference* difference) {
  const Map& a = matches.a();
  std::set<MapId> maps_b = MapsOf(matches.b());
  for (const auto& [id, keyframe] : a.keyframes()) {
    const Keyframe* other = matches.Of(keyframe);
    if (other == nullptr) continue;
    maps_b.erase(other->map_id);
    if (!SameKeyframe(keyframe, *other)) ++difference->changed_keyframes;
  }
  for (const LandmarkId id : a.LandmarkIdsSorted()) {
    const Landmark* other = matches.Of(a.At(id));
    if (other == nullptr) continue;
    if (!SameLandmark(a.At(id), *other)) ++difference->changed_landmarks;
    if (other->id != id) ++difference->renumbered_landmarks;
  }
  difference->maps.only_b.assign(maps_b.begin(), maps_b.end());
  for (const MapId in_a : MapsOf(a)) {
    if (const std::optional<MapId> in_b = Counterpart(matches, in_a)) {
      ++difference->maps.both;
      difference->common.push_back(CompareMap(matches, in_a, *in_b));
    } else {
      difference->maps.only_a.push_back(in_a);
    }
  }
}

}  // namespace

bool MapDifference::Equal() const {
  const auto same = [](const auto& names) { return names.only_a.empty() && names.only_b.empty(); };
  const bool in_place = std::ranges::all_of(
      common, [](const CommonMap& map) { return map.cameras.moved == 0 && map.points.moved == 0; });
  return same(maps) && same(keyframes) && same(landmarks) && other_runs.empty() && changed_keyframes == 0 &&
         changed_landmarks == 0 && renumbered_landmarks == 0 && in_place;
}

MapDifference Compare(const Map& a, const Map& b, const std::set<uint32_t>& other_runs) {
  MapDifference difference;
  for (const uint32_t session : other_runs) difference.other_runs.emplace(session, OtherRun::kTold);
  JudgeByKeyframes(a, b, &difference);
  const std::map<NameInRun, LandmarkId> in_a = LandmarksByName(a), in_b = LandmarksByName(b);
  JudgeByLandmarks(a, b, in_a, in_b, &difference);
  const Matches matches(a, b, in_a, in_b, difference.other_runs);
  difference.keyframes = matches.Keyframes();
  difference.landmarks = matches.Landmarks();
  CompareMatches(matches, &difference);
  return difference;
}

}  // namespace dmslam
