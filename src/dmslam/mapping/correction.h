#pragma once

#include <string>

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/mapping/landmark_fusion.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// Why a correction does not apply to the map of now; empty: it does. It does not where its keyframes are
/// gone, where another correction was applied since its base (two loop closers, one after the other, may have
/// found the same loop), or where its base is not a version of this map.
std::string WhyRefused(const Map& map, const LoopAnswer& answer);

/// Composes the corrections with the poses of now. Keyframes without one of their own follow their nearest
/// ancestor that has one, landmarks their reference keyframe. A loop then joins what its two ends have in
/// common, and their maps where they are two. Returns what was fused.
FusionCounts ApplyCorrection(MapEditor& map, const LoopAnswer& answer, const MapperOptions& options);

/// The map of keyframe `end` becomes part of that of keyframe `place`, and its spanning tree hangs from
/// `place` at `end`.
void JoinMaps(MapEditor& map, const Keyframe& end, const Keyframe& place);

}  // namespace dmslam
