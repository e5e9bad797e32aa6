#include "dmslam/optimization/bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <memory>
#include <utility>

#include "dmslam/optimization/dense_bundle.h"
#include "dmslam/optimization/sparse_bundle.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int kMaxPosesDense = 60;  ///< Above, the reduced camera system is factorised as a sparse matrix.

/// [units of the problem; a map's first keyframe sees at a depth of about 1]
constexpr double kAtInfinity = 1e9;

void CheckIndices(const BundleProblem& problem) {
  DMSLAM_CHECK(problem.pose_fixed.empty() || problem.pose_fixed.size() == problem.T_cam_world.size(),
               "one fixed flag per pose");
  DMSLAM_CHECK(problem.point_fixed.empty() || problem.point_fixed.size() == problem.points.size(),
               "one fixed flag per point");
  for (const BundleObservation& o : problem.observations) {
    DMSLAM_CHECK(o.pose >= 0 && At(o.pose) < problem.T_cam_world.size(), "observation names a pose");
    DMSLAM_CHECK(o.point >= 0 && At(o.point) < problem.points.size(), "observation names a point");
  }
}

/// Without a fixed pose, pose 0 is held.
std::vector<char> HeldPoses(const BundleProblem& problem) {
  std::vector<char> held = problem.pose_fixed;
  held.resize(problem.T_cam_world.size(), 0);
  if (!held.empty() && std::ranges::count(held, 0) == static_cast<ptrdiff_t>(held.size())) held.front() = 1;
  return held;
}

int NumFree(const std::vector<char>& held) { return static_cast<int>(std::ranges::count(held, 0)); }

class Adjustment {
 public:
  Adjustment(const BundleOptions& options, BundleProblem& problem)
      : options_(options),
        state_{problem, problem.T_cam_world, HeldPoses(problem),
               std::vector<char>(problem.observations.size(), 1)} {}

  BundleReport Run() {
    BundleReport report;
    const std::vector<Eigen::Vector3d> points_before = problem().points;
    report.initial_cost = RobustCost();
    SetAsideBehind();
    const std::unique_ptr<BundleSolver> solver = MakeSolver();
    if (solver->NumTerms() == 0) {
      report.message = "nothing to adjust";
    } else {
      report.usable = SolveStages(solver.get(), &report) && AllFinite();
    }
    if (!report.usable) {
      problem().points = points_before;
      state_.poses = problem().T_cam_world;
    }
    report.final_cost = RobustCost();
    FlagOutliers(&report);
    if (!report.usable) return report;
    const std::vector<Rigid3d> poses_before = std::exchange(problem().T_cam_world, state_.poses);
    KeepScale(poses_before);
    HoldAtInfinity();
    return report;
  }

 private:
  BundleProblem& problem() const { return state_.problem; }

  std::unique_ptr<BundleSolver> MakeSolver() {
    if (NumFree(state_.pose_held) <= kMaxPosesDense) return MakeDenseBundle(options_, &state_);
    return MakeSparseBundle(options_, &state_);
  }

  bool SolveStages(BundleSolver* solver, BundleReport* report) {
    const bool two_stages = options_.second_iterations > 0;
    const double tolerance = options_.relative_tolerance;
    const auto solve = [&](const BundleStage& stage) {
      const BundleStageResult result = solver->Solve(stage);
      report->iterations += result.iterations;
      report->interrupted = result.interrupted;
      report->message = result.message;
      return result.sound;
    };
    // The first of two stages only has to tell the outliers.
    const double first_tolerance = two_stages ? 10.0 * tolerance : tolerance;
    if (!solve({false, options_.first_iterations, first_tolerance})) return false;
    if (report->interrupted || !two_stages) return true;
    SetAsideOutliers(solver);
    return solve({true, options_.second_iterations, tolerance});
  }

  Eigen::Vector3d InCamera(const BundleObservation& o) const {
    return state_.poses[At(o.pose)] * problem().points[At(o.point)];
  }

  double Chi2(const BundleObservation& o) const {
    const Eigen::Vector3d p = InCamera(o);
    if (!(p.z() > kMinBundleDepth)) return std::numeric_limits<double>::infinity();
    return (problem().camera.Project(p) - o.uv_px).squaredNorm() * o.inv_sigma_squared;
  }

  double RobustCost() const {
    const double delta = options_.huber_delta;
    double cost = 0.0;
    for (const BundleObservation& o : problem().observations) {
      const double squared = std::min(Chi2(o), kErrorBehind * kErrorBehind);
      cost += 0.5 * (squared <= delta * delta ? squared : 2.0 * delta * std::sqrt(squared) - delta * delta);
    }
    return cost;
  }

  void SetAsideBehind() {
    for (size_t i = 0; i < state_.active.size(); ++i) {
      state_.active[i] = InCamera(problem().observations[i]).z() > kMinBundleDepth;
    }
  }

  void SetAsideOutliers(BundleSolver* solver) {
    for (size_t i = 0; i < state_.active.size(); ++i) {
      if (!state_.active[i] || Chi2(problem().observations[i]) <= options_.max_chi2) continue;
      state_.active[i] = 0;
      solver->Disable(i);
    }
  }

  bool AllFinite() const {
    return std::ranges::all_of(state_.poses, [](const Rigid3d& T) { return T.AllFinite(); }) &&
           std::ranges::all_of(problem().points, [](const Eigen::Vector3d& p) { return p.allFinite(); });
  }

  void FlagOutliers(BundleReport* report) const {
    report->outliers.assign(problem().observations.size(), 0);
    for (size_t i = 0; i < report->outliers.size(); ++i) {
      report->outliers[i] = !(Chi2(problem().observations[i]) <= options_.max_chi2);
    }
  }

  /// With one pose held and no point, the scale is free: the farthest camera gets its old distance back.
  void KeepScale(const std::vector<Rigid3d>& before) {
    const std::vector<char>& points = problem().point_fixed;
    const bool scale_is_free = NumFree(state_.pose_held) + 1 == static_cast<int>(before.size());
    if (!scale_is_free || std::ranges::find(points, 1) != points.end()) return;
    const auto held = static_cast<size_t>(std::ranges::find(state_.pose_held, 1) - state_.pose_held.begin());
    const Eigen::Vector3d center = before[held].Center();
    const auto distance = [&](const Rigid3d& T) { return (T.Center() - center).norm(); };
    const auto farthest = std::ranges::max_element(before, {}, distance) - before.begin();
    const double was = distance(before[static_cast<size_t>(farthest)]);
    const double is = distance(problem().T_cam_world[static_cast<size_t>(farthest)]);
    if (!(was > 0.0) || !(is > 0.0)) return;
    const double scale = was / is;
    for (Eigen::Vector3d& point : problem().points) point = center + scale * (point - center);
    for (size_t i = 0; i < before.size(); ++i) {
      if (i == held) continue;
      Rigid3d& T = problem().T_cam_world[i];
      const Eigen::Vector3d moved = center + scale * (T.Center() - center);
      T.translation = T.rotation * -moved;
    }
  }

  /// Where the rays of a point are parallel, or part, each adjustment lets it go farther away, in the end
  /// beyond what a record can hold. It is kept, since its direction says how the cameras are turned.
  void HoldAtInfinity() {
    for (Eigen::Vector3d& point : problem().points) {
      const double distance = point.stableNorm();
      if (distance > kAtInfinity) point *= kAtInfinity / distance;
    }
  }

  const BundleOptions& options_;
  BundleState state_;
};

}  // namespace

BundleReport AdjustBundle(const BundleOptions& options, BundleProblem& problem) {
  CheckIndices(problem);
  if (NumFree(HeldPoses(problem)) <= kMaxPosesDense) return Adjustment(options, problem).Run();
  // Ceres makes some hundred thousand small allocations, all of which end with the adjustment. On the heap of
  // a long run they would lie in the gaps between landmarks all over it, and with a large map the adjustment
  // would spend two thirds of its time waiting for memory. A thread has a heap of its own (an arena of
  // malloc), which is empty before and after. The caller waits for it; nothing runs beside it, and
  // `interrupt` only reads and sets flags.
  return std::async(std::launch::async, [&] { return Adjustment(options, problem).Run(); }).get();
}

BundleOptions GlobalBundleOptions(int iterations) {
  BundleOptions options;
  options.first_iterations = iterations;
  options.second_iterations = 0;
  options.relative_tolerance = 1e-6;
  return options;
}

}  // namespace dmslam
