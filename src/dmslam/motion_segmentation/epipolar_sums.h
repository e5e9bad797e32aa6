#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {

/// The matches that take part in a descent, packed: one array for each coordinate of their rays (z = 1) and
/// each bound, padded with zeros to whole vectors.
struct PackedMatches {
  std::vector<double> x0, y0, x1, y1;
  std::vector<double> bound0, bound1;
  size_t count = 0;

  PackedMatches(const MatchArrays& arrays, std::span<const uint8_t> use);
};

// Sums over matches are taken in vector code across a match's terms and, for the terms themselves, across
// matches; each sum is added up match by match in their order. So every path gives the same bits.

/// Normal equations of Sampson's distance, t . (R ray0 x ray1) over the root of its variance, each match
/// weighted by Geman-McClure's factor: three parameters of a left rotation, then two of t along `tangent`.
/// The variance is differentiated, too: with little parallax the minimum is elsewhere without.
struct EssentialNormal {
  Eigen::Matrix<double, 5, 5> matrix;  ///< lower half
  Eigen::Matrix<double, 5, 1> gradient;
  double cost = 0;  ///< sum of s / (1 + s), s the squared distance over its bound
  int count = 0;    ///< matches with a denominator above zero, which take part
};
/// `bound_scale` widens the robust cost's bounds (squared). Where the cost is not below `enough`, the sums
/// may be of some of the matches only, with some cost from `enough` up.
EssentialNormal SumEssentialNormal(const PackedMatches& matches, const TwoViewModel& model,
                                   const Eigen::Matrix<double, 3, 2>& tangent, double bound_scale,
                                   double enough = std::numeric_limits<double>::infinity(),
                                   VectorPath path = VectorPath::kWidest);

/// The cost and the count of SumEssentialNormal alone, the same to the last bit.
struct EssentialCost {
  double cost = 0;
  int count = 0;
};
EssentialCost SumEssentialCost(const PackedMatches& matches, const TwoViewModel& model, double bound_scale,
                               double enough = std::numeric_limits<double>::infinity(),
                               VectorPath path = VectorPath::kWidest);

/// Rays of frame 1, made unit vectors, and the sum of both bounds; parallel to PackedMatches.
struct UnitRays {
  std::vector<double> x, y, z, bound;
  explicit UnitRays(const PackedMatches& matches);
};

/// Normal equations of a left rotation of `R` that takes unit rays of frame 0 into those of frame 1, each
/// match weighted by its bound and Geman-McClure's factor.
struct RotationNormal {
  Eigen::Matrix3d matrix;  ///< lower half
  Eigen::Vector3d gradient;
};
RotationNormal SumRotationNormal(const PackedMatches& matches, const UnitRays& rays1,
                                 const Eigen::Matrix3d& R, VectorPath path = VectorPath::kWidest);

/// Sum of s / (1 + s), s the normalised Sampson distance, where it is below `enough`; else some number from
/// `enough` up.
double SumEpipolarCost(const PackedMatches& matches, const Eigen::Matrix3d& M,
                       double enough = std::numeric_limits<double>::infinity(),
                       VectorPath path = VectorPath::kWidest);

}  // namespace dmslam
