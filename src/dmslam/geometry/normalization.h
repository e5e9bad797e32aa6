#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <span>

namespace dmslam {

/// Hartley's normalisation: moves the centroid to the origin and the mean distance from it to sqrt(2).
struct Normalization {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double scale = 1.0;

  Eigen::Vector2d operator()(const Eigen::Vector2d& x) const { return scale * (x - center); }
  Eigen::Matrix3d Matrix() const {
    Eigen::Matrix3d m;
    m << scale, 0, -scale * center.x(), 0, scale, -scale * center.y(), 0, 0, 1;
    return m;
  }
  Eigen::Matrix3d InverseMatrix() const {
    Eigen::Matrix3d m;
    m << 1.0 / scale, 0, center.x(), 0, 1.0 / scale, center.y(), 0, 0, 1;
    return m;
  }

  /// Over the points named by `indices`; none if they coincide.
  static std::optional<Normalization> Of(std::span<const Eigen::Vector2d> x, std::span<const int> indices) {
    Normalization n;
    for (const int i : indices) n.center += x[static_cast<size_t>(i)];
    n.center /= static_cast<double>(indices.size());
    double distance = 0.0;
    for (const int i : indices) distance += (x[static_cast<size_t>(i)] - n.center).norm();
    distance /= static_cast<double>(indices.size());
    if (!(distance > 1e-12)) return std::nullopt;
    n.scale = std::sqrt(2.0) / distance;
    return n;
  }
};

}  // namespace dmslam
