#include "dmslam/motion_segmentation/epipolar_sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {
namespace {

constexpr size_t kLanes = 4;
constexpr size_t kBlock = 64;
using Lanes = double __attribute__((vector_size(sizeof(double) * kLanes)));
using Column = std::array<double, kBlock>;

constexpr size_t WholeVectors(size_t n) { return (n + kLanes - 1) / kLanes * kLanes; }

/// What makes up a match's part of the normal equations: row of the Jacobian (four elements and the last),
/// residual, Sampson's denominator.
struct Terms {
  std::array<Column, 4> row;
  Column last, residual, bound, weight, cost;
};

/// For `n` matches from `begin` on; without `kRows` residual and bound alone. A sum of three is (a + b) + c,
/// but for the third row of a product with M or R, a + (b + c).
template <bool kRows>
[[gnu::always_inline]] inline void MakeTerms(const PackedMatches& a, size_t begin, size_t n,
                                             const TwoViewModel& model, const Eigen::Matrix3d& M,
                                             const Eigen::Matrix<double, 3, 2>& B, double bound_scale,
                                             Terms* out) {
  const double m00 = M(0, 0), m01 = M(0, 1), m02 = M(0, 2), m10 = M(1, 0), m11 = M(1, 1), m12 = M(1, 2),
               m20 = M(2, 0), m21 = M(2, 1);
  const Eigen::Matrix3d& R = model.R;
  const double r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2),
               r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
  const double t0 = model.t[0], t1 = model.t[1], t2 = model.t[2];
  const double u0 = B(0, 0), u1 = B(1, 0), u2 = B(2, 0), v0 = B(0, 1), v1 = B(1, 1), v2 = B(2, 1);
  for (size_t k = 0; k < WholeVectors(n); ++k) {
    const double px = a.x0[begin + k], py = a.y0[begin + k], qx = a.x1[begin + k], qy = a.y1[begin + k];
    // Sampson's denominator.
    const double lx = m00 * px + m01 * py + m02, ly = m10 * px + m11 * py + m12;
    const double kx = m00 * qx + m10 * qy + m20, ky = m01 * qx + m11 * qy + m21;
    const double b1 = bound_scale * a.bound1[begin + k], b0 = bound_scale * a.bound0[begin + k];
    const double bound = b1 * (lx * lx + ly * ly) + b0 * (kx * kx + ky * ky);
    // y = R ray0, normal = y x ray1, turned = ray1 x t.
    const double y0 = r00 * px + r01 * py + r02, y1 = r10 * px + r11 * py + r12,
                 y2 = r20 * px + (r21 * py + r22);
    const double n0 = y1 - y2 * qy, n1 = y2 * qx - y0, n2 = y0 * qy - y1 * qx;
    const double c0 = qy * t2 - t1, c1 = t0 - qx * t2, c2 = qx * t1 - qy * t0;
    const double residual = t0 * n0 + t1 * n1 + t2 * n2;
    out->residual[k] = residual;
    out->bound[k] = bound;
    if constexpr (!kRows) continue;
    // The denominator changes with the parameters, too: half its derivative is b1 (y x l) + b0 (z x ray1)
    // along t and b1 (y x (l x t)) + b0 (z x turned) along the rotation, l and k the two lines, z = R k.
    const double z0 = r00 * kx + r01 * ky, z1 = r10 * kx + r11 * ky, z2 = r20 * kx + r21 * ky;
    const double s0 = ly * t2, s1 = 0.0 - lx * t2, s2 = lx * t1 - ly * t0;
    const double shrink = residual / bound, f1 = shrink * b1, f0 = shrink * b0;
    const double w0 = n0 - (f0 * (z1 - z2 * qy) - f1 * (y2 * ly));
    const double w1 = n1 - (f0 * (z2 * qx - z0) + f1 * (y2 * lx));
    const double w2 = n2 - (f0 * (z0 * qy - z1 * qx) + f1 * (y0 * ly - y1 * lx));
    out->row[0][k] = y1 * c2 - y2 * c1 - (f1 * (y1 * s2 - y2 * s1) + f0 * (z1 * c2 - z2 * c1));
    out->row[1][k] = y2 * c0 - y0 * c2 - (f1 * (y2 * s0 - y0 * s2) + f0 * (z2 * c0 - z0 * c2));
    out->row[2][k] = y0 * c1 - y1 * c0 - (f1 * (y0 * s1 - y1 * s0) + f0 * (z0 * c1 - z1 * c0));
    out->row[3][k] = u0 * w0 + u1 * w1 + u2 * w2;
    out->last[k] = v0 * w0 + v1 * w1 + v2 * w2;
  }
}

/// Weights by Geman-McClure of `n` matches, and their residuals times that. A loop of its own, as its
/// divisions take long to arrive.
[[gnu::always_inline]] inline void WeighTerms(size_t n, Terms* terms) {
  for (size_t k = 0; k < WholeVectors(n); ++k) {
    const double residual = terms->residual[k], bound = terms->bound[k];
    const double squared = residual * residual / bound;
    const double weight = 1.0 / (bound * (1.0 + squared) * (1.0 + squared));
    terms->weight[k] = weight;
    terms->residual[k] = weight * residual;
    terms->cost[k] = squared * (1.0 + squared) * (bound * weight);
  }
}

/// The sums while they grow: columns 0 to 3 of the matrix (rows 0 to 3), its row 4, the gradient, and the
/// last elements of both.
struct Sums {
  Lanes column0{}, column1{}, column2{}, column3{}, last_row{}, gradient{}, ends{};
  double cost = 0;
  int count = 0;
};

[[gnu::always_inline]] inline void AddMatch(const Terms& terms, size_t k, const Lanes& row, Sums* s) {
  if (!(terms.bound[k] > 0)) return;
  const Lanes weighted = row * terms.weight[k];
  const double last = terms.last[k], residual = terms.residual[k];
  s->column0 += row * __builtin_shufflevector(weighted, weighted, 0, 0, 0, 0);
  s->column1 += row * __builtin_shufflevector(weighted, weighted, 1, 1, 1, 1);
  s->column2 += row * __builtin_shufflevector(weighted, weighted, 2, 2, 2, 2);
  s->column3 += row * __builtin_shufflevector(weighted, weighted, 3, 3, 3, 3);
  s->last_row += weighted * last;
  s->gradient += row * residual;
  s->ends += Lanes{terms.weight[k] * last, residual, 0, 0} * last;
  s->cost += terms.cost[k];
  ++s->count;
}

[[gnu::always_inline]] inline void AddTerms(const Terms& terms, size_t n, Sums* sums) {
  Sums s = *sums;
  for (size_t k = 0; k < n; k += kLanes) {
    Lanes a, b, c, d;  // one element of four matches each; transposed: one match each
    std::memcpy(&a, &terms.row[0][k], sizeof a);
    std::memcpy(&b, &terms.row[1][k], sizeof b);
    std::memcpy(&c, &terms.row[2][k], sizeof c);
    std::memcpy(&d, &terms.row[3][k], sizeof d);
    const Lanes ab_even = __builtin_shufflevector(a, b, 0, 4, 2, 6);
    const Lanes ab_odd = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    const Lanes cd_even = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    const Lanes cd_odd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    AddMatch(terms, k, __builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5), &s);
    if (k + 1 < n) AddMatch(terms, k + 1, __builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5), &s);
    if (k + 2 < n) AddMatch(terms, k + 2, __builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7), &s);
    if (k + 3 < n) AddMatch(terms, k + 3, __builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7), &s);
  }
  *sums = s;
}

[[gnu::always_inline]] inline EssentialNormal SumNormal(const PackedMatches& matches,
                                                        const TwoViewModel& model,
                                                        const Eigen::Matrix<double, 3, 2>& B,
                                                        double bound_scale, double enough) {
  const Eigen::Matrix3d M = Hat(model.t) * model.R;
  Terms terms;
  Sums sums;
  for (size_t begin = 0; begin < matches.count && !(sums.cost >= enough); begin += kBlock) {
    const size_t n = std::min(kBlock, matches.count - begin);
    MakeTerms<true>(matches, begin, n, model, M, B, bound_scale, &terms);
    WeighTerms(n, &terms);
    AddTerms(terms, n, &sums);
  }
  EssentialNormal normal;
  normal.matrix.setZero();
  const std::array<const Lanes*, 4> columns{&sums.column0, &sums.column1, &sums.column2, &sums.column3};
  for (int c = 0; c < 4; ++c) {
    for (int r = c; r < 4; ++r) normal.matrix(r, c) = (*columns[static_cast<size_t>(c)])[r];
    normal.matrix(4, c) = sums.last_row[c];
    normal.gradient(c) = sums.gradient[c];
  }
  normal.matrix(4, 4) = sums.ends[0];
  normal.gradient(4) = sums.ends[1];
  normal.cost = sums.cost;
  normal.count = sums.count;
  return normal;
}

[[gnu::always_inline]] inline EssentialCost SumCostOfNormal(const PackedMatches& matches,
                                                            const TwoViewModel& model, double bound_scale,
                                                            double enough) {
  const Eigen::Matrix3d M = Hat(model.t) * model.R;
  const Eigen::Matrix<double, 3, 2> no_tangent = Eigen::Matrix<double, 3, 2>::Zero();
  Terms terms;
  EssentialCost sum;
  for (size_t begin = 0; begin < matches.count && !(sum.cost >= enough); begin += kBlock) {
    const size_t n = std::min(kBlock, matches.count - begin);
    MakeTerms<false>(matches, begin, n, model, M, no_tangent, bound_scale, &terms);
    WeighTerms(n, &terms);
    for (size_t k = 0; k < n; ++k) {
      if (!(terms.bound[k] > 0)) continue;
      sum.cost += terms.cost[k];
      ++sum.count;
    }
  }
  return sum;
}

/// What one match adds to the rotation's normal equations: the lower half of the matrix column by column,
/// then the gradient.
using RotationTerms = std::array<Column, 9>;

[[gnu::always_inline]] inline void MakeRotationTerms(const PackedMatches& a, const UnitRays& rays1,
                                                     size_t begin, size_t n, const Eigen::Matrix3d& R,
                                                     RotationTerms* out) {
  const double r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2),
               r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
  for (size_t k = 0; k < WholeVectors(n); ++k) {
    const double px = a.x0[begin + k], py = a.y0[begin + k];
    const double l0 = r00 * px + r01 * py + r02, l1 = r10 * px + r11 * py + r12,
                 l2 = r20 * px + (r21 * py + r22);
    const double length = std::sqrt(l0 * l0 + l1 * l1 + l2 * l2);
    const double y0 = l0 / length, y1 = l1 / length, y2 = l2 / length;
    const double x0 = rays1.x[begin + k], x1 = rays1.y[begin + k], x2 = rays1.z[begin + k];
    const double d0 = x0 - y0, d1 = x1 - y1, d2 = x2 - y2, bound = rays1.bound[begin + k];
    const double squared = (d0 * d0 + d1 * d1 + d2 * d2) / bound;
    const double weight = 1.0 / (bound * (1.0 + squared) * (1.0 + squared));
    (*out)[0][k] = weight * (1.0 - y0 * y0);
    (*out)[1][k] = weight * (0.0 - y1 * y0);
    (*out)[2][k] = weight * (0.0 - y2 * y0);
    (*out)[3][k] = weight * (1.0 - y1 * y1);
    (*out)[4][k] = weight * (0.0 - y2 * y1);
    (*out)[5][k] = weight * (1.0 - y2 * y2);
    (*out)[6][k] = weight * (y1 * x2 - y2 * x1);
    (*out)[7][k] = weight * (y2 * x0 - y0 * x2);
    (*out)[8][k] = weight * (y0 * x1 - y1 * x0);
  }
}

[[gnu::always_inline]] inline RotationNormal SumRotation(const PackedMatches& matches, const UnitRays& rays1,
                                                         const Eigen::Matrix3d& R) {
  constexpr double kDamping = 1e-9;
  std::array<double, 9> sum{kDamping, 0, 0, kDamping, 0, kDamping, 0, 0, 0};
  RotationTerms terms;
  for (size_t begin = 0; begin < matches.count; begin += kBlock) {
    const size_t n = std::min(kBlock, matches.count - begin);
    MakeRotationTerms(matches, rays1, begin, n, R, &terms);
    for (size_t k = 0; k < n; ++k) {
      for (size_t c = 0; c < 9; ++c) sum[c] += terms[c][k];
    }
  }
  RotationNormal normal;
  normal.matrix << sum[0], 0, 0, sum[1], sum[3], 0, sum[2], sum[4], sum[5];
  normal.gradient << sum[6], sum[7], sum[8];
  return normal;
}

constexpr size_t kCostBlock = 32;  // small, as most sums end early

[[gnu::always_inline]] inline double SumCost(const PackedMatches& a, const Eigen::Matrix3d& M,
                                             double enough) {
  const double m00 = M(0, 0), m01 = M(0, 1), m02 = M(0, 2), m10 = M(1, 0), m11 = M(1, 1), m12 = M(1, 2),
               m20 = M(2, 0), m21 = M(2, 1), m22 = M(2, 2);
  double sum = 0;
  Column cost;
  for (size_t begin = 0; begin < a.count && !(sum >= enough); begin += kCostBlock) {
    const size_t n = std::min(kCostBlock, a.count - begin);
    for (size_t k = 0; k < WholeVectors(n); ++k) {
      const double px = a.x0[begin + k], py = a.y0[begin + k], qx = a.x1[begin + k], qy = a.y1[begin + k];
      const double lx = m00 * px + m01 * py + m02, ly = m10 * px + m11 * py + m12,
                   lz = m20 * px + (m21 * py + m22);
      const double kx = m00 * qx + m10 * qy + m20, ky = m01 * qx + m11 * qy + m21;
      const double e = qx * lx + qy * ly + lz;
      const double bound =
          a.bound1[begin + k] * (lx * lx + ly * ly) + a.bound0[begin + k] * (kx * kx + ky * ky);
      const double squared = bound > 0 ? e * e / bound : 1e30;
      cost[k] = squared / (1.0 + squared);
    }
    for (size_t k = 0; k < n; ++k) sum += cost[k];
  }
  return sum;
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) EssentialNormal SumNormalAvx2(const PackedMatches& matches,
                                                              const TwoViewModel& model,
                                                              const Eigen::Matrix<double, 3, 2>& B,
                                                              double bound_scale, double enough) {
  return SumNormal(matches, model, B, bound_scale, enough);
}
__attribute__((target("avx2"))) EssentialCost SumCostOfNormalAvx2(const PackedMatches& matches,
                                                                  const TwoViewModel& model,
                                                                  double bound_scale, double enough) {
  return SumCostOfNormal(matches, model, bound_scale, enough);
}
__attribute__((target("avx2"))) RotationNormal SumRotationAvx2(const PackedMatches& matches,
                                                               const UnitRays& rays1,
                                                               const Eigen::Matrix3d& R) {
  return SumRotation(matches, rays1, R);
}
__attribute__((target("avx2"))) double SumCostAvx2(const PackedMatches& matches, const Eigen::Matrix3d& M,
                                                   double enough) {
  return SumCost(matches, M, enough);
}

DMSLAM_AVX512 EssentialNormal SumNormalAvx512(const PackedMatches& matches, const TwoViewModel& model,
                                              const Eigen::Matrix<double, 3, 2>& B, double bound_scale,
                                              double enough) {
  return SumNormal(matches, model, B, bound_scale, enough);
}
DMSLAM_AVX512 EssentialCost SumCostOfNormalAvx512(const PackedMatches& matches, const TwoViewModel& model,
                                                  double bound_scale, double enough) {
  return SumCostOfNormal(matches, model, bound_scale, enough);
}
DMSLAM_AVX512 RotationNormal SumRotationAvx512(const PackedMatches& matches, const UnitRays& rays1,
                                               const Eigen::Matrix3d& R) {
  return SumRotation(matches, rays1, R);
}
DMSLAM_AVX512 double SumCostAvx512(const PackedMatches& matches, const Eigen::Matrix3d& M, double enough) {
  return SumCost(matches, M, enough);
}
#endif

}  // namespace

PackedMatches::PackedMatches(const MatchArrays& arrays, std::span<const uint8_t> use) {
  std::vector<uint32_t> index(use.size() + 1);
  for (size_t i = 0; i < use.size(); ++i) {
    index[count] = static_cast<uint32_t>(i);
    count += use[i] ? 1 : 0;
  }
  for (auto* array : {&x0, &y0, &x1, &y1, &bound0, &bound1}) array->resize(WholeVectors(count));
  for (size_t k = 0; k < count; ++k) {
    const size_t i = index[k];
    x0[k] = arrays.p0[i].x();
    y0[k] = arrays.p0[i].y();
    x1[k] = arrays.p1[i].x();
    y1[k] = arrays.p1[i].y();
    bound0[k] = arrays.bound0[i];
    bound1[k] = arrays.bound1[i];
  }
}

UnitRays::UnitRays(const PackedMatches& matches) {
  for (auto* array : {&x, &y, &z, &bound}) array->resize(matches.x1.size());
  for (size_t k = 0; k < x.size(); ++k) {
    const double length = std::sqrt(matches.x1[k] * matches.x1[k] + matches.y1[k] * matches.y1[k] + 1.0);
    x[k] = matches.x1[k] / length;
    y[k] = matches.y1[k] / length;
    z[k] = 1.0 / length;
    bound[k] = matches.bound0[k] + matches.bound1[k];
  }
}

EssentialNormal SumEssentialNormal(const PackedMatches& matches, const TwoViewModel& model,
                                   const Eigen::Matrix<double, 3, 2>& tangent, double bound_scale,
                                   double enough, [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, path)) return SumNormalAvx512(matches, model, tangent, bound_scale, enough);
  if (Takes(VectorPath::kAvx2, path)) return SumNormalAvx2(matches, model, tangent, bound_scale, enough);
#endif
  return SumNormal(matches, model, tangent, bound_scale, enough);
}

EssentialCost SumEssentialCost(const PackedMatches& matches, const TwoViewModel& model, double bound_scale,
                               double enough, [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, path)) return SumCostOfNormalAvx512(matches, model, bound_scale, enough);
  if (Takes(VectorPath::kAvx2, path)) return SumCostOfNormalAvx2(matches, model, bound_scale, enough);
#endif
  return SumCostOfNormal(matches, model, bound_scale, enough);
}

RotationNormal SumRotationNormal(const PackedMatches& matches, const UnitRays& rays1,
                                 const Eigen::Matrix3d& R, [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, path)) return SumRotationAvx512(matches, rays1, R);
  if (Takes(VectorPath::kAvx2, path)) return SumRotationAvx2(matches, rays1, R);
#endif
  return SumRotation(matches, rays1, R);
}

double SumEpipolarCost(const PackedMatches& matches, const Eigen::Matrix3d& M, double enough,
                       [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, path)) return SumCostAvx512(matches, M, enough);
  if (Takes(VectorPath::kAvx2, path)) return SumCostAvx2(matches, M, enough);
#endif
  return SumCost(matches, M, enough);
}

}  // namespace dmslam
