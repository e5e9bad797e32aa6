#pragma once

#include <Eigen/Core>

namespace dmslam {

/// A = U diag(values) V^T, values descending.
struct Svd3 {
  Eigen::Matrix3d U;
  Eigen::Vector3d values;
  Eigen::Matrix3d V;
};

/// By Jacobi rotations. Compiled once, in svd.cc: it takes two seconds in each file that reads Eigen's.
Svd3 SvdOf(const Eigen::Matrix3d& A);

}  // namespace dmslam
