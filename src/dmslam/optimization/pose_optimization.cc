#include "dmslam/optimization/pose_optimization.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/optimization/pose_sums.h"

namespace dmslam {
namespace {

/// One pose-only problem: the data, and which observations count.
class PoseProblem {
 public:
  PoseProblem(const Pinhole& camera, std::span<const PoseObservation> observations,
              const PoseOptimizationOptions& options, const std::vector<char>& inliers)
      : camera_(camera), observations_(observations), options_(options), inliers_(inliers) {}

  /// Cost (sum of weight * rho(chi2), and the prior's), gradient and Gauss-Newton Hessian, tangent (w, v).
  PoseEquations Linearize(const Rigid3d& T, bool robust) const {
    const double huber_chi2 = robust ? options_.max_chi2 : std::numeric_limits<double>::infinity();
    PoseEquations result = SumPoseEquations(camera_, T, observations_, inliers_, huber_chi2);
    AddPrior(T, result);
    return result;
  }

  /// Tests all observations against the pose. Says whether others are inliers than before.
  bool Classify(const Rigid3d& T, PoseOptimizationReport& report) const {
    const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
    report.num_inliers = 0;
    double sum = 0.0;
    bool changed = false;
    for (size_t i = 0; i < observations_.size(); ++i) {
      const PoseObservation& o = observations_[i];
      const Eigen::Vector3d p = R * o.p_world + T.translation;
      const double chi2 = p.z() > kMinDepth ? Chi2(o, p) : std::numeric_limits<double>::infinity();
      report.chi2[i] = chi2;
      const char inlier = chi2 <= options_.max_chi2;
      changed |= report.inliers[i] != inlier;
      report.inliers[i] = inlier;
      if (!report.inliers[i]) continue;
      ++report.num_inliers;
      sum += chi2;
    }
    report.mean_chi2 = report.num_inliers > 0 ? sum / report.num_inliers : 0.0;
    return changed;
  }

 private:
  double Chi2(const PoseObservation& o, const Eigen::Vector3d& p_cam) const {
    return (camera_.Project(p_cam) - o.uv_px).squaredNorm() * o.inv_sigma_squared;
  }

  static Vector6d PriorError(const Rigid3d& T, const PosePrior& prior) {
    const Rigid3d difference = T * prior.T_cam_world.Inverse();
    Vector6d error;
    error << LogSo3(difference.rotation), difference.translation;
    return error;
  }

  void AddPrior(const Rigid3d& T, PoseEquations& result) const {
    if (!options_.prior) return;
    const Vector6d error = PriorError(T, *options_.prior);
    const Matrix6d J = PosePriorJacobian(error);
    const Matrix6d weighted = J.transpose() * options_.prior->information;
    result.hessian += weighted * J;
    result.gradient += weighted * error;
    result.cost += error.dot(options_.prior->information * error);
  }

  const Pinhole& camera_;
  std::span<const PoseObservation> observations_;
  const PoseOptimizationOptions& options_;
  const std::vector<char>& inliers_;
};

/// Levenberg-Marquardt until the step is tiny or the iterations are spent. `now` is what the problem looks
/// like at T, before and after. Returns how many were made.
int Minimize(const PoseProblem& problem, const PoseOptimizationOptions& options, bool robust, Rigid3d& T,
             PoseEquations& now) {
  double damping = 1e-6;
  for (int k = 0; k < options.iterations; ++k) {
    Matrix6d damped = now.hessian;
    damped.diagonal() += damping * now.hessian.diagonal();
    const Vector6d step = -SolveSymmetric(damped, now.gradient);
    if (!step.allFinite()) return k;
    const Rigid3d candidate = StepPose(T, step);
    const bool tiny = step.squaredNorm() < options.min_step * options.min_step;
    PoseEquations next = problem.Linearize(candidate, robust);
    if (next.cost <= now.cost) {
      const bool settled = now.cost - next.cost < 1e-7 * now.cost;
      T = candidate;
      now = next;
      damping = std::max(1e-9, damping * 0.1);
      if (settled) return k + 1;
    } else {
      damping = std::max(1e-4, damping * 10.0);
    }
    if (tiny) return k + 1;
  }
  return options.iterations;
}

}  // namespace

Matrix6d PosePriorJacobian(const Vector6d& error) {
  const Eigen::Vector3d w = error.head<3>(), t = error.tail<3>();
  const double angle_squared = w.squaredNorm(), angle = std::sqrt(angle_squared);
  const double second = angle < 1e-4 ? 1.0 / 12.0 + angle_squared / 720.0
                                     : 1.0 / angle_squared - 0.5 / (angle * std::tan(0.5 * angle));
  const Eigen::Matrix3d hat = Hat(w);
  Matrix6d J = Matrix6d::Identity();
  J.block<3, 3>(0, 0) += -0.5 * hat + second * hat * hat;
  J.block<3, 3>(3, 0) = -Hat(t);
  return J;
}

void OptimizePose(const Pinhole& camera, const Rigid3d& T_cam_world_init,
                  std::span<const PoseObservation> observations, const PoseOptimizationOptions& options,
                  PoseOptimizationReport& report) {
  const size_t count = observations.size();
  report.inliers.assign(count, 1);
  report.chi2.assign(count, 0.0);
  report.T_cam_world = T_cam_world_init;
  report.iterations = 0;
  const PoseProblem problem(camera, observations, options, report.inliers);
  report.num_inliers = static_cast<int>(count);
  // Where a round left the inliers as they were, the next begins with what is known.
  std::optional<PoseEquations> known;
  bool known_robust = false;
  for (int round = 0; round < options.rounds && report.num_inliers >= options.min_observations; ++round) {
    const bool robust = round < options.robust_rounds;
    if (!known || robust != known_robust) known = problem.Linearize(report.T_cam_world, robust);
    known_robust = robust;
    report.iterations += Minimize(problem, options, robust, report.T_cam_world, *known);
    if (problem.Classify(report.T_cam_world, report)) known.reset();
  }
  report.usable = report.iterations > 0 && report.num_inliers >= options.min_observations &&
                  report.T_cam_world.AllFinite();
  if (!report.usable) {
    report.T_cam_world = T_cam_world_init;
    problem.Classify(T_cam_world_init, report);
    known.reset();
  }
  if (!known || known_robust) known = problem.Linearize(report.T_cam_world, false);
  report.information = known->hessian;
}

PoseOptimizationReport OptimizePose(const Pinhole& camera, const Rigid3d& T_cam_world_init,
                                    std::span<const PoseObservation> observations,
                                    const PoseOptimizationOptions& options) {
  PoseOptimizationReport report;
  OptimizePose(camera, T_cam_world_init, observations, options, report);
  return report;
}

}  // namespace dmslam
