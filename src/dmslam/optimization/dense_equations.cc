#include "dmslam/optimization/dense_equations.h"

#include <Eigen/LU>
#include <algorithm>
#include <cstring>

#include "dmslam/optimization/bundle_solver.h"

namespace dmslam {
namespace {

constexpr size_t kPointSize = 3;

template <size_t kLanes>
using DoublesOf = double __attribute__((vector_size(sizeof(double) * kLanes)));

/// A pose's six numbers in as few vectors as hold them.
template <typename Vector>
struct SixNumbers {
  static constexpr size_t kVectors = (kPoseSize * sizeof(double) + sizeof(Vector) - 1) / sizeof(Vector);
  std::array<Vector, kVectors> part;

  [[gnu::always_inline]] void Load(const PoseColumn& from) {
    std::memcpy(part.data(), from.row.data(), sizeof(part));
  }
  [[gnu::always_inline]] void Store(PoseColumn* to) const {
    std::memcpy(to->row.data(), part.data(), sizeof(part));
  }
  /// this = a x + b y.
  [[gnu::always_inline]] void Set(const SixNumbers& a, double x, const SixNumbers& b, double y) {
    for (size_t i = 0; i < kVectors; ++i) part[i] = a.part[i] * x + b.part[i] * y;
  }
  /// this = a x + b y + c z.
  [[gnu::always_inline]] void Set(const SixNumbers& a, double x, const SixNumbers& b, double y,
                                  const SixNumbers& c, double z) {
    for (size_t i = 0; i < kVectors; ++i) part[i] = a.part[i] * x + b.part[i] * y + c.part[i] * z;
  }
  [[gnu::always_inline]] void AddTo(PoseColumn* to) const {
    SixNumbers sum;
    sum.Load(*to);
    for (size_t i = 0; i < kVectors; ++i) sum.part[i] += part[i];
    sum.Store(to);
  }
  [[gnu::always_inline]] void TakeFrom(PoseColumn* to) const {
    SixNumbers rest;
    rest.Load(*to);
    for (size_t i = 0; i < kVectors; ++i) rest.part[i] -= part[i];
    rest.Store(to);
  }
};

/// What the views of some points say, each number of all sights in a row. By the pose, the fifth of u's and
/// the fourth of v's is zero; by the point in the camera, the second of u's and the first of v's.
constexpr size_t kSightsAtOnce = 64;
struct alignas(64) OfSights : std::array<double, kSightsAtOnce> {};
struct SightTerms {
  std::array<OfSights, 9> R;                            // column by column
  OfSights x, y, z, t0, t1, t2, u_px, v_px, inv_sigma;  // points in the map, translations
  OfSights x_cam, y_cam, depth, inverse_depth, error_u, error_v, weight;
  OfSights u0, u1, u2, u3, u5, v0, v1, v2, v4, v5;    // by the pose, over the standard deviation
  std::array<OfSights, kPointSize> point_u, point_v;  // by the point in the map, likewise
};

/// Sights `begin` to `end`, with the places of poses and points. `point`: that of the first one, then of the
/// last.
[[gnu::always_inline]] inline void Collect(const BundleSights& sights, const BundlePlace& place, size_t begin,
                                           size_t end, size_t* point, SightTerms* terms) {
  for (size_t k = begin; k < end; ++k) {
    while (k >= sights.first[*point + 1]) ++*point;
    const BundleSight& sight = sights.all[k];
    const Eigen::Matrix3d& R = place.rotations[sight.pose];
    const Eigen::Vector3d& t = place.T_cam_world[sight.pose].translation;
    const Eigen::Vector3d& p = place.points[*point];
    const size_t n = k - begin;
    for (size_t i = 0; i < terms->R.size(); ++i) terms->R[i][n] = R.data()[i];
    terms->x[n] = p.x();
    terms->y[n] = p.y();
    terms->z[n] = p.z();
    terms->t0[n] = t.x();
    terms->t1[n] = t.y();
    terms->t2[n] = t.z();
    terms->u_px[n] = sight.uv_px.x();
    terms->v_px[n] = sight.uv_px.y();
    terms->inv_sigma[n] = sight.inv_sigma;
  }
}

/// Points in the cameras (x and y over the depth), and errors. Sums of three as Eigen takes them (see
/// pose_sums.cc).
[[gnu::always_inline]] inline void MakeErrors(const Pinhole& camera, size_t n, SightTerms* terms) {
  SightTerms& s = *terms;
  const double fx = camera.fx_px, fy = camera.fy_px, cx = camera.cx_px, cy = camera.cy_px;
  for (size_t k = 0; k < n; ++k) {
    const double p0 = s.R[0][k] * s.x[k] + s.R[3][k] * s.y[k] + s.R[6][k] * s.z[k] + s.t0[k];
    const double p1 = s.R[1][k] * s.x[k] + s.R[4][k] * s.y[k] + s.R[7][k] * s.z[k] + s.t1[k];
    const double p2 = s.R[2][k] * s.x[k] + (s.R[5][k] * s.y[k] + s.R[8][k] * s.z[k]) + s.t2[k];
    const double w = 1.0 / p2;
    s.depth[k] = p2;
    s.inverse_depth[k] = w;
    s.x_cam[k] = p0 * w;
    s.y_cam[k] = p1 * w;
    s.error_u[k] = fx * p0 * w + cx - s.u_px[k];
    s.error_v[k] = fy * p1 * w + cy - s.v_px[k];
  }
}

/// Divides the errors by their standard deviation, and adds what they depend on.
[[gnu::always_inline]] inline void MakeTerms(const Pinhole& camera, const BundleRobustLoss& loss, size_t n,
                                             SightTerms* terms) {
  SightTerms& s = *terms;
  const double fx = camera.fx_px, fy = camera.fy_px;
  for (size_t k = 0; k < n; ++k) {
    const double w = s.inverse_depth[k], x = s.x_cam[k], y = s.y_cam[k], by_sigma = s.inv_sigma[k];
    s.error_u[k] *= by_sigma;
    s.error_v[k] *= by_sigma;
    s.u0[k] = by_sigma * (-fx * x * y);
    s.u1[k] = by_sigma * (fx * (1.0 + x * x));
    s.u2[k] = by_sigma * (-fx * y);
    s.u3[k] = by_sigma * (fx * w);
    s.u5[k] = by_sigma * (-fx * x * w);
    s.v0[k] = by_sigma * (-fy * (1.0 + y * y));
    s.v1[k] = by_sigma * (fy * x * y);
    s.v2[k] = by_sigma * (fy * x);
    s.v4[k] = by_sigma * (fy * w);
    s.v5[k] = by_sigma * (-fy * y * w);
    for (size_t c = 0; c < kPointSize; ++c) {
      s.point_u[c][k] = s.u3[k] * s.R[3 * c][k] + s.u5[k] * s.R[3 * c + 2][k];
      s.point_v[c][k] = s.v4[k] * s.R[3 * c + 1][k] + s.v5[k] * s.R[3 * c + 2][k];
    }
  }
  for (size_t k = 0; k < n; ++k)
    s.weight[k] = loss.Slope(s.error_u[k] * s.error_u[k] + s.error_v[k] * s.error_v[k]);
}

/// Adds a view to the equations of its pose, and sets what couples that with the point.
template <typename Vector>
[[gnu::always_inline]] inline void AddToPose(const SightTerms& s, size_t k, size_t pose, PointBlock* coupling,
                                             DenseEquations* equations) {
  const PoseColumn by_u{s.u0[k], s.u1[k], s.u2[k], s.u3[k], 0.0, s.u5[k]};
  const PoseColumn by_v{s.v0[k], s.v1[k], s.v2[k], 0.0, s.v4[k], s.v5[k]};
  SixNumbers<Vector> u, v, column;
  u.Load(by_u);
  v.Load(by_v);
  for (auto& part : u.part) part *= s.weight[k];
  for (auto& part : v.part) part *= s.weight[k];
  PoseBlock& own = equations->Pose(pose, pose);
  for (size_t c = 0; c < kPoseSize; ++c) {
    column.Set(u, by_u.row[c], v, by_v.row[c]);
    column.AddTo(&own[c]);
  }
  column.Set(u, s.error_u[k], v, s.error_v[k]);
  column.AddTo(&equations->gradient[pose]);
  for (size_t c = 0; c < kPointSize; ++c) {
    column.Set(u, s.point_u[c][k], v, s.point_v[c][k]);
    column.Store(&(*coupling)[c]);
  }
}

/// Adds a view to the equations of the point.
[[gnu::always_inline]] inline void AddToPoint(const SightTerms& s, size_t k, Eigen::Matrix3d* own,
                                              Eigen::Vector3d* gradient) {
  for (size_t i = 0; i < kPointSize; ++i) {
    const double u = s.weight[k] * s.point_u[i][k], v = s.weight[k] * s.point_v[i][k];
    const auto row = static_cast<Eigen::Index>(i);
    (*gradient)[row] += u * s.error_u[k] + v * s.error_v[k];
    for (size_t j = 0; j < kPointSize; ++j)
      (*own)(row, static_cast<Eigen::Index>(j)) += u * s.point_u[j][k] + v * s.point_v[j][k];
  }
}

/// Adds what all views see to the equations of the poses; keeps what is the points'.
template <typename Vector>
[[gnu::always_inline]] inline void AddPoints(const Pinhole& camera, const BundleRobustLoss& loss,
                                             const BundleSights& sights, const BundlePlace& place,
                                             DenseEquations* equations) {
  SightTerms terms;
  size_t begin = 0, end = 0, point = 0;
  for (size_t i = 0; i < sights.num_points(); ++i) {
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (size_t k = sights.first[i]; k < sights.first[i + 1]; ++k) {
      if (k == end) {
        begin = end;
        end = std::min(begin + kSightsAtOnce, sights.all.size());
        Collect(sights, place, begin, end, &point, &terms);
        MakeErrors(camera, end - begin, &terms);
        MakeTerms(camera, loss, end - begin, &terms);
      }
      const BundleSight& sight = sights.all[k];
      const size_t n = k - begin;
      equations->couplings[k] = {};
      if (!sight.counts || !(terms.depth[n] > kMinBundleDepth)) continue;
      AddToPoint(terms, n, &own, &gradient);
      if (sight.free_pose) AddToPose<Vector>(terms, n, *sight.free_pose, &equations->couplings[k], equations);
    }
    const bool held = !place.point_held.empty() && place.point_held[i] != 0;
    equations->points[i] = held ? Eigen::Matrix3d(Eigen::Matrix3d::Zero()) : own;
    equations->point_gradients[i] = held ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : gradient;
  }
}

[[gnu::always_inline]] inline double SumCost(const Pinhole& camera, const BundleRobustLoss& loss,
                                             const BundleSights& sights, const BundlePlace& place) {
  SightTerms terms;
  double cost = 0;
  size_t point = 0;
  for (size_t begin = 0; begin < sights.all.size(); begin += kSightsAtOnce) {
    const size_t end = std::min(begin + kSightsAtOnce, sights.all.size());
    Collect(sights, place, begin, end, &point, &terms);
    MakeErrors(camera, end - begin, &terms);
    for (size_t k = begin; k < end; ++k) {
      if (!sights.all[k].counts) continue;
      const size_t n = k - begin;
      const double u = terms.error_u[n], v = terms.error_v[n], inv_sigma = terms.inv_sigma[n];
      const bool is_before = terms.depth[n] > kMinBundleDepth;
      cost +=
          0.5 * loss.Of(is_before ? (u * u + v * v) * inv_sigma * inv_sigma : kErrorBehind * kErrorBehind);
    }
  }
  return cost;
}

/// Takes a point out of the equations of those that see it.
template <typename Vector>
[[gnu::always_inline]] inline void Eliminate(const BundleSights& sights, size_t i,
                                             DenseEquations* equations) {
  const Eigen::Matrix3d& inverse = equations->point_inverses[i];
  const Eigen::Vector3d& gradient = equations->point_gradients[i];
  SixNumbers<Vector> a, b, c, column;
  std::array<SixNumbers<Vector>, kPointSize> solved;
  for (size_t k = sights.first[i]; k < sights.first[i + 1]; ++k) {
    if (!sights.all[k].free_pose || !sights.all[k].counts) continue;
    const size_t pose = *sights.all[k].free_pose;
    const PointBlock& coupling = equations->couplings[k];
    a.Load(coupling[0]);
    b.Load(coupling[1]);
    c.Load(coupling[2]);
    for (int j = 0; j < 3; ++j)
      solved[static_cast<size_t>(j)].Set(a, inverse(0, j), b, inverse(1, j), c, inverse(2, j));
    column.Set(solved[0], gradient.x(), solved[1], gradient.y(), solved[2], gradient.z());
    column.TakeFrom(&equations->reduced[pose]);
    for (size_t l = sights.first[i]; l <= k; ++l) {  // the lower half
      if (!sights.all[l].free_pose || !sights.all[l].counts) continue;
      const PointBlock& others = equations->couplings[l];
      PoseBlock& block = equations->Pose(pose, *sights.all[l].free_pose);
      for (size_t row = 0; row < kPoseSize; ++row) {
        column.Set(solved[0], others[0].row[row], solved[1], others[1].row[row], solved[2],
                   others[2].row[row]);
        column.TakeFrom(&block[row]);
      }
    }
  }
}

/// Inverts the point's own equations. False: nothing is known of it.
bool Invert(double damping, size_t i, DenseEquations* equations) {
  Eigen::Matrix3d own = equations->points[i];
  own.diagonal() += damping * equations->points[i].diagonal();
  const bool is_known = own.determinant() > 0;
  equations->point_inverses[i].setZero();
  if (is_known) equations->point_inverses[i] = own.inverse();
  return is_known;
}

template <typename Vector>
[[gnu::always_inline]] inline void EliminateAll(const BundleSights& sights, double damping,
                                                DenseEquations* equations) {
  for (size_t i = 0; i < sights.num_points(); ++i) {
    if (Invert(damping, i, equations)) Eliminate<Vector>(sights, i, equations);
  }
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) double SumCostAvx2(const Pinhole& camera, const BundleRobustLoss& loss,
                                                   const BundleSights& sights, const BundlePlace& place) {
  return SumCost(camera, loss, sights, place);
}
DMSLAM_AVX512 double SumCostAvx512(const Pinhole& camera, const BundleRobustLoss& loss,
                                   const BundleSights& sights, const BundlePlace& place) {
  return SumCost(camera, loss, sights, place);
}
__attribute__((target("avx2"))) void AddPointsAvx2(const Pinhole& camera, const BundleRobustLoss& loss,
                                                   const BundleSights& sights, const BundlePlace& place,
                                                   DenseEquations* equations) {
  AddPoints<DoublesOf<4>>(camera, loss, sights, place, equations);
}
DMSLAM_AVX512 void AddPointsAvx512(const Pinhole& camera, const BundleRobustLoss& loss,
                                   const BundleSights& sights, const BundlePlace& place,
                                   DenseEquations* equations) {
  AddPoints<DoublesOf<8>>(camera, loss, sights, place, equations);
}
__attribute__((target("avx2"))) void EliminateAllAvx2(const BundleSights& sights, double damping,
                                                      DenseEquations* equations) {
  EliminateAll<DoublesOf<4>>(sights, damping, equations);
}
DMSLAM_AVX512 void EliminateAllAvx512(const BundleSights& sights, double damping, DenseEquations* equations) {
  EliminateAll<DoublesOf<8>>(sights, damping, equations);
}
#endif

}  // namespace

DenseEquations::DenseEquations(size_t free_poses, const BundleSights& sights)
    : poses(free_poses * (free_poses + 1) / 2),
      gradient(free_poses),
      reduced(free_poses),
      couplings(sights.all.size()),
      points(sights.num_points()),
      point_inverses(sights.num_points()),
      point_gradients(sights.num_points()) {}

double CostOf(const Pinhole& camera, const BundleRobustLoss& loss, const BundleSights& sights,
              const BundlePlace& place, [[maybe_unused]] VectorPath widest) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, widest)) return SumCostAvx512(camera, loss, sights, place);
  if (Takes(VectorPath::kAvx2, widest)) return SumCostAvx2(camera, loss, sights, place);
#endif
  return SumCost(camera, loss, sights, place);
}

void SetEquations(const Pinhole& camera, const BundleRobustLoss& loss, const BundleSights& sights,
                  const BundlePlace& place, DenseEquations* equations, [[maybe_unused]] VectorPath widest) {
  std::ranges::fill(equations->poses, PoseBlock());
  std::ranges::fill(equations->gradient, PoseColumn());
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, widest)) return AddPointsAvx512(camera, loss, sights, place, equations);
  if (Takes(VectorPath::kAvx2, widest)) return AddPointsAvx2(camera, loss, sights, place, equations);
#endif
  AddPoints<DoublesOf<2>>(camera, loss, sights, place, equations);
}

void EliminatePoints(const BundleSights& sights, double damping, DenseEquations* equations,
                     [[maybe_unused]] VectorPath widest) {
  equations->reduced = equations->gradient;
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx512, widest)) return EliminateAllAvx512(sights, damping, equations);
  if (Takes(VectorPath::kAvx2, widest)) return EliminateAllAvx2(sights, damping, equations);
#endif
  EliminateAll<DoublesOf<2>>(sights, damping, equations);
}

}  // namespace dmslam
