#pragma once

#include <memory>

#include "dmslam/optimization/bundle_solver.h"

namespace dmslam {

/// Ceres' steps, with a Schur complement and a sparse matrix: for many poses. Keeps references to both.
std::unique_ptr<BundleSolver> MakeSparseBundle(const BundleOptions& options, BundleState* state);

}  // namespace dmslam
