#include "dmslam/geometry/rigid3.h"

#include <cmath>

namespace dmslam {

Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& rotation_vector) {
  const double angle_squared = rotation_vector.squaredNorm();
  double real, imaginary;
  if (angle_squared < 1e-10) {
    real = 1.0 - angle_squared / 8.0;
    imaginary = 0.5 - angle_squared / 48.0;
  } else {
    const double angle = std::sqrt(angle_squared);
    real = std::cos(0.5 * angle);
    imaginary = std::sin(0.5 * angle) / angle;
  }
  return Eigen::Quaterniond(real, imaginary * rotation_vector.x(), imaginary * rotation_vector.y(),
                            imaginary * rotation_vector.z())
      .normalized();
}

Eigen::Vector3d LogSo3(const Eigen::Quaterniond& rotation) {
  const Eigen::Vector3d v =
      rotation.w() < 0 ? Eigen::Vector3d(-rotation.vec()) : Eigen::Vector3d(rotation.vec());
  const double sine = v.norm();
  if (sine < 1e-8) return 2.0 * v;
  return 2.0 * std::atan2(sine, std::abs(rotation.w())) / sine * v;
}

Eigen::Matrix3d Hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return LogSo3(a.conjugate() * b).norm();
}

}  // namespace dmslam
