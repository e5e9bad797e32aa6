#include "dmslam/optimization/block_tridiagonal.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kBlock = BlockTridiagonal::kBlock;
using Block = BlockTridiagonal::Block;

Block Drawn(Random& random) {
  Block block;
  for (int i = 0; i < block.size(); ++i) block.data()[i] = random.Gaussian();
  return block;
}

/// Of `count` blocks: L L^T of a block bidiagonal L, so it is positive definite.
BlockTridiagonal Drawn(size_t count, uint64_t seed) {
  Random random(seed);
  BlockTridiagonal system;
  Block before = Block::Zero();
  for (size_t k = 0; k < count; ++k) {
    const Block here = Drawn(random) + 2.0 * kBlock * Block::Identity();
    const Block below = Drawn(random);
    system.diagonal.push_back(here * here.transpose() + before * before.transpose());
    if (k + 1 < count) system.above.push_back(here * below.transpose());
    system.right.push_back(Drawn(random).col(0));
    before = below;
  }
  return system;
}

struct Dense {
  Eigen::MatrixXd A;
  Eigen::VectorXd right;
};

Dense ToDense(const BlockTridiagonal& system) {
  const auto count = static_cast<Eigen::Index>(system.diagonal.size());
  Dense dense{Eigen::MatrixXd::Zero(kBlock * count, kBlock * count), Eigen::VectorXd(kBlock * count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    dense.A.block<kBlock, kBlock>(kBlock * k, kBlock * k) = system.diagonal[static_cast<size_t>(k)];
    dense.right.segment<kBlock>(kBlock * k) = system.right[static_cast<size_t>(k)];
    if (k + 1 == count) break;
    const Block& above = system.above[static_cast<size_t>(k)];
    dense.A.block<kBlock, kBlock>(kBlock * k, kBlock * (k + 1)) = above;
    dense.A.block<kBlock, kBlock>(kBlock * (k + 1), kBlock * k) = above.transpose();
  }
  return dense;
}

Eigen::VectorXd Joined(const std::vector<BlockTridiagonal::Part>& parts) {
  Eigen::VectorXd joined(kBlock * static_cast<Eigen::Index>(parts.size()));
  for (size_t k = 0; k < parts.size(); ++k) {
    joined.segment<kBlock>(kBlock * static_cast<Eigen::Index>(k)) = parts[k];
  }
  return joined;
}

TEST(BlockTridiagonal, SolvesWhatADenseFactorizationSolves) {
  for (const size_t count : {1, 2, 7}) {
    BlockTridiagonal system = Drawn(count, count);
    const Dense dense = ToDense(system);
    const Eigen::LLT<Eigen::MatrixXd> factored(dense.A);
    const Eigen::VectorXd expected = factored.solve(dense.right);
    const double log_determinant = 2.0 * factored.matrixLLT().diagonal().array().log().sum();

    const std::optional<double> found = Solve(&system);
    ASSERT_TRUE(found.has_value()) << count;
    EXPECT_NEAR(*found, log_determinant, 1e-9 * log_determinant);
    EXPECT_LT((Joined(system.right) - expected).norm(), 1e-9 * expected.norm());
  }
}

TEST(BlockTridiagonal, LooksAtTheLowerTrianglesAlone) {
  BlockTridiagonal system = Drawn(3, 5), other = system;
  for (Block& block : other.diagonal) {
    block.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  ASSERT_EQ(Solve(&other), Solve(&system));
  EXPECT_EQ(Joined(other.right), Joined(system.right));
}

TEST(BlockTridiagonal, GivesTheSameBitsOnEveryPath) {
  BlockTridiagonal expected = Drawn(9, 3);
  const std::optional<double> log_determinant = Solve(&expected, VectorPath::kBaseline);
  for (const VectorPath path : VectorPaths()) {
    BlockTridiagonal system = Drawn(9, 3);
    EXPECT_EQ(Solve(&system, path), log_determinant);
    EXPECT_EQ(Joined(system.right), Joined(expected.right));
  }
}

TEST(BlockTridiagonal, RefusesWhatIsNotPositiveDefinite) {
  BlockTridiagonal negative = Drawn(4, 1);
  negative.diagonal[2] -= 1e4 * Block::Identity();
  EXPECT_FALSE(Solve(&negative).has_value());

  BlockTridiagonal unknown = Drawn(4, 1);
  unknown.right[1][3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Solve(&unknown).has_value());
}

}  // namespace
}  // namespace dmslam
