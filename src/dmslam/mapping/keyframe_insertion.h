#pragma once

#include <cstdint>
#include <string>

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"

namespace dmslam {

/// A keyframe of what the frontend proposes, at a pose. It is in no map yet.
Keyframe MakeKeyframe(const Map& map, const KeyframeProposal& proposal, const Rigid3d& T_cam_world);

/// What a proposed keyframe came to.
enum class KeyframeOutcome : uint8_t {
  kInserted,  ///< it is in the map
  kRepeated,  ///< it was proposed before: nothing is left to do
  kRefused,   ///< its reference is unknown, or of another map
};

/// For the record that answers the keyframe; empty: it was not refused.
std::string WhyRefused(KeyframeOutcome outcome);

struct InsertionReport {
  KeyframeOutcome outcome = KeyframeOutcome::kRefused;
  const Keyframe* keyframe = nullptr;  ///< in the map, exactly when it was inserted
  int observations_dropped = 0;        ///< of landmarks that are gone, or of another map
};

/// Inserts a keyframe where its reference puts it, with the landmarks it sees, under the keyframe with which
/// it shares most. Reference and landmarks are resolved through tombstones. A keyframe whose reference is
/// unknown, or of another map, is refused.
InsertionReport InsertKeyframe(MapEditor& map, const KeyframeProposal& proposal);

}  // namespace dmslam
