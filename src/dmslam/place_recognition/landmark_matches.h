#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/robust/pose_from_matches.h"

namespace dmslam {

/// A feature of an image shows a landmark. Valid as long as the landmark is in its map.
struct LandmarkMatch {
  uint16_t feature = 0;
  const Landmark* landmark = nullptr;
};

/// Landmarks with the features of an image by descriptor alone, wherever they are; in the landmarks' order.
std::vector<LandmarkMatch> MatchLandmarks(const std::vector<const Landmark*>& landmarks,
                                          const FeatureSet& features);

/// T_cam_world of the image on which most matches agree; `inliers` of the report is parallel to them.
RansacReport<Rigid3d> PoseFromLandmarks(const Map& map, const FrameFeatures& features,
                                        const std::vector<LandmarkMatch>& matches,
                                        const PoseRansacOptions& options);

}  // namespace dmslam
