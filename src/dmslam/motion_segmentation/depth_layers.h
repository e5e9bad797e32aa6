#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/motion_segmentation/match.h"
#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {

/// What moves along its epipolar lines satisfies the camera's epipolar geometry, but seldom has a disparity
/// that belongs to the static scene. Disparities under one model fall into layers; a scene makes one broad
/// layer, a mover another.
struct LayerOptions {
  bool enabled = true;
  double bin_rad = 0.0038;    ///< bins of the histogram of disparities
  double gap_rad = 0.0152;    ///< layers are apart by at least this much of (nearly) no disparity
  double noise_share = 0.02;  ///< bins with less than this share of the fullest count as empty
};

/// Disparity of match i under an essential model: how far along its epipolar line the point in image 1 is
/// from where the rotation alone puts it [normalised units]; positive towards where a point at finite depth
/// goes.
double Disparity(const TwoViewModel& model, const MatchArrays& arrays, size_t i);

/// Of the matches flagged keeps the layer that is spread widest over the image (D, paper Eq. 3, times its
/// share of the matches); unsets the flags of others. `positions_px` is parallel to the arrays. Returns how
/// many flags remain.
int KeepWidestLayer(const LayerOptions& options, const TwoViewModel& model, const MatchArrays& arrays,
                    std::span<const Eigen::Vector2d> positions_px, std::span<uint8_t> flags);

}  // namespace dmslam
