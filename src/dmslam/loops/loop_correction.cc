#include "dmslam/loops/loop_correction.h"

#include <algorithm>
#include <cstdio>
#include <map>
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

/// Poses that the loop asks of the keyframe and its neighbours: S_cam_world (corrected).
using GroupPoses = std::map<KeyframeId, Sim3d>;

GroupPoses PosesOfGroup(const Map& map, const VerifiedLoop& loop, int min_covisibility) {
  const Keyframe& keyframe = *map.FindKeyframe(loop.keyframe);
  GroupPoses poses{{loop.keyframe, loop.S_keyframe_world}};
  for (const auto& [id, shared] : keyframe.covisible) {
    if (shared < min_covisibility) continue;
    const Sim3d S_other_keyframe(map.FindKeyframe(id)->T_cam_world * keyframe.T_cam_world.Inverse());
    poses[id] = S_other_keyframe * loop.S_keyframe_world;
  }
  return poses;
}

/// Landmarks that are the same, and which keyframes of the two sides they tie together.
struct Fusions {
  std::vector<LoopAnswer::LandmarkFusion> pairs;
  std::map<std::pair<KeyframeId, KeyframeId>, int>
      ties;  ///< (of the keyframe's group, of the place's): pairs in common

  void Add(const Map& map, LandmarkId from, LandmarkId into, const GroupPoses& group) {
    if (from == into || !gone_.insert(from).second) return;
    pairs.push_back({from, into});
    for (const Observation& a : map.FindLandmark(from)->observations) {
      if (!group.contains(a.keyframe)) continue;
      for (const Observation& b : map.FindLandmark(into)->observations) {
        if (!group.contains(b.keyframe)) ++ties[{a.keyframe, b.keyframe}];
      }
    }
  }

 private:
  std::set<LandmarkId> gone_;
};

Fusions FindFusions(const Map& map, const VerifiedLoop& loop, const LoopVerifier& verifier,
                    const GroupPoses& group) {
  Fusions fusions;
  const auto add_all = [&](const Keyframe& keyframe, const PlaceSupport& support) {
    for (const LandmarkMatch& match : support.matches) {
      const LandmarkId mine = keyframe.landmarks[match.feature];
      const bool both = mine.valid() && IsStatic(map.FindLandmark(mine)) &&
                        !std::binary_search(loop.landmarks.begin(), loop.landmarks.end(), mine);
      if (both) fusions.Add(map, mine, match.landmark, group);
    }
  };
  const double fuse_radius_px = SearchRadiusPx(map.camera(), kFuseRadiusRad);
  for (const auto& [id, S_cam_world] : group) {
    const Keyframe& keyframe = *map.FindKeyframe(id);
    add_all(keyframe, verifier.Look(map, keyframe, S_cam_world.ToRigid(), loop.landmarks, fuse_radius_px));
  }
  return fusions;
}

/// The graph over one map: nodes in the order of their ids.
class EssentialGraph {
 public:
  EssentialGraph(const Map& map, MapId map_id, const GroupPoses& group) : map_(map), group_(group) {
    for (const auto& [id, keyframe] : map.keyframes()) {
      if (keyframe.map_id != map_id) continue;
      index_[id] = static_cast<int>(ids_.size());
      ids_.push_back(id);
      const auto moved = group.find(id);
      problem_.S_cam_world.push_back(moved == group.end() ? Sim3d(keyframe.T_cam_world) : moved->second);
      problem_.fixed.push_back(0);
    }
  }

  /// Two keyframes as they stand in the map.
  void AddMapEdge(KeyframeId a, KeyframeId b) {
    if (!Contains(a) || !Contains(b) || !listed_.insert(std::minmax(a, b)).second) return;
    AddEdge(a, b, Sim3d(map_.FindKeyframe(a)->T_cam_world), Sim3d(map_.FindKeyframe(b)->T_cam_world));
  }
  /// Two keyframes as the loop puts them: `a` of the keyframe's group, `b` of the place's.
  void AddLoopEdge(KeyframeId a, KeyframeId b) {
    if (!Contains(a) || !Contains(b) || !listed_.insert(std::minmax(a, b)).second) return;
    AddEdge(a, b, group_.at(a), Sim3d(map_.FindKeyframe(b)->T_cam_world));
  }
  void AddMapEdges(const Keyframe& keyframe, int essential_covisibility) {
    if (keyframe.parent) AddMapEdge(keyframe.id, *keyframe.parent);
    for (const KeyframeId other : keyframe.loop_edges) AddMapEdge(keyframe.id, other);
    for (const auto& [other, shared] : keyframe.covisible) {
      if (shared >= essential_covisibility) AddMapEdge(keyframe.id, other);
    }
  }
  void Hold(KeyframeId id) { problem_.fixed[static_cast<size_t>(index_.at(id))] = 1; }

  EssentialGraphReport Optimize(const EssentialGraphOptions& options) {
    return OptimizeEssentialGraph(options, problem_);
  }
  std::vector<LoopAnswer::KeyframeCorrection> Corrections() const {
    std::vector<LoopAnswer::KeyframeCorrection> corrections;
    for (size_t i = 0; i < ids_.size(); ++i) {
      const Sim3d S_base(map_.FindKeyframe(ids_[i])->T_cam_world);
      corrections.push_back({ids_[i], problem_.S_cam_world[i].Inverse() * S_base});
    }
    return corrections;
  }

 private:
  bool Contains(KeyframeId id) const { return index_.contains(id); }
  void AddEdge(KeyframeId a, KeyframeId b, const Sim3d& S_a_world, const Sim3d& S_b_world) {
    EssentialGraphEdge edge;
    edge.i = index_.at(b);
    edge.j = index_.at(a);
    edge.S_j_i = S_a_world * S_b_world.Inverse();
    problem_.edges.push_back(edge);
  }

  const Map& map_;
  const GroupPoses& group_;
  std::map<KeyframeId, int> index_;
  std::vector<KeyframeId> ids_;
  std::set<std::pair<KeyframeId, KeyframeId>> listed_;
  EssentialGraphProblem problem_;
};

/// Everything of the keyframe's map moves as one.
std::vector<LoopAnswer::KeyframeCorrection> CarryMap(const Map& map, const VerifiedLoop& loop) {
  const Keyframe& keyframe = *map.FindKeyframe(loop.keyframe);
  const Sim3d correction = loop.S_keyframe_world.Inverse() * Sim3d(keyframe.T_cam_world);
  std::vector<LoopAnswer::KeyframeCorrection> corrections;
  for (const auto& [id, other] : map.keyframes()) {
    if (other.map_id == keyframe.map_id) corrections.push_back({id, correction});
  }
  return corrections;
}

std::vector<LoopAnswer::KeyframeCorrection> SpreadOverGraph(const Map& map, const VerifiedLoop& loop,
                                                            const GroupPoses& group, const Fusions& fusions,
                                                            const LoopCorrectionOptions& options,
                                                            const std::function<bool()>& interrupt) {
  const MapId map_id = map.FindKeyframe(loop.keyframe)->map_id;
  EssentialGraph graph(map, map_id, group);
  graph.Hold(loop.place);
  graph.AddLoopEdge(loop.keyframe, loop.place);
  for (const auto& [tie, pairs] : fusions.ties) {
    if (pairs >= kMinLoopEdge) graph.AddLoopEdge(tie.first, tie.second);
  }
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id == map_id) graph.AddMapEdges(keyframe, options.essential_covisibility);
  }
  EssentialGraphOptions graph_options;
  graph_options.max_iterations = options.essential_iterations;
  graph_options.interrupt = interrupt;
  if (!graph.Optimize(graph_options).usable) return {};
  return graph.Corrections();
}

/// How much larger the world around a keyframe became: ratio of the median depths.
double Growth(const Map& before, const Map& after, KeyframeId id) {
  const auto depth_before = before.MedianDepth(*before.FindKeyframe(id));
  const auto depth_after = after.MedianDepth(*after.FindKeyframe(id));
  const bool usable = depth_before && depth_after && *depth_before > 0 && *depth_after > 0;
  return usable ? *depth_after / *depth_before : 1.0;
}

std::string NoteOf(const Map& map, const VerifiedLoop& loop) {
  const Keyframe& keyframe = *map.FindKeyframe(loop.keyframe);
  const Eigen::Vector3d moved =
      loop.S_keyframe_world.Inverse() * Eigen::Vector3d::Zero() - keyframe.T_cam_world.Center();
  char text[320];
  std::snprintf(
      text, sizeof(text),
      "frame %u sees the place of frame %u again: %d of %d landmarks in %d cells, share %.2f; %d of "
      "them proven, share %.2f; it moves by %.3f (%.1f sigma) and scales by %.4f",
      loop.keyframe.frame_index(), loop.place.frame_index(), loop.support.found, loop.support.expected,
      loop.support.cells, loop.share, loop.proven.found, loop.proven_share, moved.norm(),
      loop.drift_sigmas.value_or(0.0), 1.0 / loop.S_keyframe_world.scale);
  if (!loop.joins) return text;
  return text + ("; map " + std::to_string(keyframe.map_id)) + " becomes part of map " +
         std::to_string(map.FindKeyframe(loop.place)->map_id);
}

}  // namespace

LoopAnswer CorrectLoop(const Map& map, const VerifiedLoop& loop, const LoopVerifier& verifier,
                       const LoopcloserOptions& options, const std::function<bool()>& interrupt) {
  const GroupPoses group = PosesOfGroup(map, loop, options.min_covisibility);
  Fusions fusions = FindFusions(map, loop, verifier, group);
  const bool one_map = map.FindKeyframe(loop.keyframe)->map_id == map.FindKeyframe(loop.place)->map_id;
  LoopAnswer answer;
  answer.corrections = one_map ? SpreadOverGraph(map, loop, group, fusions, options.correction, interrupt)
                               : CarryMap(map, loop);
  if (answer.corrections.empty()) return {};
  answer.kind = LoopAnswer::Kind::kLoop;
  answer.seen_from = loop.keyframe;
  answer.matched = loop.place;
  answer.correction_id = loop.keyframe.value;
  answer.fusions = std::move(fusions.pairs);
  answer.note = NoteOf(map, loop);
  return answer;
}

LoopAnswer AdjustGlobally(const Map& map, KeyframeId keyframe, const LoopCorrectionOptions& options,
                          const std::function<bool()>& interrupt) {
  const MapId map_id = map.FindKeyframe(keyframe)->map_id;
  MapEditor adjusted(map);
  const MapAdjustmentReport report =
      AdjustWholeMap(adjusted, map_id, options.global_iterations, options.keypoint_sigma_px, interrupt);
  LoopAnswer answer;
  if (!report.bundle.usable) return answer;
  std::map<KeyframeId, Sim3d> corrected_from_base;
  for (const auto& [id, after] : adjusted.keyframes()) {
    if (after.map_id != map_id) continue;
    const double growth = Growth(map, adjusted, id);
    const Sim3d S_cam_world(after.T_cam_world.rotation, after.T_cam_world.translation / growth, 1.0 / growth);
    const Sim3d correction = S_cam_world.Inverse() * Sim3d(map.FindKeyframe(id)->T_cam_world);
    corrected_from_base[id] = correction;
    answer.corrections.push_back({id, correction});
  }
  for (const LandmarkId id : adjusted.LandmarkIdsSorted()) {
    const Landmark& after = *adjusted.FindLandmark(id);
    const auto reference = corrected_from_base.find(after.reference);
    if (after.map_id != map_id || reference == corrected_from_base.end()) continue;
    const Eigen::Vector3d carried = reference->second * map.FindLandmark(id)->p_world;
    answer.landmark_offsets.push_back({id, after.p_world - carried});
  }
  answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
  answer.correction_id = keyframe.value;
  char text[120];
  std::snprintf(text, sizeof(text), "%d keyframes, %d landmarks, cost %.6g to %.6g", report.keyframes,
                report.landmarks, report.bundle.initial_cost, report.bundle.final_cost);
  answer.note = text;
  return answer;
}

}  // namespace dmslam
