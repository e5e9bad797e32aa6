#include "dmslam/mapping/mapper_core.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "dmslam/dynamics/seen_through.h"
#include "dmslam/map/neighbourhood.h"
#include "dmslam/mapping/landmark_fusion.h"
#include "dmslam/mapping/map_maintenance.h"

namespace dmslam {
namespace {

constexpr int kInitialAdjustmentIterations = 20;
constexpr int kMinInitialLandmarks = 40;
constexpr int kMaxLoopSide = 1000;    // keyframes on a loop's side that are joined with the place
constexpr int kPlaceNeighbours = 15;  // keyframes around the place

/// The correction of a keyframe: its own, or that of its nearest ancestor that has one.
const Sim3d* CorrectionOf(const Map& map, KeyframeId id, const std::map<KeyframeId, Sim3d>& corrections) {
  while (id.valid()) {
    const auto it = corrections.find(id);
    if (it != corrections.end()) return &it->second;
    const Keyframe* keyframe = map.FindKeyframe(id);
    if (keyframe != nullptr) {
      id = keyframe->parent;
    } else {
      const auto tombstone = map.keyframe_tombstones().find(id);
      id = tombstone == map.keyframe_tombstones().end() ? KeyframeId{} : tombstone->second.parent;
    }
  }
  return nullptr;
}

}  // namespace

MapperCore::MapperCore(const MapperOptions& options, const Camera& camera, const Pyramid& pyramid,
                       uint16_t epoch_ordinal, Sink sink)
    : options_(options), map_(camera, pyramid), epoch_ordinal_(epoch_ordinal), sink_(std::move(sink)) {}

void MapperCore::ContinueSaved(Map map) {
  MapEditor saved(std::move(map));
  saved.SetProgress({});
  Continue(std::move(saved));
}

void MapperCore::Continue(Map map) {
  map_ = MapEditor(std::move(map));
  epoch_ordinal_ = static_cast<uint16_t>(std::max<int>(map_.HighestOrdinal(), epoch_ordinal_) + 1);
  next_landmark_ = 1;
  order_.Assume(map_);
  maybe_unfinished_ = true;
}

void MapperCore::Publish(MapEvent event, KeyframeId about, MapId map_id, uint64_t correction_id,
                         std::string note) {
  MapDelta delta = map_.TakeDelta(event, about, map_id);
  delta.correction_id = correction_id;
  delta.note = std::move(note);
  const bool says_something = event == MapEvent::kSettled || event == MapEvent::kRefused ||
                              event == MapEvent::kMapped || event == MapEvent::kEnded;
  if (!delta.Empty() || says_something) sink_(delta);
}

LandmarkId MapperCore::AddLandmark(MapId map_id, KeyframeId reference, KeyframeId newest,
                                   const Eigen::Vector3d& p_world) {
  Landmark landmark;
  landmark.id = LandmarkId::Make(epoch_ordinal_, next_landmark_++);
  landmark.map_id = map_id;
  landmark.p_world = p_world;
  landmark.reference = reference;
  landmark.first_keyframe = newest;
  landmark.first_ns = map_.FindKeyframe(newest)->stamp_ns;
  landmark.evidence.visible = 1;
  landmark.evidence.found = 1;
  const LandmarkId id = landmark.id;
  map_.AddLandmark(std::move(landmark));
  return id;
}

// ---- A first map ----

bool MapperCore::OnInitialMap(const InitialMap& proposal) {
  if (map_.FindKeyframe(proposal.second.id) != nullptr) {
    ++counters_.keyframes_repeated;
    return false;
  }
  if (BuildInitialMap(proposal)) {
    ++counters_.maps_started;
    Publish(MapEvent::kMapStarted, proposal.second.id, proposal.map_id);
    return true;
  }
  ++counters_.maps_refused;
  map_.DropMap(proposal.map_id);
  Publish(MapEvent::kMapDropped, proposal.second.id, proposal.map_id, 0,
          "too few landmarks after bundle adjustment");
  return false;
}

bool MapperCore::BuildInitialMap(const InitialMap& proposal) {
  const KeyframeId first = proposal.first.id, second = proposal.second.id;
  if (map_.FindKeyframe(first) != nullptr || map_.keyframe_tombstones().contains(first)) return false;
  map_.AddKeyframe(MakeKeyframe(proposal.first, Rigid3d()));
  Keyframe other = MakeKeyframe(proposal.second, proposal.second.T_cam_reference);
  other.parent = first;
  map_.AddKeyframe(std::move(other));
  order_.Add(first);
  order_.Add(second);
  for (const InitialMap::Point& point : proposal.points) {
    const bool known = point.feature_first < map_.FindKeyframe(first)->landmarks.size() &&
                       point.feature_second < map_.FindKeyframe(second)->landmarks.size();
    if (!known) continue;
    const LandmarkId id = AddLandmark(proposal.map_id, first, second, point.p_world);
    map_.SetObservation(first, point.feature_first, id);
    map_.SetObservation(second, point.feature_second, id);
    map_.UpdateDescriptor(id);
  }
  AdjustWholeMap(map_, proposal.map_id, kInitialAdjustmentIterations, 1.0, nullptr);
  if (map_.CountTracked(*map_.FindKeyframe(second), 2) < kMinInitialLandmarks) return false;
  ScaleToUnitDepth(proposal.map_id, first);
  return true;
}

void MapperCore::ScaleToUnitDepth(MapId map_id, KeyframeId first) {
  const std::optional<double> depth = map_.MedianDepth(*map_.FindKeyframe(first));
  if (!depth || !(*depth > 0)) return;
  std::vector<std::pair<KeyframeId, Rigid3d>> poses;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    if (keyframe.map_id != map_id) continue;
    poses.emplace_back(id, Rigid3d(keyframe.T_cam_world.rotation, keyframe.T_cam_world.translation / *depth));
  }
  for (const auto& [id, pose] : poses) map_.SetPose(id, pose);
  for (const LandmarkId id : map_.LandmarkIdsSorted()) {
    const Landmark& landmark = *map_.FindLandmark(id);
    if (landmark.map_id == map_id) map_.SetPosition(id, landmark.p_world / *depth);
  }
}

// ---- A keyframe ----

bool MapperCore::OnKeyframe(const KeyframeProposal& proposal) {
  adjusted_ = false;
  const bool again = std::exchange(maybe_unfinished_, false) && map_.FindKeyframe(proposal.id) != nullptr;
  if (!again) {
    if (!Insert(proposal)) return false;
    Publish(MapEvent::kKeyframeInserted, proposal.id, proposal.map_id);
  }
  MapAround(proposal);
  return true;
}

/// Local mapping around a keyframe that is in the map.
void MapperCore::MapAround(const KeyframeProposal& proposal) {
  const KeyframeId id = proposal.id;
  const MapId map_id = proposal.map_id;
  counters_.landmarks_culled += static_cast<uint64_t>(CullYoungLandmarks(map_, map_id, order_, options_));
  CreateLandmarks(id, proposal.moving);
  if (options_.seen_through.enabled) {
    counters_.landmarks_seen_through +=
        static_cast<uint64_t>(RemoveSeenThrough(map_, id, options_.seen_through));
  }
  Publish(MapEvent::kLandmarksCreated, id, map_id);
  if (Interrupted()) {
    ++counters_.adjustments_interrupted;
  } else {
    Refine(id, map_id);
    counters_.keyframes_culled +=
        static_cast<uint64_t>(CullRedundantKeyframes(map_, id, proposal.reference, options_));
  }
  Publish(MapEvent::kMapped, id, map_id);
}

void MapperCore::Refine(KeyframeId id, MapId map_id) {
  counters_.fusions += static_cast<uint64_t>(FuseWithNeighbours(map_, id, options_));
  Publish(MapEvent::kFused, id, map_id);
  const MapAdjustmentReport report = AdjustLocally(map_, id, options_, interrupt_);
  if (report.bundle.interrupted) ++counters_.adjustments_interrupted;
  Publish(MapEvent::kAdjusted, id, map_id);
}

Keyframe MapperCore::MakeKeyframe(const KeyframeProposal& proposal, const Rigid3d& T_cam_world) const {
  Keyframe keyframe;
  keyframe.id = proposal.id;
  keyframe.map_id = proposal.map_id;
  keyframe.stamp_ns = proposal.stamp_ns;
  keyframe.T_cam_world = T_cam_world;
  keyframe.features = MakeFrameFeatures(proposal.features, map_.camera(), map_.pyramid());
  return keyframe;
}

bool MapperCore::Insert(const KeyframeProposal& proposal) {
  if (map_.FindKeyframe(proposal.id) != nullptr || map_.keyframe_tombstones().contains(proposal.id)) {
    ++counters_.keyframes_repeated;
    return false;
  }
  const std::optional<Map::ResolvedPose> reference = map_.ResolvePose(proposal.reference);
  const std::optional<KeyframeId> parent = map_.ResolveKeyframe(proposal.reference);
  if (!reference || !parent || reference->map_id != proposal.map_id) {
    ++counters_.keyframes_refused;
    return false;
  }
  Keyframe keyframe =
      MakeKeyframe(proposal, reference->Compose(proposal.T_cam_reference, proposal.reference_scale));
  keyframe.scale = reference->scale;
  keyframe.parent = *parent;
  map_.AddKeyframe(std::move(keyframe));
  order_.Add(proposal.id);
  ++counters_.keyframes_inserted;
  AddMatches(proposal);
  ChooseParent(proposal.id, *parent);
  return true;
}

void MapperCore::AddMatches(const KeyframeProposal& proposal) {
  for (const KeyframeProposal::Match& match : proposal.matches) {
    const std::optional<LandmarkId> landmark = map_.Resolve(match.landmark);
    const bool usable = landmark && match.feature < map_.FindKeyframe(proposal.id)->landmarks.size() &&
                        map_.FindLandmark(*landmark)->map_id == proposal.map_id;
    if (!usable) {
      ++counters_.observations_dropped;
      continue;
    }
    map_.SetObservation(proposal.id, match.feature, *landmark);
    map_.UpdateDescriptor(*landmark);
  }
}

void MapperCore::ChooseParent(KeyframeId id, KeyframeId fallback) {
  const std::vector<KeyframeId> best = map_.BestCovisible(id, 1, 1);
  map_.SetParent(id, best.empty() ? fallback : best.front());
}

void MapperCore::CreateLandmarks(KeyframeId id, const std::vector<uint16_t>& moving) {
  const MapId map_id = map_.FindKeyframe(id)->map_id;
  for (const NewLandmark& made : ProposeLandmarks(map_, id, moving, options_.creation, &counters_.creation)) {
    // An earlier one of the list may have taken a neighbour's feature.
    const auto taken = [&](const NeighbourFeature& seen_by) {
      return map_.FindKeyframe(seen_by.keyframe)->landmarks[seen_by.feature].valid();
    };
    if (taken(made.seen_by.front())) continue;
    const LandmarkId landmark = AddLandmark(map_id, id, id, made.p_world);
    map_.SetObservation(id, made.feature, landmark);
    for (const NeighbourFeature& seen_by : made.seen_by) {
      if (!taken(seen_by)) map_.SetObservation(seen_by.keyframe, seen_by.feature, landmark);
    }
    map_.UpdateDescriptor(landmark);
  }
}

void MapperCore::OnEvidence(const FrameEvidence& evidence) {
  const EvidenceReport report = ApplyEvidence(map_, evidence, options_.belief);
  counters_.evidence_dropped += static_cast<uint64_t>(report.unknown);
  counters_.landmarks_moving_removed += static_cast<uint64_t>(report.removed);
  Publish(MapEvent::kEvidence, {}, evidence.map_id);
}

void MapperCore::OnReset(const MapReset& reset) {
  if (reset.map_id == 0) {
    if (!adjusted_) AdjustMaps();
    Settle({}, 0);
    return;
  }
  if (!reset.drop) return;
  ++counters_.maps_dropped;
  map_.DropMap(reset.map_id);
  Publish(MapEvent::kMapDropped, {}, reset.map_id, 0, reset.reason);
}

void MapperCore::Settle(KeyframeId id, MapId map_id) {
  MapProgress progress = map_.progress();
  if (id.valid()) progress.settled = id;  // "the sequence has ended" is about no keyframe
  map_.SetProgress(progress);
  Publish(MapEvent::kSettled, id, map_id);
}

void MapperCore::AdjustMaps() {
  std::set<MapId> maps;
  for (const auto& [id, keyframe] : map_.keyframes()) maps.insert(keyframe.map_id);
  for (const MapId map_id : maps) {
    counters_.landmarks_culled += static_cast<uint64_t>(RemoveTooNear(map_, map_id, options_.min_depth));
    AdjustWholeMap(map_, map_id, options_.final_adjustment_iterations, options_.keypoint_sigma_px, nullptr);
    Publish(MapEvent::kGloballyAdjusted, {}, map_id);
    if (!options_.seen_through.enabled) continue;
    // With the next record: frames take their last poses from the map that still has those who stood.
    counters_.landmarks_seen_through += static_cast<uint64_t>(
        RemoveUnproven(map_, map_id, counters_.landmarks_seen_through, options_.seen_through));
  }
  adjusted_ = true;
}

void MapperCore::End(bool as_it_is) {
  if (!as_it_is && !adjusted_) AdjustMaps();
  MapProgress progress = map_.progress();
  progress.ended = true;
  map_.SetProgress(progress);
  Publish(MapEvent::kEnded, {}, 0);
}

// ---- Corrections ----

void MapperCore::OnLoopAnswer(const LoopAnswer& answer) {
  if (answer.kind == LoopAnswer::Kind::kNone) return;
  if (const std::string why = WhyRefused(answer); !why.empty()) {
    ++counters_.corrections_refused;
    Publish(MapEvent::kRefused, answer.keyframe, 0, answer.correction_id, why);
    return;
  }
  Correct(answer);
  ++counters_.corrections_applied;
  MapProgress progress = map_.progress();
  progress.corrected = map_.version() + 1;  // that of the record which says so
  map_.SetProgress(progress);
  const std::optional<Map::ResolvedPose> anchor = map_.ResolvePose(answer.keyframe);
  const bool loop = answer.kind == LoopAnswer::Kind::kLoop;
  Publish(loop ? MapEvent::kCorrected : MapEvent::kGloballyAdjusted, answer.keyframe,
          anchor ? anchor->map_id : 0, answer.correction_id, answer.note);
}

/// Empty: it applies.
std::string MapperCore::WhyRefused(const LoopAnswer& answer) const {
  const bool known = std::any_of(answer.corrections.begin(), answer.corrections.end(),
                                 [&](const auto& c) { return map_.FindKeyframe(c.keyframe) != nullptr; });
  if (!known) return "its keyframes are gone";
  const std::string computed = "computed on version " + std::to_string(answer.base_version);
  if (answer.base_version < map_.progress().corrected) {
    return computed + ", before the correction of version " + std::to_string(map_.progress().corrected);
  }
  if (answer.base_version > map_.version()) {
    return computed + "; the map's is " + std::to_string(map_.version());
  }
  return "";
}

void MapperCore::Correct(const LoopAnswer& answer) {
  std::map<KeyframeId, Sim3d> corrections;
  for (const auto& c : answer.corrections) corrections[c.keyframe] = c.corrected_from_base;
  std::map<LandmarkId, Eigen::Vector3d> offsets;
  for (const auto& o : answer.landmark_offsets) offsets[o.landmark] = o.offset_world;
  const LoopSide side =
      answer.kind == LoopAnswer::Kind::kLoop ? SideOf(answer.keyframe, answer.matched) : LoopSide();

  for (const LandmarkId id : map_.LandmarkIdsSorted()) {
    const Landmark& landmark = *map_.FindLandmark(id);
    const Sim3d* correction = CorrectionOf(map_, landmark.reference, corrections);
    if (correction == nullptr) continue;
    const auto offset = offsets.find(id);
    const Eigen::Vector3d beyond = offset == offsets.end() ? Eigen::Vector3d::Zero() : offset->second;
    map_.SetPosition(id, *correction * landmark.p_world + beyond);
  }
  std::vector<std::pair<KeyframeId, Sim3d>> moved;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    const Sim3d* correction = CorrectionOf(map_, id, corrections);
    if (correction != nullptr) moved.emplace_back(id, *correction);
  }
  for (const auto& [id, correction] : moved) {
    const Sim3d corrected = Sim3d(map_.FindKeyframe(id)->T_cam_world) * correction.Inverse();
    map_.SetPoseAndScale(id, corrected.ToRigid(), correction.scale);
  }
  if (answer.kind == LoopAnswer::Kind::kLoop) Connect(answer, side);
}

/// The keyframe of a loop and its neighbours, where they stand to it: of what lies between them the loop says
/// nothing new, while the corrected poses also share in what the graph has spread.
MapperCore::LoopSide MapperCore::SideOf(KeyframeId keyframe, KeyframeId place) const {
  const std::optional<KeyframeId> here = map_.ResolveKeyframe(keyframe);
  if (!here) return {};
  std::vector<KeyframeId> ids = map_.BestCovisible(*here, kMaxLoopSide, options_.min_covisibility);
  ids.push_back(*here);
  // Who sees the place already is of that side.
  const std::optional<KeyframeId> there = map_.ResolveKeyframe(place);
  if (there) {
    std::erase_if(ids, [&](KeyframeId id) {
      return id == *there || (id != *here && map_.FindKeyframe(*there)->covisible.contains(id));
    });
  }
  const Keyframe& middle = *map_.FindKeyframe(*here);
  LoopSide side;
  for (const KeyframeId id : ids) {
    side[id] = {map_.FindKeyframe(id)->T_cam_world * middle.T_cam_world.Inverse(), middle.scale};
  }
  return side;
}

/// What the two ends of a loop have in common becomes one.
void MapperCore::Connect(const LoopAnswer& answer, const LoopSide& side) {
  const std::optional<KeyframeId> here = map_.ResolveKeyframe(answer.keyframe);
  const std::optional<KeyframeId> there = map_.ResolveKeyframe(answer.matched);
  if (!here || !there || *here == *there) return;
  const MapId from = map_.FindKeyframe(*here)->map_id, into = map_.FindKeyframe(*there)->map_id;
  if (from != into) {
    JoinMaps(from, into);
    Reroot(*here, *there);
  }
  map_.AddLoopEdge(*here, *there);
  std::vector<LandmarkId> place = LandmarksAround(map_, *there, kPlaceNeighbours, options_.min_covisibility);
  for (const auto& fusion : answer.fusions) {
    const auto gone = map_.Resolve(fusion.from), kept = map_.Resolve(fusion.into);
    if (gone && kept && *gone != *kept) map_.Fuse(*gone, *kept);
  }
  // Every keyframe of this side is tied to all that it sees of the place: a few landmarks in a corner of its
  // image would leave it free to turn about them.
  const Keyframe& middle = *map_.FindKeyframe(*here);
  for (const auto& [id, to] : side) {
    for (LandmarkId& landmark : place) landmark = map_.Resolve(landmark).value_or(landmark);
    std::sort(place.begin(), place.end());
    place.erase(std::unique(place.begin(), place.end()), place.end());
    const Rigid3d T_cam_here(to.T_cam_here.rotation, to.T_cam_here.translation * (middle.scale / to.scale));
    counters_.fusions += static_cast<uint64_t>(
        FuseInto(map_, id, T_cam_here * middle.T_cam_world, place, options_.fuse_radius_px, options_));
  }
  counters_.fusions += static_cast<uint64_t>(FuseWithNeighbours(map_, *here, options_));
}

/// Turns the spanning tree of `id` around, so that it hangs from `parent`.
void MapperCore::Reroot(KeyframeId id, KeyframeId parent) {
  while (id.valid()) {
    const KeyframeId next = map_.FindKeyframe(id)->parent;
    map_.SetParent(id, parent);
    parent = id;
    id = next;
  }
}

void MapperCore::JoinMaps(MapId from, MapId into) {
  std::vector<KeyframeId> keyframes;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    if (keyframe.map_id == from) keyframes.push_back(id);
  }
  for (const KeyframeId id : keyframes) map_.SetMapId(id, into);
  for (const LandmarkId id : map_.LandmarkIdsSorted()) {
    if (map_.FindLandmark(id)->map_id == from) map_.SetMapId(id, into);
  }
}

}  // namespace dmslam
