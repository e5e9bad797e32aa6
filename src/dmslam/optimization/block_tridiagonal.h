#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "dmslam/util/vector_path.h"

namespace dmslam {

/// A x = right, of a matrix A that is symmetric, positive definite and block tridiagonal: what a chain of
/// states makes, each of which has to do with its neighbours alone.
struct BlockTridiagonal {
  static constexpr int kBlock = 24;  ///< rows of a block
  using Block = Eigen::Matrix<double, kBlock, kBlock>;
  using Part = Eigen::Matrix<double, kBlock, 1>;

  std::vector<Block> diagonal;  ///< of each the lower triangle counts
  std::vector<Block> above;     ///< [k] is A(k, k + 1): one fewer
  std::vector<Part> right;      ///< as many as of the diagonal
};

/// Block Cholesky. Replaces `right` by x; the rest of `system` is used up. The logarithm of A's determinant;
/// none where A is not positive definite, or x not finite. The same bits on every path.
std::optional<double> Solve(BlockTridiagonal* system, VectorPath path = VectorPath::kWidest);

}  // namespace dmslam
