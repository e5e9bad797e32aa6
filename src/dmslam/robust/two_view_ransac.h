#pragma once

#include <Eigen/Core>
#include <span>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/robust/ransac.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

struct TwoViewRansacOptions {
  RansacOptions ransac;
  double max_error_squared_px = kChiSquared1Dof;  ///< Sampson's, times sigma squared where given.
};

/// Robust essential matrix over matches in undistorted pixels (x1[i] with x2[i]). `sigma_squared` is parallel
/// to the matches (variance of the match relative to one pixel), or empty: all 1.
/// The model is the essential matrix; the error is Sampson's in pixels.
RansacReport<Eigen::Matrix3d> EssentialFromMatches(const Pinhole& camera,
                                                   std::span<const Eigen::Vector2d> x1_px,
                                                   std::span<const Eigen::Vector2d> x2_px,
                                                   std::span<const double> sigma_squared,
                                                   const TwoViewRansacOptions& options);

}  // namespace dmslam
