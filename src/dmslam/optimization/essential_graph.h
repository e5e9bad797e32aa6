#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"

namespace dmslam {

/// A measured relative similarity: S_j_i = S_j_world * S_i_world^-1.
struct EssentialGraphEdge {
  int i = 0;
  int j = 0;
  Sim3d S_j_i;
  double weight = 1.0;  ///< Multiplies the squared error.
};

/// Keyframes as similarities S_cam_world and the edges between them. Adjusted in place.
struct EssentialGraphProblem {
  std::vector<Sim3d> S_cam_world;
  std::vector<char>
      fixed;  ///< Parallel to the nodes; at least one must be fixed (node 0 is taken if none is).
  std::vector<EssentialGraphEdge> edges;
};

struct EssentialGraphOptions {
  int max_iterations = 20;
  double relative_tolerance = 1e-6;  ///< Ends when a step gains less than this share of the cost.
  bool fix_scale = false;
  std::function<bool()> interrupt;  ///< Asked before every step; true ends early.
};

struct EssentialGraphReport {
  bool usable = false;  ///< If not, the problem is untouched.
  bool interrupted = false;
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;
  std::string message;
};

/// Pose graph over Sim(3): minimises sum weight * |Log(S_j_i * S_i * S_j^-1)|^2 (Strasdat, Montiel, Davison,
/// "Scale drift-aware large scale monocular SLAM", RSS 2010). One thread, deterministic.
EssentialGraphReport OptimizeEssentialGraph(const EssentialGraphOptions& options,
                                            EssentialGraphProblem& problem);

/// Residual of one edge and its Jacobians with respect to left steps Exp(d) * S of the two nodes (null to
/// skip).
Vector7d EssentialGraphResidual(const Sim3d& S_j_i, const Sim3d& S_i_world, const Sim3d& S_j_world,
                                Matrix7d* jacobian_i, Matrix7d* jacobian_j);

}  // namespace dmslam
