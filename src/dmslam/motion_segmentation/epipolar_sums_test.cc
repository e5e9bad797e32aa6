#include "dmslam/motion_segmentation/epipolar_sums.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Every third match of a pair is left out; the number that takes part is no multiple of a vector.
struct Input {
  MatchArrays arrays;
  std::vector<uint8_t> use;
  TwoViewModel model;
  Eigen::Matrix<double, 3, 2> tangent;

  Input() {
    const SyntheticPair pair = MakeSyntheticPair({}, 3);
    std::vector<uint32_t> order(pair.matches.size());
    std::iota(order.begin(), order.end(), 0U);
    arrays = MakeArrays(pair.matches, order, pair.camera, {});
    for (size_t i = 0; i < arrays.size(); ++i) use.push_back(i % 3 == 1 ? 0 : 7);
    while (std::count(use.begin(), use.end(), 7) % 4 != 3) *std::find(use.begin(), use.end(), 7) = 0;
    model.R = ExpSo3({0.01, -0.02, 0.005}).toRotationMatrix();
    model.t = Eigen::Vector3d(0.8, 0.1, 0.3).normalized();
    model.M = Hat(model.t) * model.R;
    tangent.col(0) = model.t.cross(Eigen::Vector3d::UnitY()).normalized();
    tangent.col(1) = model.t.cross(tangent.col(0));
  }
};

/// Root of the normalised Sampson distance, with the sign of the algebraic residual.
double SampsonResidual(const Input& in, const TwoViewModel& model, double bound_scale, size_t i) {
  const Eigen::Matrix3d M = Hat(model.t) * model.R;
  const double algebraic = in.arrays.ray1[i].dot(M * in.arrays.ray0[i]);
  return std::copysign(std::sqrt(NormalizedSampson(M, in.arrays, i) / bound_scale), -algebraic);
}

/// The model `by` along parameter k: a left rotation, then t along its tangents.
TwoViewModel Moved(const Input& in, int k, double by) {
  TwoViewModel moved = in.model;
  if (k < 3) {
    moved.R = ExpSo3(by * Eigen::Vector3d::Unit(k)).toRotationMatrix() * moved.R;
  } else {
    moved.t = (moved.t + by * in.tangent.col(k - 3)).normalized();
  }
  return moved;
}

TEST(SumEssentialNormal, IsTheSumOfItsFormulaAndTheSameOnEveryPath) {
  constexpr double kScale = 10.0, kStep = 1e-6;
  const Input in;
  const PackedMatches matches(in.arrays, in.use);
  Eigen::Matrix<double, 5, 5> matrix = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> gradient = Eigen::Matrix<double, 5, 1>::Zero();
  double cost = 0;
  for (size_t i = 0; i < in.arrays.size(); ++i) {
    if (!in.use[i]) continue;
    const double residual = SampsonResidual(in, in.model, kScale, i), squared = residual * residual;
    Eigen::Matrix<double, 5, 1> row;
    for (int k = 0; k < 5; ++k) {
      row[k] = (SampsonResidual(in, Moved(in, k, kStep), kScale, i) -
                SampsonResidual(in, Moved(in, k, -kStep), kScale, i)) /
               (2 * kStep);
    }
    const double weight = 1.0 / ((1.0 + squared) * (1.0 + squared));
    matrix += weight * row * row.transpose();
    gradient += weight * residual * row;
    cost += squared / (1.0 + squared);
  }
  const EssentialNormal plain =
      SumEssentialNormal(matches, in.model, in.tangent, kScale, kInfinity, VectorPath::kBaseline);
  EXPECT_EQ(static_cast<size_t>(plain.count), matches.count);
  const Eigen::Matrix<double, 5, 5> lower = matrix.triangularView<Eigen::Lower>();
  EXPECT_LT((plain.matrix - lower).norm(), 1e-6 * lower.norm());
  EXPECT_LT((plain.gradient - gradient).norm(), 1e-6 * gradient.norm());
  EXPECT_NEAR(plain.cost, cost, 1e-9 * cost);
  for (const VectorPath path : VectorPaths()) {
    const EssentialNormal other = SumEssentialNormal(matches, in.model, in.tangent, kScale, kInfinity, path);
    EXPECT_EQ(other.matrix, plain.matrix);
    EXPECT_EQ(other.gradient, plain.gradient);
    EXPECT_EQ(other.cost, plain.cost);
    EXPECT_EQ(other.count, plain.count);
  }
}

/// A few millimetres of baseline: the cost is a valley along which the direction hardly matters.
TEST(FindEssentialMinima, FindsTheLowestWhereTheParallaxIsSmall) {
  SyntheticPairOptions options;
  options.translation = {0.05, 0.01, 0.015};
  int lowest = 0, near = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const SyntheticPair pair = MakeSyntheticPair(options, seed);
    std::vector<uint32_t> order(pair.matches.size());
    std::iota(order.begin(), order.end(), 0U);
    const MatchArrays arrays = MakeArrays(pair.matches, order, pair.camera, {});
    const std::vector<uint8_t> use(arrays.size(), 1);
    TwoViewModel truth{.R = pair.T_1_0.rotation.toRotationMatrix(), .t = pair.T_1_0.translation.normalized()};
    truth.M = Hat(truth.t) * truth.R;
    const PackedMatches matches(arrays, use);
    const auto minima = FindEssentialMinima(arrays, use, {.max_matches = 10000}, seed);
    ASSERT_FALSE(minima.empty());
    const double true_cost = SumEpipolarCost(matches, truth.M) / static_cast<double>(matches.count);
    lowest += minima.front().cost <= true_cost ? 1 : 0;
    near += std::abs(minima.front().model.t.dot(truth.t)) > std::cos(0.15) ? 1 : 0;
  }
  EXPECT_EQ(lowest, 20) << "the truth is no minimum, but no minimum lies higher than it";
  EXPECT_GE(near, 18);
}

TEST(SumEssentialNormal, EndsOnlyWhereTheCostIsNotBelowEnough) {
  const Input in;
  const PackedMatches matches(in.arrays, in.use);
  for (const VectorPath path : VectorPaths()) {
    const EssentialNormal all = SumEssentialNormal(matches, in.model, in.tangent, 1.0, kInfinity, path);
    const double above = std::nextafter(all.cost, kInfinity);
    EXPECT_EQ(SumEssentialNormal(matches, in.model, in.tangent, 1.0, above, path).matrix, all.matrix);
    const double half = 0.5 * all.cost;
    const EssentialNormal some = SumEssentialNormal(matches, in.model, in.tangent, 1.0, half, path);
    EXPECT_GE(some.cost, half);
    EXPECT_LT(some.count, all.count);
  }
}

TEST(SumEssentialNormal, LeavesOutWhatHasNoDenominator) {
  Input in;
  std::fill(in.arrays.bound0.begin(), in.arrays.bound0.begin() + 30, 0.0F);
  std::fill(in.arrays.bound1.begin(), in.arrays.bound1.begin() + 30, 0.0F);
  std::vector<uint8_t> rest = in.use;
  std::fill(rest.begin(), rest.begin() + 30, uint8_t{0});
  const PackedMatches all(in.arrays, in.use), some(in.arrays, rest);
  ASSERT_LT(some.count, all.count);
  for (const VectorPath path : VectorPaths()) {
    const EssentialNormal a = SumEssentialNormal(all, in.model, in.tangent, 1.0, kInfinity, path);
    const EssentialNormal b = SumEssentialNormal(some, in.model, in.tangent, 1.0, kInfinity, path);
    EXPECT_EQ(static_cast<size_t>(a.count), some.count);
    EXPECT_EQ(a.matrix, b.matrix);
    EXPECT_EQ(a.gradient, b.gradient);
  }
}

TEST(SumEssentialCost, IsThatOfTheNormalEquationsToTheLastBit) {
  const Input in;
  const PackedMatches matches(in.arrays, in.use);
  ASSERT_GT(matches.count, 200u);
  for (const double bound_scale : {1.0, 10.0, 100.0}) {
    const double all = SumEssentialNormal(matches, in.model, in.tangent, bound_scale).cost;
    for (const double enough : {kInfinity, all, 0.3 * all, 0.0}) {
      for (const VectorPath path : VectorPaths()) {
        const EssentialNormal normal =
            SumEssentialNormal(matches, in.model, in.tangent, bound_scale, enough, path);
        const EssentialCost cost = SumEssentialCost(matches, in.model, bound_scale, enough, path);
        EXPECT_EQ(cost.cost, normal.cost);
        EXPECT_EQ(cost.count, normal.count);
      }
    }
  }
}

TEST(SumRotationNormal, IsTheSumOfItsFormulaAndTheSameOnEveryPath) {
  const Input in;
  const PackedMatches matches(in.arrays, in.use);
  const UnitRays rays1(matches);
  Eigen::Matrix3d matrix = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < in.arrays.size(); ++i) {
    if (!in.use[i]) continue;
    const Eigen::Vector3d y = (in.model.R * in.arrays.ray0[i]).normalized(),
                          x = in.arrays.ray1[i].normalized();
    const double bound = static_cast<double>(in.arrays.bound0[i]) + static_cast<double>(in.arrays.bound1[i]);
    const double squared = (x - y).squaredNorm() / bound;
    const double weight = 1.0 / (bound * (1.0 + squared) * (1.0 + squared));
    matrix += weight * (Eigen::Matrix3d::Identity() - y * y.transpose());
    gradient += weight * y.cross(x);
  }
  const RotationNormal plain = SumRotationNormal(matches, rays1, in.model.R, VectorPath::kBaseline);
  const Eigen::Matrix3d lower = matrix.triangularView<Eigen::Lower>();
  EXPECT_LT((plain.matrix - lower).norm(), 1e-9 * lower.norm());
  EXPECT_LT((plain.gradient - gradient).norm(), 1e-9 * gradient.norm());
  for (const VectorPath path : VectorPaths()) {
    const RotationNormal other = SumRotationNormal(matches, rays1, in.model.R, path);
    EXPECT_EQ(other.matrix, plain.matrix);
    EXPECT_EQ(other.gradient, plain.gradient);
  }
}

TEST(SumEpipolarCost, IsExactBelowEnoughAndTheSameOnEveryPath) {
  const Input in;
  const PackedMatches matches(in.arrays, in.use);
  double expected = 0;
  for (size_t i = 0; i < in.arrays.size(); ++i) {
    const double squared = NormalizedSampson(in.model.M, in.arrays, i);
    if (in.use[i]) expected += squared / (1.0 + squared);
  }
  const double plain = SumEpipolarCost(matches, in.model.M, 1e300, VectorPath::kBaseline);
  EXPECT_NEAR(plain, expected, 1e-9 * expected);
  for (const VectorPath path : VectorPaths()) {
    EXPECT_EQ(SumEpipolarCost(matches, in.model.M, 1e300, path), plain);
    EXPECT_EQ(SumEpipolarCost(matches, in.model.M, plain * 1.0001, path), plain);
    EXPECT_GE(SumEpipolarCost(matches, in.model.M, plain / 2, path), plain / 2);
  }
}

}  // namespace
}  // namespace dmslam
