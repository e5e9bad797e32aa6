#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {

/// Two images of a plane fit two motions of the camera (Longuet-Higgins, "The reconstruction of a plane
/// surface from two perspective projections", 1986), and a search for minima of the epipolar cost may find
/// the wrong one alone. The motions T_1_0, |t| = 1, under which the matches flagged lie on a plane before the
/// first camera: none, where no plane has most of them, or two at most.
std::vector<Rigid3d> PlaneMotions(const MatchArrays& arrays, std::span<const uint8_t> use);

}  // namespace dmslam
