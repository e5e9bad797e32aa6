#include "dmslam/geometry/solve_symmetric.h"

#include <Eigen/Cholesky>

namespace dmslam {

template <int kSize, int kColumns>
Eigen::Matrix<double, kSize, kColumns> SolveSymmetric(const Eigen::Matrix<double, kSize, kSize>& A,
                                                      const Eigen::Matrix<double, kSize, kColumns>& b) {
  return A.ldlt().solve(b);
}

template Eigen::Matrix<double, 3, 1> SolveSymmetric(const Eigen::Matrix<double, 3, 3>&,
                                                    const Eigen::Matrix<double, 3, 1>&);
template Eigen::Matrix<double, 3, 2> SolveSymmetric(const Eigen::Matrix<double, 3, 3>&,
                                                    const Eigen::Matrix<double, 3, 2>&);
template Eigen::Matrix<double, 5, 1> SolveSymmetric(const Eigen::Matrix<double, 5, 5>&,
                                                    const Eigen::Matrix<double, 5, 1>&);
template Eigen::Matrix<double, 6, 1> SolveSymmetric(const Eigen::Matrix<double, 6, 6>&,
                                                    const Eigen::Matrix<double, 6, 1>&);
template Eigen::Matrix<double, 7, 1> SolveSymmetric(const Eigen::Matrix<double, 7, 7>&,
                                                    const Eigen::Matrix<double, 7, 1>&);

}  // namespace dmslam
