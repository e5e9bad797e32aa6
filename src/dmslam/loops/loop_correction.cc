#include "dmslam/loops/loop_correction.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "dmslam/camera/image_scale.h"
#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/optimization/essential_graph.h"
#include "dmslam/optimization/map_adjustment.h"

namespace dmslam {
namespace {

constexpr double kFuseRadiusRad = 0.0075;  // times the scale of the predicted octave
constexpr int kMinLoopEdge = 20;           // pairs of fused landmarks that make an edge between two keyframes
constexpr double kMostGrowth = 2;          // of what a keyframe sees, by one adjustment

/// A keyframe and where the loop wants it: S_cam_world (corrected).
struct Carried {
  const Keyframe* keyframe;
  Sim3d S_cam_world;
};
/// The keyframe that sees the place, and its neighbours.
using CarriedGroup = std::map<KeyframeId, Carried>;

CarriedGroup CarryGroup(const Map& map, const VerifiedLoop& loop, int min_covisibility) {
  const Keyframe& keyframe = *loop.keyframe;
  CarriedGroup group{{keyframe.id, {&keyframe, loop.S_keyframe_world}}};
  for (const auto& [id, shared] : keyframe.covisible) {
    if (shared < min_covisibility) continue;
    const Keyframe& other = map.At(id);
    const Sim3d S_other_keyframe(other.T_cam_world * keyframe.T_cam_world.Inverse());
    group[id] = {&other, S_other_keyframe * loop.S_keyframe_world};
  }
  return group;
}

/// Landmarks that are the same, and which keyframes of the two sides they tie together.
struct Fusions {
  std::vector<LoopAnswer::LandmarkFusion> pairs;
  std::map<std::pair<KeyframeId, KeyframeId>, int>
      ties;  ///< (of the keyframe's group, of the place's): pairs in common

  void Add(const Landmark& from, const Landmark& into, const CarriedGroup& group) {
    if (from.id == into.id || !gone_.insert(from.id).second) return;
    pairs.push_back({from.id, into.id});
    for (const Observation& a : from.observations) {
      if (!group.contains(a.keyframe)) continue;
      for (const Observation& b : into.observations) {
        if (!group.contains(b.keyframe)) ++ties[{a.keyframe, b.keyframe}];
      }
    }
  }

 private:
  std::set<LandmarkId> gone_;
};

Fusions FindFusions(const Map& map, const VerifiedLoop& loop, const LoopVerifier& verifier,
                    const CarriedGroup& group) {
  Fusions fusions;
  const double fuse_radius_px = SearchRadiusPx(map.camera(), kFuseRadiusRad);
  for (const auto& [id, carried] : group) {
    const SeenPlace seen =
        verifier.Look(map, *carried.keyframe, carried.S_cam_world.ToRigid(), loop.landmarks, fuse_radius_px);
    for (const LandmarkMatch& match : seen.matches) {
      const Landmark* mine = map.LandmarkSeenBy(*carried.keyframe, match.feature);
      if (IsStatic(mine) && !std::ranges::binary_search(loop.landmarks, mine->id, {}, &Landmark::id))
        fusions.Add(*mine, *match.landmark, group);
    }
  }
  return fusions;
}

/// The graph over keyframes of one map: nodes in their order.
class EssentialGraph {
 public:
  EssentialGraph(const std::vector<const Keyframe*>& keyframes, const CarriedGroup& group) {
    for (const Keyframe* keyframe : keyframes) {
      index_[keyframe->id] = S_base_.size();
      S_base_.emplace_back(keyframe->T_cam_world);
      const auto moved = group.find(keyframe->id);
      problem_.S_cam_world.push_back(moved == group.end() ? S_base_.back() : moved->second.S_cam_world);
      problem_.fixed.push_back(0);
    }
  }

  /// Two keyframes as they stand in the map.
  void AddMapEdge(KeyframeId a, KeyframeId b) { AddEdge(a, b, S_base_); }
  /// Two keyframes as the loop puts them: `a` of the keyframe's group, `b` of the place's.
  void AddLoopEdge(KeyframeId a, KeyframeId b) { AddEdge(a, b, problem_.S_cam_world); }
  void AddMapEdges(const Keyframe& keyframe, int essential_covisibility) {
    if (keyframe.parent) AddMapEdge(keyframe.id, *keyframe.parent);
    for (const KeyframeId other : keyframe.loop_edges) AddMapEdge(keyframe.id, other);
    for (const auto& [other, shared] : keyframe.covisible) {
      if (shared >= essential_covisibility) AddMapEdge(keyframe.id, other);
    }
  }
  void Hold(KeyframeId id) { problem_.fixed[index_.at(id)] = 1; }

  EssentialGraphReport Optimize(const EssentialGraphOptions& options) {
    return OptimizeEssentialGraph(options, problem_);
  }
  std::vector<LoopAnswer::KeyframeCorrection> Corrections() const {
    std::vector<LoopAnswer::KeyframeCorrection> corrections;
    for (const auto& [id, i] : index_)
      corrections.push_back({id, problem_.S_cam_world[i].Inverse() * S_base_[i]});
    return corrections;
  }

 private:
  void AddEdge(KeyframeId a, KeyframeId b, const std::vector<Sim3d>& S_a_world) {
    const auto at_a = index_.find(a), at_b = index_.find(b);
    if (at_a == index_.end() || at_b == index_.end() || !listed_.insert(std::minmax(a, b)).second) return;
    EssentialGraphEdge edge;
    edge.i = static_cast<int>(at_b->second);
    edge.j = static_cast<int>(at_a->second);
    edge.S_j_i = S_a_world[at_a->second] * S_base_[at_b->second].Inverse();
    problem_.edges.push_back(edge);
  }

  std::map<KeyframeId, size_t> index_;
  std::vector<Sim3d> S_base_;  ///< as the keyframes stand in the map
  std::set<std::pair<KeyframeId, KeyframeId>> listed_;
  EssentialGraphProblem problem_;
};

/// Everything of the keyframe's map moves as one.
std::vector<LoopAnswer::KeyframeCorrection> CarryMap(const Map& map, const VerifiedLoop& loop) {
  const Sim3d correction = loop.S_keyframe_world.Inverse() * Sim3d(loop.keyframe->T_cam_world);
  std::vector<LoopAnswer::KeyframeCorrection> corrections;
  for (const Keyframe* keyframe : map.KeyframesOf(loop.keyframe->map_id))
    corrections.push_back({keyframe->id, correction});
  return corrections;
}

std::vector<LoopAnswer::KeyframeCorrection> SpreadOverGraph(const Map& map, const VerifiedLoop& loop,
                                                            const CarriedGroup& group, const Fusions& fusions,
                                                            const LoopCorrectionOptions& options,
                                                            const std::function<bool()>& interrupt) {
  const std::vector<const Keyframe*> keyframes = map.KeyframesOf(loop.keyframe->map_id);
  EssentialGraph graph(keyframes, group);
  graph.Hold(loop.place->id);
  graph.AddLoopEdge(loop.keyframe->id, loop.place->id);
  for (const auto& [tie, pairs] : fusions.ties) {
    if (pairs >= kMinLoopEdge) graph.AddLoopEdge(tie.first, tie.second);
  }
  for (const Keyframe* keyframe : keyframes) graph.AddMapEdges(*keyframe, options.essential_covisibility);
  EssentialGraphOptions graph_options;
  graph_options.max_iterations = options.essential_iterations;
  graph_options.interrupt = interrupt;
  if (!graph.Optimize(graph_options).usable) return {};
  return graph.Corrections();
}

/// How much larger the world around a keyframe became: ratio of its median depths. Where half of what it sees
/// is at infinity, a median jumps there or back; what is beyond the bounds the landmarks' offsets say.
double Growth(std::optional<double> depth_before, std::optional<double> depth_after) {
  const bool usable = depth_before && depth_after && *depth_before > 0 && *depth_after > 0;
  return usable ? std::clamp(*depth_after / *depth_before, 1.0 / kMostGrowth, kMostGrowth) : 1.0;
}

std::string NoteOf(const VerifiedLoop& loop) {
  const Keyframe &keyframe = *loop.keyframe, &place = *loop.place;
  const Eigen::Vector3d moved =
      loop.S_keyframe_world.Inverse() * Eigen::Vector3d::Zero() - keyframe.T_cam_world.Center();
  char text[320];
  std::snprintf(
      text, sizeof(text),
      "frame %u sees the place of frame %u again: %d of %d landmarks in %d cells, share %.2f; %d of "
      "them proven, share %.2f; it moves by %.3f (%.1f sigma) and scales by %.4f",
      keyframe.id.frame_index(), place.id.frame_index(), loop.support.found, loop.support.expected,
      loop.support.cells, loop.share, loop.proven.found, loop.proven_share, moved.norm(),
      loop.drift_sigmas.value_or(0.0), 1.0 / loop.S_keyframe_world.scale);
  if (!loop.joins) return text;
  return text + ("; map " + std::to_string(keyframe.map_id)) + " becomes part of map " +
         std::to_string(place.map_id);
}

}  // namespace

LoopAnswer CorrectLoop(const Map& map, const VerifiedLoop& loop, const LoopVerifier& verifier,
                       const LoopcloserOptions& options, const std::function<bool()>& interrupt) {
  const CarriedGroup group = CarryGroup(map, loop, options.min_covisibility);
  Fusions fusions = FindFusions(map, loop, verifier, group);
  const bool one_map = loop.keyframe->map_id == loop.place->map_id;
  LoopAnswer answer;
  answer.corrections = one_map ? SpreadOverGraph(map, loop, group, fusions, options.correction, interrupt)
                               : CarryMap(map, loop);
  if (answer.corrections.empty()) return {};
  answer.kind = LoopAnswer::Kind::kLoop;
  answer.seen_from = loop.keyframe->id;
  answer.matched = loop.place->id;
  answer.correction_id = loop.keyframe->id.value;
  answer.fusions = std::move(fusions.pairs);
  answer.note = NoteOf(loop);
  return answer;
}

LoopAnswer AdjustGlobally(const Map& map, MapId map_id, uint64_t correction_id,
                          const LoopCorrectionOptions& options, const std::function<bool()>& interrupt) {
  MapEditor adjusted(map);
  const MapAdjustmentReport report =
      AdjustWholeMap(adjusted, map_id, options.global_iterations, options.keypoint_sigma_px, interrupt);
  LoopAnswer answer;
  if (!report.bundle.usable) return answer;
  std::map<KeyframeId, Sim3d> corrected_from_base;
  for (const Keyframe* before : map.KeyframesOf(map_id)) {
    const Keyframe& after = adjusted.At(before->id);
    const double growth = Growth(map.MedianDepth(*before), adjusted.MedianDepth(after));
    const Sim3d S_cam_world(after.T_cam_world.rotation, after.T_cam_world.translation / growth, 1.0 / growth);
    const Sim3d correction = S_cam_world.Inverse() * Sim3d(before->T_cam_world);
    corrected_from_base[before->id] = correction;
    answer.corrections.push_back({before->id, correction});
  }
  for (const Landmark* before : map.LandmarksOf(map_id)) {
    const Landmark* after = adjusted.FindLandmark(before->id);
    const Keyframe* at = map.Resolve(before->reference);
    const auto reference = at != nullptr ? corrected_from_base.find(at->id) : corrected_from_base.end();
    if (after == nullptr || reference == corrected_from_base.end()) continue;
    answer.landmark_offsets.push_back({before->id, after->p_world - reference->second * before->p_world});
  }
  answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
  answer.correction_id = correction_id;
  char text[120];
  std::snprintf(text, sizeof(text), "%d keyframes, %d landmarks, cost %.6g to %.6g", report.keyframes,
                report.landmarks, report.bundle.initial_cost, report.bundle.final_cost);
  answer.note = text;
  return answer;
}

}  // namespace dmslam
