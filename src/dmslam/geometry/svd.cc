#include "dmslam/geometry/svd.h"

#include <Eigen/SVD>

namespace dmslam {

Svd3 SvdOf(const Eigen::Matrix3d& A) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

}  // namespace dmslam
