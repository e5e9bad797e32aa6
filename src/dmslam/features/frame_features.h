#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory_resource>
#include <vector>

#include "dmslam/features/feature_grid.h"
#include "dmslam/features/types.h"

namespace dmslam {

/// What a camera saw in one frame, and where on the ideal image plane. Made once, never changed, shared by
/// all who hold the frame or the keyframe made of it.
struct FrameFeatures {
  FeatureSet set;
  std::pmr::vector<Eigen::Vector2d> uv_px;  ///< undistorted pixel of each keypoint
  std::pmr::vector<float> sigmas_px;        ///< of these pixels; empty: Pyramid::Sigma says them
  FeatureGrid grid;                         ///< finds features near an undistorted pixel

  size_t size() const { return set.size(); }
  /// Variance of an undistorted pixel, in x and in y.
  template <typename AnyPyramid>
  double Variance(size_t feature, const AnyPyramid& pyramid) const {
    if (sigmas_px.empty()) return pyramid.SigmaSquared(set.keypoints[feature].octave);
    return static_cast<double>(sigmas_px[feature]) * static_cast<double>(sigmas_px[feature]);
  }
};

/// What its lists take in memory together, with what their beginnings must be aligned to.
size_t BytesOf(const FrameFeatures& features);
/// The same features with lists in other memory, which must outlive them.
FrameFeatures CopyInto(std::pmr::memory_resource* memory, const FrameFeatures& features);

}  // namespace dmslam
