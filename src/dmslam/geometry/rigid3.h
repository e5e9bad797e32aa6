#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dmslam {

/// A rigid transform `b_from_a`: p_b = rotation * p_a + translation. Poses are written T_cam_world (takes
/// world points into the camera), so that adjacent names cancel: T_c_a = T_c_b * T_b_a.
struct Rigid3d {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3d() = default;
  Rigid3d(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) : rotation(q), translation(t) {}

  Rigid3d Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {inverse, inverse * -translation};
  }
  /// Composition; the rotation is normalised again, so that long chains stay rotations.
  Rigid3d operator*(const Rigid3d& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  /// As rotation * point, in the same order of sums, but the compiler puts it where it is used.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    Eigen::Vector3d twice = rotation.vec().cross(point);
    twice += twice;
    return point + rotation.w() * twice + rotation.vec().cross(twice) + translation;
  }
  /// Where the camera stands, for T_cam_world.
  Eigen::Vector3d Center() const { return rotation.conjugate() * -translation; }
  bool AllFinite() const { return rotation.coeffs().allFinite() && translation.allFinite(); }
};

/// A similarity `b_from_a`: p_b = scale * rotation * p_a + translation.
struct Sim3d {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double scale = 1.0;

  Sim3d() = default;
  Sim3d(const Eigen::Quaterniond& q, const Eigen::Vector3d& t, double s)
      : rotation(q), translation(t), scale(s) {}
  explicit Sim3d(const Rigid3d& T) : rotation(T.rotation), translation(T.translation) {}

  Sim3d Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {inverse, inverse * (-translation / scale), 1.0 / scale};
  }
  Sim3d operator*(const Sim3d& other) const {
    return {(rotation * other.rotation).normalized(), scale * (rotation * other.translation) + translation,
            scale * other.scale};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
  /// To the last bit.
  bool operator==(const Sim3d& other) const {
    return rotation.coeffs() == other.rotation.coeffs() && translation == other.translation &&
           scale == other.scale;
  }
  /// The pose with the scale taken out of the translation (ORB-SLAM's convention for corrected keyframes).
  Rigid3d ToRigid() const { return {rotation, translation / scale}; }
};

/// Rotation vector (radians, axis times angle) to quaternion and back.
Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& rotation_vector);
Eigen::Vector3d LogSo3(const Eigen::Quaterniond& rotation);
/// Matrix of the cross product: Hat(a) * b = a x b.
Eigen::Matrix3d Hat(const Eigen::Vector3d& v);
/// Angle between two rotations [rad].
double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

}  // namespace dmslam
