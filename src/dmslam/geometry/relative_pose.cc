#include <Eigen/LU>
#include <array>
#include <cmath>

#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/geometry/two_view.h"

namespace dmslam {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

/// F of a pose, and its derivatives along the five tangent directions: three of the rotation (on the left),
/// two of the translation across itself.
struct TangentF {
  Eigen::Matrix3d F;
  std::array<Eigen::Matrix3d, 5> slope;
  Eigen::Matrix<double, 3, 2> across;

  TangentF(const Pinhole& camera, const Rigid3d& T) {
    const Eigen::Matrix3d K_inverse = camera.K().inverse(), R = T.rotation.toRotationMatrix();
    const Eigen::Matrix3d left = K_inverse.transpose(), right = R * K_inverse;
    const Eigen::Vector3d t = T.translation.normalized();
    across.col(0) = t.unitOrthogonal();
    across.col(1) = t.cross(across.col(0));
    const Eigen::Matrix3d hat = Hat(t);
    F = left * hat * right;
    for (int k = 0; k < 3; ++k)
      slope[static_cast<size_t>(k)] = left * hat * Hat(Eigen::Vector3d::Unit(k)) * right;
    for (int k = 0; k < 2; ++k) slope[3 + static_cast<size_t>(k)] = left * Hat(across.col(k)) * right;
  }
};

struct Sums {
  Matrix5d hessian = Matrix5d::Zero();
  Vector5d gradient = Vector5d::Zero();
  double cost = 0.0;
};

/// Signed Sampson error of a match and its slopes.
double SampsonWithSlopes(const TangentF& f, const Eigen::Vector2d& x1, const Eigen::Vector2d& x2,
                         Vector5d& slopes) {
  const Eigen::Vector3d a = f.F * x1.homogeneous();
  const Eigen::Vector2d d = f.F.topRows<2>().transpose().topRows<2>() * x2 + f.F.row(2).head<2>().transpose();
  const double inverse = 1.0 / std::sqrt(a.head<2>().squaredNorm() + d.squaredNorm());
  const double error = (x2.dot(a.head<2>()) + a.z()) * inverse;
  const double factor = error * inverse;
  for (int k = 0; k < 5; ++k) {
    const Eigen::Matrix3d& m = f.slope[static_cast<size_t>(k)];
    const double a0 = m(0, 0) * x1.x() + m(0, 1) * x1.y() + m(0, 2),
                 a1 = m(1, 0) * x1.x() + m(1, 1) * x1.y() + m(1, 2);
    const double a2 = m(2, 0) * x1.x() + m(2, 1) * x1.y() + m(2, 2);
    const double d0 = m(0, 0) * x2.x() + m(1, 0) * x2.y() + m(2, 0),
                 d1 = m(0, 1) * x2.x() + m(1, 1) * x2.y() + m(2, 1);
    const double turn = a.x() * a0 + a.y() * a1 + d.x() * d0 + d.y() * d1;
    slopes(k) = inverse * (x2.x() * a0 + x2.y() * a1 + a2 - factor * turn);
  }
  return error;
}

Sums SumUp(const TangentF& f, std::span<const Eigen::Vector2d> x1_px, std::span<const Eigen::Vector2d> x2_px,
           std::span<const int> indices, std::span<const double> weights, double huber_px) {
  Sums sums;
  Vector5d slopes;
  for (const int index : indices) {
    const auto i = static_cast<size_t>(index);
    const double error = SampsonWithSlopes(f, x1_px[i], x2_px[i], slopes);
    double weight = weights.empty() ? 1.0 : weights[i];
    const double size = std::abs(error) * std::sqrt(weight);
    if (huber_px > 0.0 && size > huber_px) {
      sums.cost += huber_px * (2.0 * size - huber_px);
      weight *= huber_px / size;
    } else {
      sums.cost += size * size;
    }
    sums.hessian.noalias() += weight * slopes * slopes.transpose();
    sums.gradient.noalias() += (weight * error) * slopes;
  }
  return sums;
}

}  // namespace

Rigid3d RefineRelativePose(const Pinhole& camera, const Rigid3d& T_cam2_cam1,
                           std::span<const Eigen::Vector2d> x1_px, std::span<const Eigen::Vector2d> x2_px,
                           std::span<const int> indices, std::span<const double> weights, double huber_px,
                           int iterations) {
  const double length = T_cam2_cam1.translation.norm();
  if (!(length > 0.0)) return T_cam2_cam1;
  Rigid3d T = T_cam2_cam1;
  TangentF f(camera, T);
  Sums now = SumUp(f, x1_px, x2_px, indices, weights, huber_px);
  double damping = 1e-6;
  for (int k = 0; k < iterations; ++k) {
    Matrix5d damped = now.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Vector5d step = -SolveSymmetric(damped, now.gradient);
    if (!step.allFinite()) return T;
    const Eigen::Vector3d direction = T.translation / length + f.across * step.tail<2>();
    const Rigid3d candidate((ExpSo3(step.head<3>()) * T.rotation).normalized(),
                            length * direction.normalized());
    const TangentF next_f(camera, candidate);
    const Sums next = SumUp(next_f, x1_px, x2_px, indices, weights, huber_px);
    if (!(next.cost < now.cost)) {
      damping = std::max(1e-3, damping * 100.0);
      continue;
    }
    const bool settled = next.cost > now.cost * (1.0 - 1e-5);
    T = candidate;
    f = next_f;
    now = next;
    damping *= 0.1;
    if (settled) return T;
  }
  return T;
}

}  // namespace dmslam
