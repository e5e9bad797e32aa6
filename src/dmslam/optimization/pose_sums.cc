#include "dmslam/optimization/pose_sums.h"

#include <array>
#include <cmath>
#include <cstring>

namespace dmslam {
namespace {

constexpr double kCostBehind = 1e5;
constexpr size_t kLanes = 4;
constexpr size_t kBlock = 64;
using Lanes = double __attribute__((vector_size(sizeof(double) * kLanes)));
struct alignas(Lanes) Column : std::array<double, kBlock> {};

constexpr size_t WholeVectors(size_t n) { return (n + kLanes - 1) / kLanes * kLanes; }

/// Observations that take part, packed, with whatever is behind the last one of a whole vector.
struct PackedObservations {
  Column x{}, y{}, z{}, u{}, v{}, inv_sigma_squared{}, weight{};
};

/// What makes up an observation's part of the normal equations: the rows of the Jacobian but for their zeros
/// (elements 0, 1, 2, 3 and 5 of u's, and 0, 1, 2, 4 and 5 of v's), the errors, and the depth.
struct PoseTerms {
  Column u0, u1, u2, u3, u5, error_u, v0, v1, v2, v4, v5, error_v;
  Column chi2, weight, cost, depth;
};

/// Packs the next ones of those in use, from `next` on; returns how many.
[[gnu::always_inline]] inline size_t Pack(std::span<const PoseObservation> observations,
                                          std::span<const char> use, size_t* next,
                                          PackedObservations* packed) {
  size_t n = 0, i = *next;
  for (; i < observations.size() && n < kBlock; ++i) {
    if (!use[i]) continue;
    const PoseObservation& o = observations[i];
    packed->x[n] = o.p_world.x();
    packed->y[n] = o.p_world.y();
    packed->z[n] = o.p_world.z();
    packed->u[n] = o.uv_px.x();
    packed->v[n] = o.uv_px.y();
    packed->inv_sigma_squared[n] = o.inv_sigma_squared;
    packed->weight[n] = o.weight;
    ++n;
  }
  *next = i;
  return n;
}

/// For `n` observations, without robust loss. Sums of three as Eigen takes them: (a + b) + c, but for the
/// third row of a product with R, a + (b + c).
[[gnu::always_inline]] inline void MakeTerms(const PackedObservations& o, size_t n, const Pinhole& camera,
                                             const Eigen::Matrix3d& R, const Eigen::Vector3d& t,
                                             PoseTerms* out) {
  const double r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2),
               r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
  const double t0 = t.x(), t1 = t.y(), t2 = t.z();
  const double fx = camera.fx_px, fy = camera.fy_px, cx = camera.cx_px, cy = camera.cy_px;
  for (size_t k = 0; k < WholeVectors(n); ++k) {
    const double p0 = r00 * o.x[k] + r01 * o.y[k] + r02 * o.z[k] + t0;
    const double p1 = r10 * o.x[k] + r11 * o.y[k] + r12 * o.z[k] + t1;
    const double p2 = r20 * o.x[k] + (r21 * o.y[k] + r22 * o.z[k]) + t2;
    const double w = 1.0 / p2, x = p0 * w, y = p1 * w;
    const double eu = fx * x + cx - o.u[k], ev = fy * y + cy - o.v[k];
    out->u0[k] = -fx * x * y;
    out->u1[k] = fx * (1.0 + x * x);
    out->u2[k] = -fx * y;
    out->u3[k] = fx * w;
    out->u5[k] = -fx * x * w;
    out->v0[k] = -fy * (1.0 + y * y);
    out->v1[k] = fy * x * y;
    out->v2[k] = fy * x;
    out->v4[k] = fy * w;
    out->v5[k] = -fy * y * w;
    out->error_u[k] = eu;
    out->error_v[k] = ev;
    const double chi2 = (eu * eu + ev * ev) * o.inv_sigma_squared[k];
    out->chi2[k] = chi2;
    out->weight[k] = o.weight[k] * o.inv_sigma_squared[k];
    out->cost[k] = o.weight[k] * chi2;
    out->depth[k] = p2;
  }
}

/// Huber's loss, and its slope, for those that are far off.
[[gnu::always_inline]] inline void MakeRobust(const PackedObservations& o, size_t n, double huber_chi2,
                                              PoseTerms* terms) {
  for (size_t k = 0; k < n; ++k) {
    const double chi2 = terms->chi2[k];
    if (chi2 <= huber_chi2) continue;
    const double ratio = std::sqrt(huber_chi2 / chi2);
    terms->weight[k] *= ratio;
    terms->cost[k] = o.weight[k] * (2.0 * chi2 * ratio - huber_chi2);
  }
}

/// The sums while they grow. Of a row of the Jacobian the first four elements are one vector, the last two
/// with the error another; `first` has the rows of the matrix as far as they lie in the first four columns,
/// `last` what is right of that, and the gradient.
struct PoseSums {
  std::array<Lanes, 4> first{};
  std::array<Lanes, 6> last{};
  double cost = 0;
};

/// Adds a row of the Jacobian: that of u, whose fifth element is zero and adds nothing, or that of v, whose
/// fourth is.
template <bool kOfU>
[[gnu::always_inline]] inline void AddRow(const Lanes& first, const Lanes& last, double weight, PoseSums* s) {
  const Lanes weighted = first * weight, weighted_last = last * weight;
  const Lanes w0 = __builtin_shufflevector(weighted, weighted, 0, 0, 0, 0),
              w1 = __builtin_shufflevector(weighted, weighted, 1, 1, 1, 1),
              w2 = __builtin_shufflevector(weighted, weighted, 2, 2, 2, 2),
              w5 = __builtin_shufflevector(weighted_last, weighted_last, 1, 1, 1, 1);
  s->first[0] += w0 * first;
  s->last[0] += w0 * last;
  s->first[1] += w1 * first;
  s->last[1] += w1 * last;
  s->first[2] += w2 * first;
  s->last[2] += w2 * last;
  if constexpr (kOfU) {
    const Lanes w3 = __builtin_shufflevector(weighted, weighted, 3, 3, 3, 3);
    s->first[3] += w3 * first;
    s->last[3] += w3 * last;
  } else {
    const Lanes w4 = __builtin_shufflevector(weighted_last, weighted_last, 0, 0, 0, 0);
    s->last[4] += w4 * last;
  }
  s->last[5] += w5 * last;
}

/// Four elements of four observations each, to one observation each.
using Rows = std::array<Lanes, kLanes>;
[[gnu::always_inline]] inline void Transpose(const Lanes& a, const Lanes& b, const Lanes& c, const Lanes& d,
                                             Rows* rows) {
  const Lanes ab_even = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  const Lanes ab_odd = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Lanes cd_even = __builtin_shufflevector(c, d, 0, 4, 2, 6);
  const Lanes cd_odd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  (*rows)[0] = __builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5);
  (*rows)[1] = __builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5);
  (*rows)[2] = __builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7);
  (*rows)[3] = __builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7);
}

/// A vector of each column's, from the same place on.
template <typename... Column>
[[gnu::always_inline]] inline void LoadAt(size_t k, Lanes* first, const Column&... columns) {
  (std::memcpy(first++, &columns[k], sizeof(Lanes)), ...);
}

[[gnu::always_inline]] inline void AddTerms(const PackedObservations& o, const PoseTerms& t, size_t n,
                                            PoseSums* sums) {
  PoseSums s = *sums;
  const Lanes zero{};
  for (size_t k = 0; k < n; k += kLanes) {
    Lanes u[6], v[6];
    LoadAt(k, u, t.u0, t.u1, t.u2, t.u3, t.u5, t.error_u);
    LoadAt(k, v, t.v0, t.v1, t.v2, t.v4, t.v5, t.error_v);
    Rows u_first, u_last, v_first, v_last;
    Transpose(u[0], u[1], u[2], u[3], &u_first);
    Transpose(zero, u[4], u[5], zero, &u_last);
    Transpose(v[0], v[1], v[2], zero, &v_first);
    Transpose(v[3], v[4], v[5], zero, &v_last);
    for (size_t i = 0; i < kLanes && k + i < n; ++i) {
      if (!(t.depth[k + i] > kMinDepth)) {
        s.cost += o.weight[k + i] * kCostBehind;
        continue;
      }
      AddRow<true>(u_first[i], u_last[i], t.weight[k + i], &s);
      AddRow<false>(v_first[i], v_last[i], t.weight[k + i], &s);
      s.cost += t.cost[k + i];
    }
  }
  *sums = s;
}

PoseEquations ToEquations(const PoseSums& sums) {
  PoseEquations equations;
  for (int i = 0; i < 6; ++i) {
    const size_t row = static_cast<size_t>(i);
    for (int j = i; j < 6; ++j)
      equations.hessian(i, j) = equations.hessian(j, i) = j < 4 ? sums.first[row][j] : sums.last[row][j - 4];
    equations.gradient[i] = sums.last[row][2];
  }
  equations.cost = sums.cost;
  return equations;
}

[[gnu::always_inline]] inline PoseEquations SumEquations(const Pinhole& camera, const Rigid3d& T,
                                                         std::span<const PoseObservation> observations,
                                                         std::span<const char> use, double huber_chi2) {
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  PackedObservations packed;
  PoseTerms terms;
  PoseSums sums;
  for (size_t next = 0; next < observations.size();) {
    const size_t n = Pack(observations, use, &next, &packed);
    MakeTerms(packed, n, camera, R, T.translation, &terms);
    if (huber_chi2 < std::numeric_limits<double>::infinity()) MakeRobust(packed, n, huber_chi2, &terms);
    AddTerms(packed, terms, n, &sums);
  }
  return ToEquations(sums);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) PoseEquations SumEquationsAvx2(const Pinhole& camera, const Rigid3d& T,
                                                               std::span<const PoseObservation> observations,
                                                               std::span<const char> use, double huber_chi2) {
  return SumEquations(camera, T, observations, use, huber_chi2);
}

DMSLAM_AVX512 PoseEquations SumEquationsAvx512(const Pinhole& camera, const Rigid3d& T,
                                               std::span<const PoseObservation> observations,
                                               std::span<const char> use, double huber_chi2) {
  return SumEquations(camera, T, observations, use, huber_chi2);
}
#endif

}  // namespace

PoseEquations SumPoseEquations(const Pinhole& camera, const Rigid3d& T_cam_world,
                               std::span<const PoseObservation> observations, std::span<const char> use,
                               double huber_chi2, [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, path))
    return SumEquationsAvx512(camera, T_cam_world, observations, use, huber_chi2);
  if (Takes(VectorPath::kAvx2, path))
    return SumEquationsAvx2(camera, T_cam_world, observations, use, huber_chi2);
#endif
  return SumEquations(camera, T_cam_world, observations, use, huber_chi2);
}

}  // namespace dmslam
