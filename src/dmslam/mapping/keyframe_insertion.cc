#include "dmslam/mapping/keyframe_insertion.h"

#include <optional>
#include <utility>

namespace dmslam {
namespace {

/// Where the landmark of a match is now; null: it is gone, or is none of this map's.
const Landmark* Usable(const Map& map, const Keyframe& keyframe, const KeyframeProposal::Match& match) {
  const Landmark* landmark = map.Resolve(match.landmark);
  if (landmark == nullptr || match.feature >= keyframe.landmarks.size()) return nullptr;
  return landmark->map_id == keyframe.map_id ? landmark : nullptr;
}

}  // namespace

std::string WhyRefused(KeyframeOutcome outcome) {
  return outcome == KeyframeOutcome::kRefused ? "refused: its reference is unknown, or of another map" : "";
}

Keyframe MakeKeyframe(const Map& map, const KeyframeProposal& proposal, const Rigid3d& T_cam_world) {
  Keyframe keyframe;
  keyframe.id = proposal.id;
  keyframe.map_id = proposal.map_id;
  keyframe.camera_id = proposal.camera_id;
  keyframe.stamp_ns = proposal.stamp_ns;
  keyframe.T_cam_world = T_cam_world;
  keyframe.features = MakeFrameFeatures(proposal.features, map.camera(), map.pyramid());
  return keyframe;
}

InsertionReport InsertKeyframe(MapEditor& map, const KeyframeProposal& proposal) {
  InsertionReport report;
  if (map.HasKnown(proposal.id)) {
    report.outcome = KeyframeOutcome::kRepeated;
    return report;
  }
  if (!proposal.reference) return report;
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(*proposal.reference);
  if (!reference) return report;
  const KeyframeId stands_for_it = reference->keyframe->id;
  // A map that is gone has been joined with another since the frontend heard of it last.
  if (reference->map_id() != proposal.map_id && map.HasMap(proposal.map_id)) return report;
  Keyframe made =
      MakeKeyframe(map, proposal, reference->Compose(proposal.T_cam_reference, proposal.reference_scale));
  made.map_id = reference->map_id();
  made.scale = reference->scale;
  made.parent = stands_for_it;
  const Keyframe& keyframe = map.AddKeyframe(std::move(made));
  for (const KeyframeProposal::Match& match : proposal.matches) {
    if (const Landmark* landmark = Usable(map, keyframe, match)) {
      map.SetObservation(keyframe, match.feature, *landmark);
      map.UpdateDescriptor(*landmark);
    } else {
      ++report.observations_dropped;
    }
  }
  const std::vector<const Keyframe*> nearest = map.BestCovisible(keyframe, 1, 1);
  map.SetParent(keyframe, nearest.empty() ? stands_for_it : nearest.front()->id);
  report.outcome = KeyframeOutcome::kInserted;
  report.keyframe = &keyframe;
  return report;
}

}  // namespace dmslam
