#include "dmslam/mapping/correction.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/map/conventions.h"
#include "dmslam/map/neighbourhood.h"
#include "dmslam/mapping/landmark_fusion.h"

namespace dmslam {
namespace {

constexpr int kMaxLoopSide = 1000;  // keyframes on a loop's side that are joined with the place

/// Who follows which correction.
class Corrections {
 public:
  Corrections(const Map& map, const LoopAnswer& answer) : map_(map) {
    for (const auto& c : answer.corrections) own_[c.keyframe] = c.corrected_from_base;
  }

  /// The correction of a keyframe, there or culled: its own, or that of its nearest ancestor that has one;
  /// null: it stays.
  const Sim3d* Of(KeyframeId id) const {
    for (std::optional<KeyframeId> at = id; at; at = ParentOf(*at)) {
      const auto own = own_.find(*at);
      if (own != own_.end()) return &own->second;
    }
    return nullptr;
  }

 private:
  std::optional<KeyframeId> ParentOf(KeyframeId id) const {
    if (const Keyframe* keyframe = map_.FindKeyframe(id)) return keyframe->parent;
    const auto tombstone = map_.keyframe_tombstones().find(id);
    if (tombstone == map_.keyframe_tombstones().end()) return std::nullopt;
    return tombstone->second.parent;
  }

  const Map& map_;
  std::map<KeyframeId, Sim3d> own_;
};

void MoveLandmarks(MapEditor& map, const LoopAnswer& answer, const Corrections& corrections) {
  std::map<LandmarkId, Eigen::Vector3d> offsets;
  for (const auto& o : answer.landmark_offsets) offsets[o.landmark] = o.offset_world;
  for (const LandmarkId id : map.LandmarkIdsSorted()) {
    const Landmark& landmark = map.At(id);
    const Sim3d* correction = corrections.Of(landmark.reference);
    if (correction == nullptr) continue;
    const auto offset = offsets.find(id);
    if (offset == offsets.end()) {
      map.MoveWithReference(landmark, *correction);
    } else {
      map.SetPosition(landmark, *correction * landmark.p_world + offset->second);
    }
  }
}

void MoveKeyframes(MapEditor& map, const Corrections& corrections) {
  for (const auto& [id, keyframe] : map.keyframes()) {
    const Sim3d* correction = corrections.Of(id);
    if (correction == nullptr) continue;
    const Sim3d corrected = Sim3d(keyframe.T_cam_world) * correction->Inverse();
    map.SetPoseAndScale(keyframe, corrected.ToRigid(), correction->scale);
  }
}

/// The two ends of a loop as they stand in the map of now.
struct LoopEnds {
  const Keyframe& here;   ///< the keyframe that closed it
  const Keyframe& there;  ///< the place
};

std::optional<LoopEnds> EndsOf(const Map& map, const LoopAnswer& answer) {
  if (!answer.seen_from || !answer.matched) return std::nullopt;
  const Keyframe* here = map.Resolve(*answer.seen_from);
  const Keyframe* there = map.Resolve(*answer.matched);
  if (here == nullptr || there == nullptr || here == there) return std::nullopt;
  return LoopEnds{*here, *there};
}

/// Where a keyframe stands to the one that closed the loop.
struct BesideLoop {
  const Keyframe* keyframe = nullptr;
  Rigid3d T_cam_here;
};

/// The keyframe of a loop and its neighbours, by id, where they stand to it: of what lies between them the
/// loop says nothing new, while the corrected poses also share in what the graph has spread.
struct LoopSide {
  std::vector<BesideLoop> keyframes;
  double scale = 1.0;  ///< of the loop's keyframe when this was measured
};

LoopSide SideOf(const Map& map, const LoopEnds& ends, int min_covisibility) {
  std::vector<const Keyframe*> side = map.BestCovisible(ends.here, kMaxLoopSide, min_covisibility);
  side.push_back(&ends.here);
  // Who sees the place already is of that side.
  std::erase_if(side, [&](const Keyframe* keyframe) {
    const bool sees_place = ends.there.covisible.contains(keyframe->id);
    return keyframe == &ends.there || (keyframe != &ends.here && sees_place);
  });
  std::ranges::sort(side, {}, &Keyframe::id);
  LoopSide measured;
  measured.scale = ends.here.scale;
  const Rigid3d T_world_here = ends.here.T_cam_world.Inverse();
  for (const Keyframe* keyframe : side)
    measured.keyframes.push_back({keyframe, keyframe->T_cam_world * T_world_here});
  return measured;
}

FusionCounts FuseAsTold(MapEditor& map, const LoopAnswer& answer) {
  FusionCounts fused;
  for (const auto& fusion : answer.fusions) {
    const Landmark *goes = map.Resolve(fusion.from), *stays = map.Resolve(fusion.into);
    if (goes == nullptr || stays == nullptr || goes == stays) continue;
    map.Fuse(*goes, *stays, Merged(stays->evidence, goes->evidence));
    ++fused.landmarks;
  }
  return fused;
}

/// Every keyframe of this side is tied to all that it sees of the place: a few landmarks in a corner of its
/// image would leave it free to turn about them.
FusionCounts TieToPlace(MapEditor& map, const LoopEnds& ends, const LoopSide& side,
                        std::vector<LandmarkId> place, const MapperOptions& options) {
  FusionCounts fused;
  for (const BesideLoop& beside : side.keyframes) {
    for (LandmarkId& id : place) {
      if (const Landmark* landmark = map.Resolve(id)) id = landmark->id;
    }
    std::sort(place.begin(), place.end());
    place.erase(std::unique(place.begin(), place.end()), place.end());
    const Rigid3d T_cam_here(beside.T_cam_here.rotation,
                             beside.T_cam_here.translation * (ends.here.scale / side.scale));
    fused += FuseInto(map, *beside.keyframe, T_cam_here * ends.here.T_cam_world, place, options);
  }
  return fused;
}

/// What the two ends of a loop have in common becomes one.
FusionCounts Connect(MapEditor& map, const LoopAnswer& answer, const LoopEnds& ends, const LoopSide& side,
                     const MapperOptions& options) {
  if (ends.here.map_id != ends.there.map_id) JoinMaps(map, ends.here, ends.there);
  map.AddLoopEdge(ends.here, ends.there);
  const std::vector<LandmarkId> place =
      LandmarksAround(map, ends.there.id, kPlaceNeighbours, options.min_covisibility);
  FusionCounts fused = FuseAsTold(map, answer);
  fused += TieToPlace(map, ends, side, place, options);
  fused += FuseWithNeighbours(map, ends.here, options);
  return fused;
}

/// Turns the spanning tree of a keyframe around, so that it hangs from `parent`.
void Reroot(MapEditor& map, KeyframeId id, KeyframeId parent) {
  for (std::optional<KeyframeId> at = id; at;) {
    const Keyframe& keyframe = map.At(*at);
    const std::optional<KeyframeId> next = keyframe.parent;
    map.SetParent(keyframe, parent);
    parent = *at;
    at = next;
  }
}

}  // namespace

std::string WhyRefused(const Map& map, const LoopAnswer& answer) {
  const bool known =
      std::ranges::any_of(answer.corrections, [&](const LoopAnswer::KeyframeCorrection& correction) {
        return map.FindKeyframe(correction.keyframe) != nullptr;
      });
  if (!known) return "its keyframes are gone";
  const std::string computed = "computed on version " + std::to_string(answer.base_version);
  const std::optional<uint64_t> corrected = map.progress().corrected;
  if (corrected && answer.base_version < *corrected) {
    return computed + ", before the correction of version " + std::to_string(*corrected);
  }
  if (answer.base_version > map.version()) {
    return computed + "; the map's is " + std::to_string(map.version());
  }
  return "";
}

FusionCounts ApplyCorrection(MapEditor& map, const LoopAnswer& answer, const MapperOptions& options) {
  const bool is_loop = answer.kind == LoopAnswer::Kind::kLoop;
  const std::optional<LoopEnds> ends = is_loop ? EndsOf(map, answer) : std::nullopt;
  const LoopSide side = ends ? SideOf(map, *ends, options.min_covisibility) : LoopSide();
  const Corrections corrections(map, answer);
  MoveLandmarks(map, answer, corrections);
  MoveKeyframes(map, corrections);
  return ends ? Connect(map, answer, *ends, side, options) : FusionCounts();
}

void JoinMaps(MapEditor& map, const Keyframe& end, const Keyframe& place) {
  const MapId from = end.map_id;
  for (const Keyframe* keyframe : map.KeyframesOf(from)) map.SetMapId(*keyframe, place.map_id);
  for (const Landmark* landmark : map.LandmarksOf(from)) map.SetMapId(*landmark, place.map_id);
  Reroot(map, end.id, place.id);
}

}  // namespace dmslam
