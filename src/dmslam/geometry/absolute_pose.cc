#include "dmslam/geometry/absolute_pose.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "dmslam/geometry/polynomial.h"
#include "dmslam/geometry/pose_normal.h"
#include "dmslam/geometry/similarity.h"
#include "dmslam/geometry/solve_symmetric.h"

namespace dmslam {
namespace {

/// The three squared sides a and the cosines b of the rays: l_i^2 + l_j^2 - 2 b_ij l_i l_j = a_ij for the
/// depths l.
struct Triangle {
  double a12, a13, a23, b12, b13, b23;
};

/// The symmetric D with l^T D l = (M12 a23 - M23 a12) forms of the paper's Eq. 8; M_ij is the left side
/// above.
Eigen::Matrix3d FirstForm(const Triangle& t) {
  Eigen::Matrix3d D;
  D << t.a23, -t.a23 * t.b12, 0.0, -t.a23 * t.b12, t.a23 - t.a12, t.a12 * t.b23, 0.0, t.a12 * t.b23, -t.a12;
  return D;
}

Eigen::Matrix3d SecondForm(const Triangle& t) {
  Eigen::Matrix3d D;
  D << t.a23, 0.0, -t.a23 * t.b13, 0.0, -t.a13, t.a13 * t.b23, -t.a23 * t.b13, t.a13 * t.b23, t.a23 - t.a13;
  return D;
}

Eigen::Matrix3d Adjugate(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d adjugate;
  adjugate.row(0) = m.col(1).cross(m.col(2));
  adjugate.row(1) = m.col(2).cross(m.col(0));
  adjugate.row(2) = m.col(0).cross(m.col(1));
  return adjugate;
}

/// Unit null vector of a singular symmetric matrix: the largest cross product of two rows.
Eigen::Vector3d NullVector(const Eigen::Matrix3d& m) {
  const Eigen::Vector3d a = m.row(0).cross(m.row(1)), b = m.row(0).cross(m.row(2)),
                        c = m.row(1).cross(m.row(2));
  const double na = a.squaredNorm(), nb = b.squaredNorm(), nc = c.squaredNorm();
  if (na >= nb && na >= nc) return a / std::sqrt(na);
  return nb >= nc ? Eigen::Vector3d(b / std::sqrt(nb)) : Eigen::Vector3d(c / std::sqrt(nc));
}

/// The two planes n^T l = 0 into which the singular form falls; false if they are not real.
bool SplitSingularForm(const Eigen::Matrix3d& D, std::array<Eigen::Vector3d, 2>& normals) {
  const double trace = D.trace();
  const double minors = D(0, 0) * D(1, 1) - D(0, 1) * D(0, 1) + D(0, 0) * D(2, 2) - D(0, 2) * D(0, 2) +
                        D(1, 1) * D(2, 2) - D(1, 2) * D(1, 2);
  if (!(minors < 0.0)) return false;  // Both eigenvalues of one sign.
  const double root = std::sqrt(trace * trace - 4.0 * minors);
  const double s1 = 0.5 * (trace + root), s2 = 0.5 * (trace - root);
  const Eigen::Vector3d e1 = NullVector(D - s1 * Eigen::Matrix3d::Identity());
  const Eigen::Vector3d e2 = NullVector(D - s2 * Eigen::Matrix3d::Identity());
  const double s = std::sqrt(-s2 / s1);
  normals = {Eigen::Vector3d(e1 - s * e2), Eigen::Vector3d(e1 + s * e2)};
  return true;
}

/// Newton steps on the three equations of the triangle.
void RefineDepths(const Triangle& t, Eigen::Vector3d& l) {
  for (int k = 0; k < 3; ++k) {
    const double x = l.x(), y = l.y(), z = l.z();
    const Eigen::Vector3d error(x * x + y * y - 2 * t.b12 * x * y - t.a12,
                                x * x + z * z - 2 * t.b13 * x * z - t.a13,
                                y * y + z * z - 2 * t.b23 * y * z - t.a23);
    Eigen::Matrix3d jacobian;
    jacobian << 2 * (x - t.b12 * y), 2 * (y - t.b12 * x), 0, 2 * (x - t.b13 * z), 0, 2 * (z - t.b13 * x), 0,
        2 * (y - t.b23 * z), 2 * (z - t.b23 * y);
    const double determinant = jacobian.determinant();
    if (!(std::abs(determinant) > 1e-300)) return;
    l -= (Adjugate(jacobian) / determinant) * error;
    if (error.squaredNorm() < 1e-28 * (t.a12 * t.a12 + t.a13 * t.a13 + t.a23 * t.a23)) return;
  }
}

/// The depths on the plane that satisfy `form` (l^T form l = 0) and the size of the triangle; at most two.
int DepthsOnPlane(const Eigen::Vector3d& normal, const Eigen::Matrix3d& form, const Triangle& t,
                  std::array<Eigen::Vector3d, 2>& depths) {
  const Eigen::Vector3d p = normal.unitOrthogonal(), q = normal.cross(p).normalized();
  const double a = q.dot(form * q), b = p.dot(form * q), c = p.dot(form * p);
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return 0;
  const double r = -(b + std::copysign(std::sqrt(discriminant), b));
  // Roots of a tau^2 + 2 b tau + c as directions p + tau q, written without division: (a, r) and (r, c).
  const std::array<Eigen::Vector3d, 2> directions{Eigen::Vector3d(a * p + r * q),
                                                  Eigen::Vector3d(r * p + c * q)};
  int count = 0;
  for (Eigen::Vector3d d : directions) {
    if (d.sum() < 0.0) d = -d;
    if (!(d.minCoeff() > 0.0)) continue;
    const double size = d.y() * d.y() + d.z() * d.z() - 2.0 * t.b23 * d.y() * d.z();
    if (!(size > 0.0)) continue;
    Eigen::Vector3d l = d * std::sqrt(t.a23 / size);
    RefineDepths(t, l);
    if (l.allFinite() && l.minCoeff() > 0.0) depths[static_cast<size_t>(count++)] = l;
  }
  return count;
}

double SingularCombination(const Eigen::Matrix3d& D1, const Eigen::Matrix3d& D2) {
  std::array<double, 3> roots;
  const int count = RealRootsCubic(
      {D2.determinant(), (Adjugate(D2) * D1).trace(), (Adjugate(D1) * D2).trace(), D1.determinant()}, roots);
  return count > 0 ? roots[0] : 0.0;
}

}  // namespace

int SolveP3p(std::span<const Eigen::Vector3d, 3> rays, std::span<const Eigen::Vector3d, 3> points_world,
             std::array<Rigid3d, 4>& poses) {
  const Eigen::Vector3d y1 = rays[0].normalized(), y2 = rays[1].normalized(), y3 = rays[2].normalized();
  const Eigen::Vector3d d12 = points_world[0] - points_world[1], d13 = points_world[0] - points_world[2];
  const Eigen::Vector3d d23 = points_world[1] - points_world[2], across = d12.cross(d13);
  const Triangle t{d12.squaredNorm(), d13.squaredNorm(), d23.squaredNorm(),
                   y1.dot(y2),        y1.dot(y3),        y2.dot(y3)};
  if (!(across.squaredNorm() > 1e-12 * t.a12 * t.a13) || !(t.a23 > 0.0)) return 0;
  Eigen::Matrix3d D1 = FirstForm(t), D2 = SecondForm(t);
  if (std::abs(D1.determinant()) > std::abs(D2.determinant())) std::swap(D1, D2);
  std::array<Eigen::Vector3d, 2> normals;
  if (!SplitSingularForm(D1 + SingularCombination(D1, D2) * D2, normals)) return 0;
  Eigen::Matrix3d X;
  X << d12, d13, across;
  const Eigen::Matrix3d X_inverse = X.inverse();
  int count = 0;
  for (const Eigen::Vector3d& normal : normals) {
    std::array<Eigen::Vector3d, 2> depths;
    const int found = DepthsOnPlane(normal, D2, t, depths);
    for (int k = 0; k < found; ++k) {
      const Eigen::Vector3d& l = depths[static_cast<size_t>(k)];
      const Eigen::Vector3d c12 = l.x() * y1 - l.y() * y2, c13 = l.x() * y1 - l.z() * y3;
      Eigen::Matrix3d Y;
      Y << c12, c13, c12.cross(c13);
      const Eigen::Quaterniond rotation = Eigen::Quaterniond(Eigen::Matrix3d(Y * X_inverse)).normalized();
      const Rigid3d pose(rotation, l.x() * y1 - rotation * points_world[0]);
      if (pose.AllFinite()) poses[static_cast<size_t>(count++)] = pose;
    }
  }
  return count;
}

Rigid3d RefinePose(const Pinhole& camera, const Rigid3d& T_cam_world,
                   std::span<const Eigen::Vector3d> points_world, std::span<const Eigen::Vector2d> uv_px,
                   std::span<const double> inv_sigma_squared, std::span<const int> indices, int iterations) {
  Rigid3d T = T_cam_world;
  PoseNormal now = SumPoseNormal(camera, T, points_world, uv_px, inv_sigma_squared, indices);
  for (int k = 0; k < iterations; ++k) {
    if (!std::isfinite(now.cost)) return T;
    const Vector6d step = -SolveSymmetric(now.matrix, now.gradient);
    if (!step.allFinite()) return T;
    const Rigid3d candidate = StepPose(T, step);
    const PoseNormal next = SumPoseNormal(camera, candidate, points_world, uv_px, inv_sigma_squared, indices);
    if (!(next.cost < now.cost)) return T;
    const bool settled = next.cost > now.cost * (1.0 - 1e-6);
    T = candidate;
    now = next;
    if (settled) return T;
  }
  return T;
}

}  // namespace dmslam
