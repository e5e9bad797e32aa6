#pragma once

#include <memory>

#include "dmslam/optimization/bundle_solver.h"

namespace dmslam {

/// Levenberg and Marquardt's steps for problems with few poses: points are eliminated first (Schur
/// complement), and the poses' equations solved as a dense matrix. To the same minimum as Ceres and three
/// times as fast, which the search for a first map needs: it adjusts some motions with every frame. A view
/// sees a point once at most. Deterministic. Keeps references to both.
std::unique_ptr<BundleSolver> MakeDenseBundle(const BundleOptions& options, BundleState* state);

}  // namespace dmslam
