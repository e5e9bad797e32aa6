#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/optimization/bundle_solver.h"
#include "dmslam/optimization/ceres_support.h"
#include "dmslam/optimization/reprojection.h"

namespace dmslam {

/// A pose during the adjustment: the parameters are the step (w, v) from where it started, so that Ceres
/// needs no manifold. What all its observations share is computed once per evaluation.
struct PoseState {
  std::array<double, 6> step{};
  Rigid3d start;
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  Eigen::Matrix3d left_jacobian;

  void Update() {
    const Eigen::Vector3d w(step[0], step[1], step[2]), v(step[3], step[4], step[5]);
    const Rigid3d now = Current();
    rotation = now.rotation.toRotationMatrix();
    translation = now.translation;
    left_jacobian = LeftJacobianSo3(w);
  }
  Eigen::Vector3d Shift() const { return {step[3], step[4], step[5]}; }
  Rigid3d Current() const {
    return Rigid3d(ExpSo3({step[0], step[1], step[2]}), {step[3], step[4], step[5]}) * start;
  }
};

/// Reprojection error in sigmas. The blocks are pose and point, or one of them where the other is held.
template <int... kBlocks>
class ReprojectionCost : public ceres::SizedCostFunction<2, kBlocks...> {
 public:
  ReprojectionCost(const Pinhole& camera, const PoseState& pose, const Eigen::Vector3d& point,
                   const BundleObservation& observation)
      : camera_(camera),
        pose_(pose),
        point_(point),
        uv_px_(observation.uv_px),
        inv_sigma_(std::sqrt(observation.inv_sigma_squared)) {}

  void Disable() { inv_sigma_ = 0.0; }

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const final {
    const Eigen::Vector3d p = pose_.rotation * point_ + pose_.translation;
    if (!(p.z() > kMinBundleDepth) || inv_sigma_ == 0.0) {
      EvaluateDead(residuals, jacobians);
      return true;
    }
    const double w = 1.0 / p.z(), x = p.x() * w, y = p.y() * w;
    residuals[0] = inv_sigma_ * (camera_.fx_px * x + camera_.cx_px - uv_px_.x());
    residuals[1] = inv_sigma_ * (camera_.fy_px * y + camera_.cy_px - uv_px_.y());
    if (jacobians == nullptr) return true;
    const Matrix23 projection = inv_sigma_ * ProjectionJacobian(camera_, p);
    constexpr bool kHasPose = sizeof...(kBlocks) == 2 || FirstBlock() == 6;
    if constexpr (kHasPose) {
      if (jacobians[0] != nullptr) WritePoseJacobian(projection, p, jacobians[0]);
    }
    constexpr int kPointBlock = sizeof...(kBlocks) == 2 ? 1 : 0;
    if constexpr (!kHasPose || sizeof...(kBlocks) == 2) {
      if (jacobians[kPointBlock] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>(jacobians[kPointBlock]).noalias() =
            projection * pose_.rotation;
      }
    }
    return true;
  }

 private:
  static constexpr int FirstBlock() { return std::array<int, sizeof...(kBlocks)>{kBlocks...}[0]; }

  void WritePoseJacobian(const Matrix23& projection, const Eigen::Vector3d& p, double* out) const {
    const Eigen::Vector3d arm = p - pose_.Shift();
    Matrix23 turn;  // projection * -Hat(arm)
    turn.col(0) = projection.col(2) * arm.y() - projection.col(1) * arm.z();
    turn.col(1) = projection.col(0) * arm.z() - projection.col(2) * arm.x();
    turn.col(2) = projection.col(1) * arm.x() - projection.col(0) * arm.y();
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> jacobian(out);
    jacobian.leftCols<3>().noalias() = turn * pose_.left_jacobian;
    jacobian.rightCols<3>() = projection;
  }

  /// Switched off: nothing. Behind the camera: a large error with no slope.
  void EvaluateDead(double* residuals, double** jacobians) const {
    residuals[0] = inv_sigma_ == 0.0 ? 0.0 : kErrorBehind;
    residuals[1] = 0.0;
    if (jacobians == nullptr) return;
    constexpr std::array<int, sizeof...(kBlocks)> kSizes{kBlocks...};
    for (size_t k = 0; k < kSizes.size(); ++k) {
      if (jacobians[k] != nullptr) std::fill_n(jacobians[k], 2 * kSizes[k], 0.0);
    }
  }

  const Pinhole& camera_;
  const PoseState& pose_;
  const Eigen::Vector3d& point_;
  Eigen::Vector2d uv_px_;
  double inv_sigma_;
};

using BothCost = ReprojectionCost<6, 3>;
using PoseCost = ReprojectionCost<6>;
using PointCost = ReprojectionCost<3>;

}  // namespace dmslam
