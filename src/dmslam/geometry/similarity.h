#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// The similarity b_from_a that minimises sum |b_i - S a_i|^2 (Umeyama, PAMI 1991) over n >= 3 pairs, those
/// named by `indices` if it is not empty. With `fix_scale` the scale stays 1. None if the points are
/// collinear or coincide.
std::optional<Sim3d> AlignSim3(std::span<const Eigen::Vector3d> points_a,
                               std::span<const Eigen::Vector3d> points_b, std::span<const int> indices = {},
                               bool fix_scale = false);

/// Exponential and logarithm of Sim(3) (Strasdat, "Local accuracy and global consistency for efficient visual
/// SLAM", 2012, appendix). Tangent order: rotation vector (3), translation part (3), log of the scale (1).
Sim3d ExpSim3(const Vector7d& tangent);
Vector7d LogSim3(const Sim3d& S);
/// Adjoint: S * Exp(x) = Exp(Adjoint(S) * x) * S.
Matrix7d AdjointSim3(const Sim3d& S);
/// Inverse of the left Jacobian: Log(Exp(d) * Exp(x)) = x + LeftJacobianInverseSim3(x) * d + O(d^2).
/// Bernoulli series in ad(x), summed to machine precision; needs a rotation below 2 pi.
Matrix7d LeftJacobianInverseSim3(const Vector7d& tangent);

/// A step on a pose: Exp(rotation part) and translation part applied on the left, T_new = {Exp(w), v} * T.
/// This is the tangent (w, v) of every pose Jacobian and information matrix in this project.
inline Rigid3d StepPose(const Rigid3d& T, const Vector6d& step) {
  return Rigid3d(ExpSo3(step.head<3>()), step.tail<3>()) * T;
}

}  // namespace dmslam
