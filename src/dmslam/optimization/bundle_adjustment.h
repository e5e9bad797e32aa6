#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

struct BundleObservation {
  int pose = 0;                                     ///< Index into BundleProblem::T_cam_world.
  int point = 0;                                    ///< Index into BundleProblem::points.
  Eigen::Vector2d uv_px = Eigen::Vector2d::Zero();  ///< Undistorted.
  double inv_sigma_squared = 1.0;                   ///< [1 / px^2]
};

/// Poses, points and what the cameras saw. Adjusted in place.
struct BundleProblem {
  Pinhole camera;
  std::vector<Rigid3d> T_cam_world;
  std::vector<char> pose_fixed;  ///< Parallel to the poses, or empty: none is fixed.
  std::vector<Eigen::Vector3d> points;
  std::vector<char> point_fixed;  ///< Parallel to the points, or empty: none is fixed.
  std::vector<BundleObservation> observations;
};

struct BundleOptions {
  /// Steps of the first stage, with Huber's loss, after which outliers are set aside, and of the second, with
  /// Cauchy's. Zero for the second: one stage only, with Huber's loss to the end.
  int first_iterations = 5;
  int second_iterations = 10;
  double max_chi2 =
      kChiSquared2Dof;  ///< Outlier: squared error * inv_sigma_squared above this, or behind the camera.
  double huber_delta = kChi2Dof;  ///< On the error in sigmas.
  /// Width of Cauchy's loss [sigmas]. What is left of somebody who moves slowly, or of a wrong match nearby,
  /// is no outlier, and bends a young map where it is weak: it must not count in full.
  double cauchy_width = 1.0;
  /// A stage ends when a step gains less than this share of the cost (ten times it in the first of two
  /// stages).
  double relative_tolerance = 1e-4;
  /// Asked before every step; true ends the adjustment early, with the best state so far (`interrupted` in
  /// the report). It reads a flag and does nothing else.
  std::function<bool()> interrupt;
};

struct BundleReport {
  bool usable =
      false;  ///< The state in the problem is at least as good as before. If not, the problem is untouched.
  bool interrupted = false;
  double initial_cost = 0.0;  ///< Robust cost (half the sum), over all observations.
  double final_cost = 0.0;    ///< Robust cost after, over all observations.
  int iterations = 0;
  std::vector<char> outliers;  ///< Parallel to the observations, at the final state.
  std::string message;         ///< Why it is not usable.
};

/// Bundle adjustment over poses and points, deterministic (same input, same bytes). Points are eliminated
/// first; up to 60 free poses are solved for with a dense matrix, more with Ceres and a sparse one, on a
/// thread of its own, for whose end the caller waits. A view sees a point once at most. `interrupt` is asked
/// on the thread that works. Without a fixed pose, pose 0 is held. With exactly one pose held the scale is
/// free: poses and points are rescaled about the held camera at the end, so that the farthest camera keeps
/// its distance. Throws InvariantError for indices out of range.
BundleReport AdjustBundle(const BundleOptions& options, BundleProblem& problem);

/// Options for the adjustment of a whole map or of a first one: one robust stage of so many
/// steps.
BundleOptions GlobalBundleOptions(int iterations);

}  // namespace dmslam
