#pragma once

#include <ceres/ceres.h>

#include <cmath>
#include <functional>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// Left Jacobian of SO(3): Exp(w + d) = Exp(J d) Exp(w) to first order.
inline Eigen::Matrix3d LeftJacobianSo3(const Eigen::Vector3d& w) {
  const double angle_squared = w.squaredNorm(), angle = std::sqrt(angle_squared);
  double first = 0.5 - angle_squared / 24.0, second = 1.0 / 6.0 - angle_squared / 120.0;
  if (angle > 1e-3) {
    first = (1.0 - std::cos(angle)) / angle_squared;
    second = (angle - std::sin(angle)) / (angle_squared * angle);
  }
  const Eigen::Matrix3d hat = Hat(w);
  return Eigen::Matrix3d::Identity() + first * hat + second * hat * hat;
}

/// Huber's loss or Cauchy's: which one may change between two solves of the same problem.
class BundleLoss : public ceres::LossFunction {
 public:
  enum class Kind { kHuber, kCauchy };
  BundleLoss(double huber_delta, double cauchy_width)
      : delta_(huber_delta), delta_squared_(delta_ * delta_), width_squared_(cauchy_width * cauchy_width) {}

  Kind kind = Kind::kHuber;

  void EvaluateHuber(double squared, double rho[3]) const {
    if (squared <= delta_squared_) {
      rho[0] = squared, rho[1] = 1.0, rho[2] = 0.0;
      return;
    }
    const double root = std::sqrt(squared);
    rho[0] = 2.0 * delta_ * root - delta_squared_;
    rho[1] = delta_ / root;
    rho[2] = -rho[1] / (2.0 * squared);
  }
  void Evaluate(double squared, double rho[3]) const override {
    kind == Kind::kHuber ? EvaluateHuber(squared, rho) : EvaluateCauchy(squared, rho);
  }

 private:
  void EvaluateCauchy(double squared, double rho[3]) const {
    const double sum = 1.0 + squared / width_squared_;
    rho[0] = width_squared_ * std::log(sum), rho[1] = 1.0 / sum;
    rho[2] = -rho[1] * rho[1] / width_squared_;
  }

  double delta_, delta_squared_, width_squared_;
};

/// Ends a solve when the caller asks for it; the best state so far is kept.
class InterruptCallback : public ceres::IterationCallback {
 public:
  explicit InterruptCallback(const std::function<bool()>& interrupt) : interrupt_(interrupt) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    if (!interrupt_ || !interrupt_()) return ceres::SOLVER_CONTINUE;
    interrupted_ = true;
    return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }
  bool interrupted() const { return interrupted_; }

 private:
  const std::function<bool()>& interrupt_;
  bool interrupted_ = false;
};

/// One thread, no output, the same result every time. `first_trust_region`: damping begins at its inverse,
/// times the diagonal of the normal equations, and falls to a third with each good step. With Ceres' 1e4 few
/// steps get nowhere along what is hardly determined.
inline ceres::Solver::Options QuietSolverOptions(double first_trust_region) {
  ceres::Solver::Options options;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.minimizer_progress_to_stdout = false;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.dense_linear_algebra_library_type = ceres::EIGEN;
  options.initial_trust_region_radius = first_trust_region;
  return options;
}

}  // namespace dmslam
