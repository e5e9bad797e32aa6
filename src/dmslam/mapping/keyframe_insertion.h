#pragma once

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"

namespace dmslam {

/// A keyframe of what the frontend proposes, at a pose. It is in no map yet.
Keyframe MakeKeyframe(const Map& map, const KeyframeProposal& proposal, const Rigid3d& T_cam_world);

struct InsertionReport {
  const Keyframe* keyframe = nullptr;  ///< in the map; null: it was not inserted
  bool repeated = false;               ///< it was proposed before
  int observations_dropped = 0;        ///< of landmarks that are gone, or of another map
};

/// Inserts a keyframe where its reference puts it, with the landmarks it sees, under the keyframe with which
/// it shares most. Reference and landmarks are resolved through tombstones. A keyframe whose reference is
/// unknown, or of another map, is refused.
InsertionReport InsertKeyframe(MapEditor& map, const KeyframeProposal& proposal);

}  // namespace dmslam
