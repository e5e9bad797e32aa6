#include "dmslam/slam/map_merge.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "dmslam/loops/loopcloser_core.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/mapping/correction.h"
#include "dmslam/mapping/landmark_fusion.h"
#include "dmslam/optimization/map_adjustment.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

std::vector<KeyframeId> IdsOf(const Map& map) {
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : map.keyframes()) ids.push_back(id);
  return ids;
}

/// The map that holds most keyframes of `ids`.
MapId LargestOf(const Map& map, const std::vector<KeyframeId>& ids) {
  std::map<MapId, size_t> sizes;
  for (const KeyframeId id : ids) ++sizes[map.At(id).map_id];
  return std::ranges::max_element(sizes, {}, [](const auto& item) { return item.second; })->first;
}

std::set<MapId> MapsOf(const Map& map, const std::vector<KeyframeId>& ids) {
  std::set<MapId> maps;
  for (const KeyframeId id : ids) maps.insert(map.At(id).map_id);
  return maps;
}

/// Maps that hold keyframes of both.
std::set<MapId> Shared(const Map& map, const std::vector<KeyframeId>& a, const std::vector<KeyframeId>& b) {
  const std::set<MapId> of_a = MapsOf(map, a), of_b = MapsOf(map, b);
  std::set<MapId> shared;
  std::ranges::set_intersection(of_a, of_b, std::inserter(shared, shared.begin()));
  return shared;
}

LoopcloserOptions BetweenMaps(LoopcloserOptions options) {
  options.enabled = true;
  options.within_maps = false;
  options.asked_again = 0;  // each is asked here
  return options;
}

}  // namespace

MapMerge::MapMerge(const Map& a, const Map& b, const Renumbering& names_of_b, const MapMergeOptions& options)
    : options_(options), map_(Beside(a, b, names_of_b)), of_a_(IdsOf(a)) {
  DMSLAM_CHECK(!of_a_.empty() && !b.keyframes().empty(), "an empty map is joined with nothing");
  DMSLAM_CHECK(map_.keyframes().size() == of_a_.size() + b.keyframes().size(), "keyframes of one name");
  for (const KeyframeId id : IdsOf(map_)) {
    if (a.FindKeyframe(id) == nullptr) of_b_.push_back(id);
  }
  const Keyframe& first = *map_.KeyframesOf(LargestOf(map_, of_a_)).front();
  anchor_ = {first.id, first.T_cam_world, first.scale};
}

MapMergeReport MapMerge::Run(std::shared_ptr<const Vocabulary> vocabulary, const Progress& progress) {
  DMSLAM_CHECK(vocabulary != nullptr, "places are recognised by words");
  Weld(std::move(vocabulary), progress);
  const std::set<MapId> shared = Shared(map_, of_a_, of_b_);
  report_.joined = !shared.empty();
  for (const MapId map_id : shared) {
    const auto adjust = [&] {
      if (progress) progress("adjusting", 0, map_.KeyframesOf(map_id).size());
      AdjustWholeMap(map_, map_id, options_.mapper.final_adjustment_iterations,
                     options_.mapper.keypoint_sigma_px, {});
    };
    adjust();
    FuseAll(map_id, progress);
    adjust();
  }
  if (shared.contains(map_.At(anchor_.id).map_id)) PutBack();
  return report_;
}

/// Asks the keyframes of both, until all is one map.
void MapMerge::Weld(std::shared_ptr<const Vocabulary> vocabulary, const Progress& progress) {
  LoopcloserCore closer(BetweenMaps(options_.loop), map_.camera(), map_.pyramid(), options_.seed,
                        std::move(vocabulary));
  // In one piece: what a keyframe sees is then known when its words are counted.
  for (const MapDelta& delta : CutSnapshot(map_, std::nullopt, SIZE_MAX / 2)) closer.ApplyMapDelta(delta);
  std::vector<KeyframeId> order = of_b_;
  order.insert(order.end(), of_a_.begin(), of_a_.end());
  for (const KeyframeId id : order) {
    if (dmslam::MapsOf(map_).size() == 1) return;
    if (progress) progress("looking for places", report_.keyframes_asked, order.size());
    ++report_.keyframes_asked;
    const LoopAnswer answer = closer.Check(id);
    for (const LoopcloserCore::Verdict& verdict : closer.verdicts()) {
      report_.places_tried += verdict.confirms ? 0 : 1;
      report_.places_proposed += !verdict.confirms && verdict.accepted ? 1 : 0;
    }
    if (answer.kind == LoopAnswer::Kind::kNone) continue;
    const std::string why_refused = WhyRefused(map_, answer);
    DMSLAM_CHECK(why_refused.empty(), why_refused.c_str());
    ApplyCorrection(map_, answer, options_.mapper);
    if (answer.kind == LoopAnswer::Kind::kLoop)
      report_.welds.push_back({EndOf(answer.seen_from.value()), EndOf(answer.matched.value()), answer.note});
    MapDelta delta = map_.TakeDelta(MapEvent::kCorrected, id, map_.At(id).map_id);
    delta.correction_id = answer.correction_id;
    closer.ApplyMapDelta(delta);
  }
}

MapMergeReport::Weld::End MapMerge::EndOf(KeyframeId id) const {
  return {id.frame_index(), std::ranges::binary_search(of_b_, id)};
}

/// A weld joins what is around it. Elsewhere keyframes of the two look at the same as well.
void MapMerge::FuseAll(MapId map_id, const Progress& progress) {
  size_t done = 0;
  for (const KeyframeId id : of_b_) {
    if (progress) progress("fusing", done++, of_b_.size());
    if (const Keyframe& keyframe = map_.At(id); keyframe.map_id == map_id)
      report_.fused += FuseWithNeighbours(map_, keyframe, options_.mapper);
  }
}

/// The joined map lies where `a` did.
void MapMerge::PutBack() {
  const Keyframe& anchor = map_.At(anchor_.id);
  const MapId map_id = anchor.map_id;
  const double back = anchor_.scale / anchor.scale;
  const Sim3d scaled(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), back);
  const Sim3d then_from_now = Sim3d(anchor_.T_cam_world).Inverse() * scaled * Sim3d(anchor.T_cam_world);
  for (const Keyframe* keyframe : map_.KeyframesOf(map_id)) {
    const Sim3d S_cam_world = Sim3d(keyframe->T_cam_world) * then_from_now.Inverse();
    map_.SetPoseAndScale(*keyframe, S_cam_world.ToRigid(), back);
  }
  for (const Landmark* landmark : map_.LandmarksOf(map_id))
    map_.SetPosition(*landmark, then_from_now * landmark->p_world);
}

}  // namespace dmslam
