#include "dmslam/geometry/similarity.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "dmslam/geometry/svd.h"

namespace dmslam {
namespace {

struct Moments {
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  ///< Sum of (b - mean_b) (a - mean_a)^T.
  double spread_a = 0.0;
};

Moments ComputeMoments(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b,
                       std::span<const int> indices) {
  Moments m;
  const size_t count = indices.empty() ? a.size() : indices.size();
  const auto at = [&](size_t k) { return indices.empty() ? k : static_cast<size_t>(indices[k]); };
  for (size_t k = 0; k < count; ++k) {
    m.mean_a += a[at(k)];
    m.mean_b += b[at(k)];
  }
  m.mean_a /= static_cast<double>(count);
  m.mean_b /= static_cast<double>(count);
  for (size_t k = 0; k < count; ++k) {
    const Eigen::Vector3d da = a[at(k)] - m.mean_a;
    m.cross += (b[at(k)] - m.mean_b) * da.transpose();
    m.spread_a += da.squaredNorm();
  }
  return m;
}

}  // namespace

std::optional<Sim3d> AlignSim3(std::span<const Eigen::Vector3d> points_a,
                               std::span<const Eigen::Vector3d> points_b, std::span<const int> indices,
                               bool fix_scale) {
  if ((indices.empty() ? points_a.size() : indices.size()) < 3) return std::nullopt;
  const Moments m = ComputeMoments(points_a, points_b, indices);
  const Svd3 svd = SvdOf(m.cross);
  const Eigen::Vector3d values = svd.values;
  if (!(values(1) > 1e-9 * values(0)) || !(m.spread_a > 0.0)) return std::nullopt;
  Eigen::Vector3d signs(1, 1, 1);
  if (svd.U.determinant() * svd.V.determinant() < 0) signs.z() = -1;
  Sim3d S;
  S.rotation = Eigen::Quaterniond(Eigen::Matrix3d(svd.U * signs.asDiagonal() * svd.V.transpose()));
  S.rotation.normalize();
  S.scale = fix_scale ? 1.0 : values.dot(signs) / m.spread_a;
  if (!(S.scale > 0.0)) return std::nullopt;
  S.translation = m.mean_b - S.scale * (S.rotation * m.mean_a);
  return S;
}

namespace {

/// The integrals over u in [0, 1] of e^(sigma u), e^(sigma u) sin(theta u) / theta and
/// e^(sigma u) (1 - cos(theta u)) / theta^2: what W of the exponential is made of.
struct Integrals {
  double constant, sine, cosine;
};

/// In closed form where theta is not small.
Integrals IntegrateClosed(double sigma, double theta_squared) {
  const double theta = std::sqrt(theta_squared), e = std::exp(sigma);
  const double size = sigma * sigma + theta_squared, s = std::sin(theta), c = std::cos(theta);
  const double constant = std::abs(sigma) < 1e-12 ? 1.0 : std::expm1(sigma) / sigma;
  const double with_cosine = (e * (sigma * c + theta * s) - sigma) / size;
  return {constant, (e * (sigma * s / theta - c) + 1.0) / size, (constant - with_cosine) / theta_squared};
}

/// By Gauss-Legendre quadrature with eight nodes, the trigonometric parts as series, where theta is small.
Integrals IntegrateNumerically(double sigma, double theta_squared) {
  constexpr std::array<double, 4> kNodes{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                         0.9602898564975363};
  constexpr std::array<double, 4> kWeights{0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                           0.1012285362903763};
  Integrals sum{0.0, 0.0, 0.0};
  for (size_t k = 0; k < 4; ++k) {
    for (const double side : {-1.0, 1.0}) {
      const double u = 0.5 + 0.5 * side * kNodes[k], s = theta_squared * u * u;
      const double weight = 0.5 * kWeights[k] * std::exp(sigma * u);
      sum.constant += weight;
      sum.sine += weight * u * (1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72))));
      sum.cosine += weight * u * u * 0.5 * (1 - s / 12 * (1 - s / 30 * (1 - s / 56 * (1 - s / 90))));
    }
  }
  return sum;
}

/// Translation = W(rotation vector, log scale) * translation part of the tangent.
Eigen::Matrix3d TranslationFactor(const Eigen::Vector3d& w, double sigma) {
  const double theta_squared = w.squaredNorm();
  const Integrals i = theta_squared > 0.01 ? IntegrateClosed(sigma, theta_squared)
                                           : IntegrateNumerically(sigma, theta_squared);
  const Eigen::Matrix3d hat = Hat(w);
  return i.constant * Eigen::Matrix3d::Identity() + i.sine * hat + i.cosine * hat * hat;
}

}  // namespace

Sim3d ExpSim3(const Vector7d& tangent) {
  const Eigen::Vector3d w = tangent.head<3>();
  return {ExpSo3(w), TranslationFactor(w, tangent(6)) * tangent.segment<3>(3), std::exp(tangent(6))};
}

Vector7d LogSim3(const Sim3d& S) {
  Vector7d tangent;
  const Eigen::Vector3d w = LogSo3(S.rotation);
  const double sigma = std::log(S.scale);
  tangent.head<3>() = w;
  tangent.segment<3>(3) = TranslationFactor(w, sigma).inverse() * S.translation;
  tangent(6) = sigma;
  return tangent;
}

Matrix7d AdjointSim3(const Sim3d& S) {
  const Eigen::Matrix3d R = S.rotation.toRotationMatrix();
  Matrix7d adjoint = Matrix7d::Zero();
  adjoint.block<3, 3>(0, 0) = R;
  adjoint.block<3, 3>(3, 0) = Hat(S.translation) * R;
  adjoint.block<3, 3>(3, 3) = S.scale * R;
  adjoint.block<3, 1>(3, 6) = -S.translation;
  adjoint(6, 6) = 1.0;
  return adjoint;
}

namespace {

/// B_2k / (2k)!, k >= 1: tabulated, and for k > 6 as 2 (-1)^(k+1) zeta(2k) / (2 pi)^2k.
double BernoulliOverFactorial(int k) {
  constexpr std::array<double, 6> kFirst{1.0 / 12,         -1.0 / 720,       1.0 / 30240,
                                         -1.0 / 1209600.0, 1.0 / 47900160.0, -691.0 / 1307674368000.0};
  if (k <= 6) return kFirst[static_cast<size_t>(k - 1)];
  const double n = 2.0 * k;
  const double zeta = 1.0 + std::pow(2.0, -n) + std::pow(3.0, -n) + std::pow(4.0, -n);
  return (k % 2 ? 2.0 : -2.0) * zeta * std::pow(6.283185307179586, -n);
}

}  // namespace

Matrix7d LeftJacobianInverseSim3(const Vector7d& tangent) {
  Matrix7d ad = Matrix7d::Zero();
  ad.block<3, 3>(0, 0) = Hat(tangent.head<3>());
  ad.block<3, 3>(3, 0) = Hat(tangent.segment<3>(3));
  ad.block<3, 3>(3, 3) = Hat(tangent.head<3>()) + tangent(6) * Eigen::Matrix3d::Identity();
  ad.block<3, 1>(3, 6) = -tangent.segment<3>(3);
  const Matrix7d square = ad * ad;
  Matrix7d power = square, sum = Matrix7d::Identity() - 0.5 * ad;
  for (int k = 1; k <= 40; ++k) {
    const double factor = BernoulliOverFactorial(k);
    const double size = std::abs(factor) * power.cwiseAbs().maxCoeff();
    sum += factor * power;
    if (size < 1e-16) break;
    power = (power * square).eval();
  }
  return sum;
}

}  // namespace dmslam
