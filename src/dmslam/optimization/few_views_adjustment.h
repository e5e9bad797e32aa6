#pragma once

#include "dmslam/optimization/bundle_adjustment.h"

namespace dmslam {

/// Bundle adjustment of a few views of some hundred points, several times as fast as AdjustBundle and to the
/// same minimum: the search for a first map adjusts many rival motions with every frame. Levenberg and
/// Marquardt's steps, points eliminated first (Schur complement, dense), Huber's loss with the width of
/// `options`, one stage of `first_iterations`; the fields for a second stage and for outliers are not read.
///
/// The first pose is held and no point is; the camera farthest from the first keeps its distance. The fields
/// of `problem` that hold others must be empty or say the same. A view sees a point once at most. What lies
/// behind a camera at the start counts as a constant error. False: there is nothing to adjust or no finite
/// solution, and the problem is as before. Deterministic. Throws InvariantError for indices out of range.
bool AdjustFewViews(const BundleOptions& options, BundleProblem* problem);

}  // namespace dmslam
