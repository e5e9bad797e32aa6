#include "dmslam/optimization/few_views_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "dmslam/optimization/reprojection.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using Matrix63 = Eigen::Matrix<double, 6, 3>;
using Matrix66 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kMinDepth = 1e-6;
constexpr double kErrorBehind = 100.0;  // [sigma]
/// As in the adjustment of a map: what turned and what moved aside is told apart by very little.
constexpr double kFirstDamping = 1e-7;
constexpr double kMostDamping = 1e3;
constexpr double kLeastDamping = 1e-16;
constexpr double kLeastGainRatio = 1e-3;

size_t At(int index) { return static_cast<size_t>(index); }

/// Where the cameras and the points are.
struct State {
  std::vector<Rigid3d> T_cam_world;
  std::vector<Eigen::Vector3d> points;

  bool AllFinite() const {
    return std::ranges::all_of(T_cam_world, [](const Rigid3d& T) { return T.AllFinite(); }) &&
           std::ranges::all_of(points, [](const Eigen::Vector3d& p) { return p.allFinite(); });
  }
};

/// A point seen in a view.
struct Sight {
  int pose;
  Eigen::Vector2d uv_px;
  double inv_sigma;
  bool counts;  ///< false: it was behind the camera at the start
};

/// What a step changes: six numbers (w, v) for each pose but the first, three for each point.
struct Step {
  Eigen::VectorXd poses;
  std::vector<Eigen::Vector3d> points;
  double predicted_gain = 0;  ///< of the cost, if it were quadratic
};

class FewViews {
 public:
  FewViews(const BundleOptions& options, const BundleProblem& problem)
      : options_(options), camera_(problem.camera), state_{problem.T_cam_world, problem.points} {
    SortByPoint(problem);
    rotations_.resize(state_.T_cam_world.size());
    couplings_.resize(sights_.size());
    inverses_.resize(state_.points.size());
    gradients_.resize(state_.points.size());
    diagonals_.resize(state_.points.size());
  }

  /// The best state; none where no step could be made.
  std::optional<State> Run() {
    double cost = Cost(state_);
    double damping = kFirstDamping, growth = 2.0;
    for (int k = 0; k < options_.first_iterations && damping <= kMostDamping; ++k) {
      const std::optional<Step> step = Solve(damping);
      State moved = step ? Moved(*step) : state_;
      const double moved_cost = Cost(moved);
      const double ratio = step ? (cost - moved_cost) / step->predicted_gain : -1.0;
      if (!(ratio > kLeastGainRatio) || !moved.AllFinite()) {
        damping *= growth;
        growth *= 2.0;
        continue;
      }
      state_ = std::move(moved);
      damping = std::max(kLeastDamping, damping * std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3)));
      growth = 2.0;
      const double gained = cost - moved_cost;
      cost = moved_cost;
      if (gained <= options_.relative_tolerance * cost) break;
    }
    return state_.AllFinite() ? std::optional(state_) : std::nullopt;
  }

 private:
  void SortByPoint(const BundleProblem& problem) {
    first_.assign(problem.points.size() + 1, 0);
    for (const BundleObservation& o : problem.observations) {
      DMSLAM_CHECK(o.pose >= 0 && At(o.pose) < problem.T_cam_world.size(), "observation names a pose");
      DMSLAM_CHECK(o.point >= 0 && At(o.point) < problem.points.size(), "observation names a point");
      ++first_[At(o.point) + 1];
    }
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    sights_.resize(problem.observations.size());
    std::vector<size_t> next(first_.begin(), first_.end() - 1);
    for (const BundleObservation& o : problem.observations) {
      const Eigen::Vector3d p = problem.T_cam_world[At(o.pose)] * problem.points[At(o.point)];
      sights_[next[At(o.point)]++] = {o.pose, o.uv_px, std::sqrt(o.inv_sigma_squared), p.z() > kMinDepth};
    }
    for (size_t i = 0; i + 1 < first_.size(); ++i) {
      std::ranges::sort(sights_.begin() + static_cast<ptrdiff_t>(first_[i]),
                        sights_.begin() + static_cast<ptrdiff_t>(first_[i + 1]), {}, &Sight::pose);
    }
  }

  /// Huber's loss of a squared error, and its slope.
  double Loss(double squared, double* slope) const {
    const double delta = options_.huber_delta;
    if (squared <= delta * delta) {
      *slope = 1.0;
      return squared;
    }
    const double root = std::sqrt(squared);
    *slope = delta / root;
    return 2.0 * delta * root - delta * delta;
  }

  double Cost(const State& state) {
    SetRotations(state);
    double cost = 0, slope = 0;
    for (size_t i = 0; i < state.points.size(); ++i) {
      for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
        const Sight& sight = sights_[k];
        if (!sight.counts) continue;
        const Eigen::Vector3d p = InCamera(state, sight, state.points[i]);
        const double squared = p.z() > kMinDepth ? (camera_.Project(p) - sight.uv_px).squaredNorm() *
                                                       sight.inv_sigma * sight.inv_sigma
                                                 : kErrorBehind * kErrorBehind;
        cost += 0.5 * Loss(squared, &slope);
      }
    }
    return cost;
  }

  void SetRotations(const State& state) {
    for (size_t k = 0; k < rotations_.size(); ++k) {
      rotations_[k] = state.T_cam_world[k].rotation.toRotationMatrix();
    }
  }
  Eigen::Vector3d InCamera(const State& state, const Sight& sight, const Eigen::Vector3d& point) const {
    return rotations_[At(sight.pose)] * point + state.T_cam_world[At(sight.pose)].translation;
  }

  /// The step that minimises the quadratic model with that damping, a share of the diagonal.
  std::optional<Step> Solve(double damping) {
    const auto size = 6 * static_cast<Eigen::Index>(state_.T_cam_world.size() - 1);
    normal_.setZero(size, size);
    gradient_.setZero(size);
    SetRotations(state_);
    for (size_t i = 0; i < state_.points.size(); ++i) AddPoint(i);
    const Eigen::VectorXd diagonal = normal_.diagonal();
    normal_.diagonal() += damping * diagonal;
    Eigen::VectorXd reduced = gradient_;
    for (size_t i = 0; i < state_.points.size(); ++i) Eliminate(i, damping, &reduced);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factored(normal_);
    if (factored.info() != Eigen::Success) return std::nullopt;
    Step step;
    step.poses = -factored.solve(reduced);
    double slope = gradient_.dot(step.poses);
    double damped = step.poses.cwiseAbs2().dot(diagonal);
    for (size_t i = 0; i < state_.points.size(); ++i) {
      const Eigen::Vector3d& moved = step.points.emplace_back(PointStep(i, step.poses));
      slope += gradients_[i].dot(moved);
      damped += moved.cwiseAbs2().dot(diagonals_[i]);
    }
    step.predicted_gain = 0.5 * (damping * damped - slope);
    return step;
  }

  /// Adds what the views see of the point to the normal equations of the poses; keeps what is the point's.
  void AddPoint(size_t i) {
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
    gradients_[i].setZero();
    for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
      const Sight& sight = sights_[k];
      couplings_[k].setZero();
      const Eigen::Vector3d p = InCamera(state_, sight, state_.points[i]);
      if (!sight.counts || !(p.z() > kMinDepth)) continue;
      const Eigen::Vector2d error = sight.inv_sigma * (camera_.Project(p) - sight.uv_px);
      double weight = 1;
      Loss(error.squaredNorm(), &weight);
      const Matrix23 by_point = sight.inv_sigma * ProjectionJacobian(camera_, p) * rotations_[At(sight.pose)];
      own.noalias() += weight * by_point.transpose() * by_point;
      gradients_[i].noalias() += weight * by_point.transpose() * error;
      if (sight.pose == 0) continue;
      const Matrix26 by_pose = sight.inv_sigma * PoseJacobian(camera_, p);
      const Matrix26 weighted = weight * by_pose;
      const Eigen::Index at = 6 * (sight.pose - 1);
      normal_.block<6, 6>(at, at).noalias() += weighted.transpose() * by_pose;
      gradient_.segment<6>(at).noalias() += weighted.transpose() * error;
      couplings_[k].noalias() = weighted.transpose() * by_point;
    }
    inverses_[i] = own;  // until it is damped and inverted
    diagonals_[i] = own.diagonal();
  }

  /// Takes the point out of the poses' equations.
  void Eliminate(size_t i, double damping, Eigen::VectorXd* reduced) {
    inverses_[i].diagonal() += damping * diagonals_[i];
    if (!(inverses_[i].determinant() > 0)) {
      inverses_[i].setZero();  // seen by nobody: it stays where it is
      return;
    }
    inverses_[i] = inverses_[i].inverse().eval();
    for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
      if (sights_[k].pose == 0) continue;
      const Eigen::Index at = 6 * (sights_[k].pose - 1);
      const Matrix63 solved = couplings_[k] * inverses_[i];
      reduced->segment<6>(at).noalias() -= solved * gradients_[i];
      for (size_t l = first_[i]; l <= k; ++l) {
        if (sights_[l].pose == 0) continue;
        normal_.block<6, 6>(at, 6 * (sights_[l].pose - 1)).noalias() -= solved * couplings_[l].transpose();
      }
    }
  }

  Eigen::Vector3d PointStep(size_t i, const Eigen::VectorXd& poses) const {
    Eigen::Vector3d sum = gradients_[i];
    for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
      if (sights_[k].pose == 0) continue;
      sum.noalias() += couplings_[k].transpose() * poses.segment<6>(6 * (sights_[k].pose - 1));
    }
    return -inverses_[i] * sum;
  }

  State Moved(const Step& step) const {
    State moved = state_;
    for (size_t k = 1; k < moved.T_cam_world.size(); ++k) {
      const Vector6 own = step.poses.segment<6>(6 * (static_cast<Eigen::Index>(k) - 1));
      moved.T_cam_world[k] = Rigid3d(ExpSo3(own.head<3>()), own.tail<3>()) * moved.T_cam_world[k];
    }
    for (size_t i = 0; i < moved.points.size(); ++i) moved.points[i] += step.points[i];
    return moved;
  }

  const BundleOptions& options_;
  Pinhole camera_;
  State state_;
  std::vector<Sight> sights_;  ///< by point, then by pose
  std::vector<size_t> first_;  ///< of each point
  std::vector<Eigen::Matrix3d> rotations_;
  Eigen::MatrixXd normal_;  ///< of the poses; the lower half
  Eigen::VectorXd gradient_;
  std::vector<Matrix63> couplings_;         ///< of each sight: pose with point
  std::vector<Eigen::Matrix3d> inverses_;   ///< of each point's own equations
  std::vector<Eigen::Vector3d> gradients_;  ///< of each point
  std::vector<Eigen::Vector3d> diagonals_;
};

/// The camera that was farthest from the first one gets its old distance back.
void KeepScale(const std::vector<Rigid3d>& before, State* state) {
  const Rigid3d& held = before.front();
  const auto distance = [&](const Rigid3d& T) { return (T.Center() - held.Center()).norm(); };
  const auto farthest = std::ranges::max_element(before, {}, distance) - before.begin();
  const double was = distance(before[static_cast<size_t>(farthest)]);
  const double is = distance(state->T_cam_world[static_cast<size_t>(farthest)]);
  if (!(was > 0) || !(is > 0)) return;
  const Eigen::Vector3d center = held.Center();
  const auto scaled = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return center + was / is * (p - center);
  };
  for (Eigen::Vector3d& point : state->points) point = scaled(point);
  for (size_t k = 1; k < state->T_cam_world.size(); ++k) {
    Rigid3d& T = state->T_cam_world[k];
    T.translation = T.rotation * -scaled(T.Center());
  }
}

}  // namespace

bool AdjustFewViews(const BundleOptions& options, BundleProblem* problem) {
  if (problem->T_cam_world.size() < 2 || problem->observations.empty()) return false;
  std::optional<State> adjusted = FewViews(options, *problem).Run();
  if (!adjusted) return false;
  if (options.keep_scale) KeepScale(problem->T_cam_world, &*adjusted);
  problem->T_cam_world = std::move(adjusted->T_cam_world);
  problem->points = std::move(adjusted->points);
  return true;
}

}  // namespace dmslam
