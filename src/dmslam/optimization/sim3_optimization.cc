#include "dmslam/optimization/sim3_optimization.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dmslam/geometry/similarity.h"
#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/optimization/reprojection.h"
#include "dmslam/optimization/sim3_cost.h"
#include "dmslam/robust/ransac.h"

namespace dmslam {
namespace {

double Chi2(const Pinhole& camera, const Eigen::Vector3d& p_cam, const Eigen::Vector2d& uv_px,
            double inv_sigma_squared) {
  if (!(p_cam.z() > kMinDepth)) return std::numeric_limits<double>::infinity();
  return (camera.Project(p_cam) - uv_px).squaredNorm() * inv_sigma_squared;
}

/// The cameras and the matches, seen through one similarity and its inverse.
struct TwoSides {
  const Pinhole& camera1;
  const Pinhole& camera2;
  std::span<const Sim3Match> matches;

  /// The larger chi2 of the two sides.
  double Worse(const Sim3d& S_12, const Sim3d& S_21, size_t i) const {
    const Sim3Match& m = matches[i];
    const double in_first = Chi2(camera1, S_12 * m.p_cam2, m.uv1_px, m.inv_sigma_squared1);
    if (!std::isfinite(in_first)) return in_first;
    return std::max(in_first, Chi2(camera2, S_21 * m.p_cam1, m.uv2_px, m.inv_sigma_squared2));
  }
};

struct BothWays {
  Sim3d S_12, S_21;
};

class Sim3Problem {
 public:
  using Model = BothWays;
  static constexpr int kSampleSize = 3;
  static constexpr int kMaxModels = 1;

  Sim3Problem(const TwoSides& sides, const Sim3RansacOptions& options) : sides_(sides), options_(options) {
    for (const Sim3Match& m : sides.matches) {
      points1_.push_back(m.p_cam1);
      points2_.push_back(m.p_cam2);
    }
  }
  int size() const { return static_cast<int>(points1_.size()); }
  int Fit(std::span<const int, 3> sample, std::array<BothWays, 1>& models) const {
    return Align(sample, models[0]) ? 1 : 0;
  }
  double NormalizedErrorSquared(const BothWays& model, int i) const {
    return sides_.Worse(model.S_12, model.S_21, static_cast<size_t>(i)) / options_.max_chi2;
  }
  bool Refit(std::span<const int> indices, BothWays& model) const { return Align(indices, model); }

 private:
  bool Align(std::span<const int> indices, BothWays& model) const {
    const auto S = AlignSim3(points2_, points1_, indices, options_.fix_scale);
    if (S) model = {*S, S->Inverse()};
    return S.has_value();
  }

  const TwoSides& sides_;
  const Sim3RansacOptions& options_;
  std::vector<Eigen::Vector3d> points1_, points2_;
};

}  // namespace

Sim3Report EstimateSim3Ransac(const Pinhole& camera1, const Pinhole& camera2,
                              std::span<const Sim3Match> matches, const Sim3RansacOptions& options) {
  const TwoSides sides{camera1, camera2, matches};
  auto found = Ransac(Sim3Problem(sides, options), {.max_iterations = options.max_iterations,
                                                    .confidence = options.confidence,
                                                    .min_inliers = options.min_inliers,
                                                    .seed = options.seed});
  Sim3Report report;
  report.success = found.success;
  report.S_cam1_cam2 = found.model.S_12;
  report.num_inliers = found.num_inliers;
  report.inliers = std::move(found.inliers);
  report.iterations = found.iterations;
  return report;
}

Sim3SideError Sim3ErrorInFirst(const Pinhole& camera1, const Sim3d& S_12, const Sim3Match& match) {
  const Eigen::Vector3d p = S_12 * match.p_cam2;
  Sim3SideError side;
  side.error = camera1.Project(p) - match.uv1_px;
  side.jacobian.leftCols<6>() = PoseJacobian(camera1, p);
  side.jacobian.col(6) = ProjectionJacobian(camera1, p) * p;  // The scale stretches the point from camera 1.
  return side;
}

Sim3SideError Sim3ErrorInSecond(const Pinhole& camera2, const Sim3d& S_12, const Sim3Match& match) {
  const Sim3d S_21 = S_12.Inverse();
  const Eigen::Vector3d p = S_21 * match.p_cam1;
  Sim3SideError side;
  side.error = camera2.Project(p) - match.uv2_px;
  // S_21 Exp(-d) p1: the step moves p1 backwards, and S_21 carries the move into camera 2.
  Eigen::Matrix<double, 3, 7> move;
  move.leftCols<3>() = Hat(match.p_cam1);
  move.block<3, 3>(0, 3) = -Eigen::Matrix3d::Identity();
  move.col(6) = -match.p_cam1;
  side.jacobian = ProjectionJacobian(camera2, p) * (S_21.scale * S_21.rotation.toRotationMatrix()) * move;
  return side;
}

namespace {

struct Sums {
  Matrix7d hessian = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();
  double cost = 0.0;
};

void AddSide(const Sim3SideError& side, double inv_sigma_squared, double huber_squared, Sums& sums) {
  const double chi2 = side.error.squaredNorm() * inv_sigma_squared;
  double weight = inv_sigma_squared, loss = chi2;
  if (chi2 > huber_squared) {
    const double ratio = std::sqrt(huber_squared / chi2);
    weight *= ratio;
    loss = 2.0 * chi2 * ratio - huber_squared;
  }
  sums.hessian.noalias() += weight * side.jacobian.transpose() * side.jacobian;
  sums.gradient.noalias() += weight * side.jacobian.transpose() * side.error;
  sums.cost += loss;
}

/// Over the inliers; a match behind a camera makes the cost infinite.
Sums Linearize(const TwoSides& sides, const Sim3d& S_12, const std::vector<char>& inliers,
               double huber_squared) {
  Sums sums;
  const Sim3d S_21 = S_12.Inverse();
  for (size_t i = 0; i < sides.matches.size(); ++i) {
    if (!inliers[i]) continue;
    const Sim3Match& m = sides.matches[i];
    if (!((S_12 * m.p_cam2).z() > kMinDepth) || !((S_21 * m.p_cam1).z() > kMinDepth)) {
      sums.cost = std::numeric_limits<double>::infinity();
      return sums;
    }
    AddSide(Sim3ErrorInFirst(sides.camera1, S_12, m), m.inv_sigma_squared1, huber_squared, sums);
    AddSide(Sim3ErrorInSecond(sides.camera2, S_12, m), m.inv_sigma_squared2, huber_squared, sums);
  }
  return sums;
}

/// Levenberg-Marquardt over the seven (or six) unknowns.
int Minimize(const TwoSides& sides, const std::vector<char>& inliers, int iterations, double huber_squared,
             bool fix_scale, Sim3d& S_12) {
  double damping = 1e-6;
  Sums now = Linearize(sides, S_12, inliers, huber_squared);
  for (int k = 0; k < iterations; ++k) {
    Matrix7d damped = now.hessian;
    damped.diagonal() *= 1.0 + damping;
    Vector7d step = Vector7d::Zero();
    if (fix_scale) {
      step.head<6>() = -SolveSymmetric<6, 1>(damped.topLeftCorner<6, 6>(), now.gradient.head<6>());
    } else {
      step = -SolveSymmetric(damped, now.gradient);
    }
    if (!step.allFinite()) return k;
    const Sim3d candidate = StepSim3(S_12, step);
    const Sums next = Linearize(sides, candidate, inliers, huber_squared);
    if (!(next.cost <= now.cost)) {
      damping = std::max(1e-4, damping * 10.0);
      continue;
    }
    const bool settled = now.cost - next.cost < 1e-8 * now.cost;
    S_12 = candidate;
    now = next;
    damping = std::max(1e-9, damping * 0.1);
    if (settled) return k + 1;
  }
  return iterations;
}

void Classify(const TwoSides& sides, double max_chi2, Sim3Report& report) {
  const Sim3d S_21 = report.S_cam1_cam2.Inverse();
  report.num_inliers = 0;
  for (size_t i = 0; i < sides.matches.size(); ++i) {
    report.inliers[i] = sides.Worse(report.S_cam1_cam2, S_21, i) <= max_chi2;
    report.num_inliers += report.inliers[i];
  }
}

}  // namespace

Sim3Report OptimizeSim3(const Pinhole& camera1, const Pinhole& camera2, std::span<const Sim3Match> matches,
                        const Sim3d& S_cam1_cam2_init, const Sim3OptimizationOptions& options) {
  const TwoSides sides{camera1, camera2, matches};
  constexpr double kNoLimit = std::numeric_limits<double>::max();
  Sim3Report report;
  report.S_cam1_cam2 = S_cam1_cam2_init;
  // Gross outliers (behind a camera, or ten times the limit away) do not enter the first stage.
  report.inliers.assign(matches.size(), 1);
  Classify(sides, 100.0 * options.max_chi2, report);
  if (report.num_inliers < 3) return report;
  report.iterations = Minimize(sides, report.inliers, options.first_iterations, options.max_chi2,
                               options.fix_scale, report.S_cam1_cam2);
  Classify(sides, options.max_chi2, report);
  if (report.num_inliers < std::max(3, options.min_inliers)) return report;
  report.iterations += Minimize(sides, report.inliers, options.second_iterations, kNoLimit, options.fix_scale,
                                report.S_cam1_cam2);
  Classify(sides, options.max_chi2, report);
  report.success = report.num_inliers >= options.min_inliers;
  return report;
}

}  // namespace dmslam
