#include "dmslam/optimization/dense_bundle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "dmslam/optimization/reprojection.h"

namespace dmslam {
namespace {

using Matrix63 = Eigen::Matrix<double, 6, 3>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kMostDamping = 1e3;
constexpr double kLeastDamping = 1e-16;
constexpr double kLeastGainRatio = 1e-3;

/// A point seen in a view.
struct Sight {
  size_t observation;
  int pose;
  Eigen::Index row;  ///< of the poses' equations; negative: the pose is held
  Eigen::Vector2d uv_px;
  double inv_sigma;
  bool counts;
};

/// What a step changes: six numbers (w, v) for each pose that is free, three for each point.
struct Step {
  Eigen::VectorXd poses;
  std::vector<Eigen::Vector3d> points;
  double predicted_gain = 0;  ///< of the cost, if it were quadratic
};

/// A step that was taken.
struct Taken {
  double cost = 0;
  double gain_ratio = 0;  ///< of what it gained and what it had promised
};

class DenseBundle : public BundleSolver {
 public:
  DenseBundle(const BundleOptions& options, BundleState* state)
      : options_(options), state_(*state), camera_(state->problem.camera) {
    SortByPoint();
    rotations_.resize(state_.poses.size());
    couplings_.resize(sights_.size());
    inverses_.resize(state_.problem.points.size());
    gradients_.resize(state_.problem.points.size());
    diagonals_.resize(state_.problem.points.size());
  }

  int NumTerms() const override {
    return static_cast<int>(std::ranges::count_if(sights_, [](const Sight& sight) { return sight.counts; }));
  }

  void Disable(size_t observation) override { sights_[place_of_[observation]].counts = false; }

  BundleStageResult Solve(const BundleStage& stage) override {
    BundleStageResult result;
    cauchy_ = stage.cauchy;
    double cost = Cost(state_.poses, state_.problem.points);
    result.sound = std::isfinite(cost);
    if (!result.sound) result.message = "the errors are not finite";
    double damping = 1.0 / kBundleTrustRegion, growth = 2.0;
    while (result.sound && result.iterations < stage.iterations && damping <= kMostDamping) {
      result.interrupted = options_.interrupt && options_.interrupt();
      if (result.interrupted) break;
      ++result.iterations;
      const std::optional<Taken> taken = TryStep(damping, cost);
      if (!taken) {
        damping *= growth;
        growth *= 2.0;
        continue;
      }
      const double eased = std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * taken->gain_ratio - 1.0, 3));
      damping = std::max(kLeastDamping, damping * eased);
      growth = 2.0;
      const double gained = cost - taken->cost;
      cost = taken->cost;
      if (gained <= stage.relative_tolerance * cost) break;
    }
    return result;
  }

 private:
  void SortByPoint() {
    const std::vector<BundleObservation>& observations = state_.problem.observations;
    std::vector<Eigen::Index> row_of(state_.poses.size(), -1);
    for (size_t k = 0; k < row_of.size(); ++k) {
      if (state_.pose_held[k]) continue;
      row_of[k] = size_;
      size_ += 6;
    }
    first_.assign(state_.problem.points.size() + 1, 0);
    for (const BundleObservation& o : observations) ++first_[At(o.point) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    sights_.resize(observations.size());
    std::vector<size_t> next(first_.begin(), first_.end() - 1);
    for (size_t i = 0; i < observations.size(); ++i) {
      const BundleObservation& o = observations[i];
      const bool adjusts = row_of[At(o.pose)] >= 0 || !state_.PointHeld(o.point);
      sights_[next[At(o.point)]++] = {i,
                                      o.pose,
                                      row_of[At(o.pose)],
                                      o.uv_px,
                                      std::sqrt(o.inv_sigma_squared),
                                      state_.active[i] && adjusts};
    }
    place_of_.resize(observations.size());
    for (size_t i = 0; i + 1 < first_.size(); ++i) {
      std::ranges::sort(sights_.begin() + static_cast<ptrdiff_t>(first_[i]),
                        sights_.begin() + static_cast<ptrdiff_t>(first_[i + 1]), {}, &Sight::row);
    }
    for (size_t k = 0; k < sights_.size(); ++k) place_of_[sights_[k].observation] = k;
  }

  /// The loss of a squared error, and its slope.
  double Loss(double squared, double* slope) const {
    if (cauchy_) {
      const double width_squared = options_.cauchy_width * options_.cauchy_width;
      const double sum = 1.0 + squared / width_squared;
      *slope = 1.0 / sum;
      return width_squared * std::log(sum);
    }
    const double delta = options_.huber_delta;
    *slope = 1.0;
    if (squared <= delta * delta) return squared;
    const double root = std::sqrt(squared);
    *slope = delta / root;
    return 2.0 * delta * root - delta * delta;
  }

  double Cost(const std::vector<Rigid3d>& poses, const std::vector<Eigen::Vector3d>& points) {
    SetRotations(poses);
    double cost = 0, slope = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
        const Sight& sight = sights_[k];
        if (!sight.counts) continue;
        const Eigen::Vector3d p = rotations_[At(sight.pose)] * points[i] + poses[At(sight.pose)].translation;
        const double squared = p.z() > kMinBundleDepth ? (camera_.Project(p) - sight.uv_px).squaredNorm() *
                                                             sight.inv_sigma * sight.inv_sigma
                                                       : kErrorBehind * kErrorBehind;
        cost += 0.5 * Loss(squared, &slope);
      }
    }
    return cost;
  }

  void SetRotations(const std::vector<Rigid3d>& poses) {
    for (size_t k = 0; k < poses.size(); ++k) rotations_[k] = poses[k].rotation.toRotationMatrix();
  }

  /// Takes the step if it helps.
  std::optional<Taken> TryStep(double damping, double cost) {
    const std::optional<Step> step = FindStep(damping);
    if (!step) return std::nullopt;
    std::vector<Rigid3d> poses = state_.poses;
    std::vector<Eigen::Vector3d> points = state_.problem.points;
    for (size_t k = 0, row = 0; k < poses.size(); ++k) {
      if (state_.pose_held[k]) continue;
      const Vector6 own = step->poses.segment<6>(static_cast<Eigen::Index>(row));
      poses[k] = Rigid3d(ExpSo3(own.head<3>()), own.tail<3>()) * poses[k];
      row += 6;
    }
    for (size_t i = 0; i < points.size(); ++i) points[i] += step->points[i];
    const double moved_cost = Cost(poses, points);
    const double gain_ratio = (cost - moved_cost) / step->predicted_gain;
    if (!(gain_ratio > kLeastGainRatio) || !std::isfinite(moved_cost)) return std::nullopt;
    state_.poses = std::move(poses);
    state_.problem.points = std::move(points);
    return Taken{moved_cost, gain_ratio};
  }

  /// The step that minimises the quadratic model with that damping, a share of the diagonal.
  std::optional<Step> FindStep(double damping) {
    normal_.setZero(size_, size_);
    gradient_.setZero(size_);
    SetRotations(state_.poses);
    for (size_t i = 0; i < inverses_.size(); ++i) AddPoint(i);
    const Eigen::VectorXd diagonal = normal_.diagonal();
    normal_.diagonal() += damping * diagonal;
    HoldBlindPoses(diagonal);
    Eigen::VectorXd reduced = gradient_;
    for (size_t i = 0; i < inverses_.size(); ++i) Eliminate(i, damping, &reduced);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factored(normal_);
    if (factored.info() != Eigen::Success) return std::nullopt;
    Step step;
    step.poses = -factored.solve(reduced);
    double slope = gradient_.dot(step.poses);
    double damped = step.poses.cwiseAbs2().dot(diagonal);
    for (size_t i = 0; i < inverses_.size(); ++i) {
      const Eigen::Vector3d& moved = step.points.emplace_back(PointStep(i, step.poses));
      slope += gradients_[i].dot(moved);
      damped += moved.cwiseAbs2().dot(diagonals_[i]);
    }
    step.predicted_gain = 0.5 * (damping * damped - slope);
    return step;
  }

  /// A pose that sees nothing which counts stays: its equations are empty, and nothing could be solved with
  /// them.
  void HoldBlindPoses(const Eigen::VectorXd& diagonal) {
    for (Eigen::Index row = 0; row < size_; ++row) {
      if (diagonal[row] == 0.0) normal_(row, row) = 1.0;
    }
  }

  /// Adds what the views see of the point to the normal equations of the poses; keeps what is the point's.
  void AddPoint(size_t i) {
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
    gradients_[i].setZero();
    for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
      const Sight& sight = sights_[k];
      couplings_[k].setZero();
      const Eigen::Matrix3d& R = rotations_[At(sight.pose)];
      const Eigen::Vector3d p = R * state_.problem.points[i] + state_.poses[At(sight.pose)].translation;
      if (!sight.counts || !(p.z() > kMinBundleDepth)) continue;
      const Eigen::Vector2d error = sight.inv_sigma * (camera_.Project(p) - sight.uv_px);
      double weight = 1;
      Loss(error.squaredNorm(), &weight);
      const Matrix23 by_point = sight.inv_sigma * ProjectionJacobian(camera_, p) * R;
      own.noalias() += weight * by_point.transpose() * by_point;
      gradients_[i].noalias() += weight * by_point.transpose() * error;
      if (sight.row < 0) continue;
      const Matrix26 by_pose = sight.inv_sigma * PoseJacobian(camera_, p);
      const Matrix26 weighted = weight * by_pose;
      normal_.block<6, 6>(sight.row, sight.row).noalias() += weighted.transpose() * by_pose;
      gradient_.segment<6>(sight.row).noalias() += weighted.transpose() * error;
      couplings_[k].noalias() = weighted.transpose() * by_point;
    }
    if (state_.PointHeld(static_cast<int>(i))) {
      own.setZero();
      gradients_[i].setZero();
    }
    inverses_[i] = own;  // until it is damped and inverted
    diagonals_[i] = own.diagonal();
  }

  /// Takes the point out of the poses' equations.
  void Eliminate(size_t i, double damping, Eigen::VectorXd* reduced) {
    inverses_[i].diagonal() += damping * diagonals_[i];
    if (!(inverses_[i].determinant() > 0)) {
      inverses_[i].setZero();  // held, or seen by nobody: it stays where it is
      return;
    }
    inverses_[i] = inverses_[i].inverse().eval();
    for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
      const Eigen::Index row = sights_[k].row;
      if (row < 0 || !sights_[k].counts) continue;
      const Matrix63 solved = couplings_[k] * inverses_[i];
      reduced->segment<6>(row).noalias() -= solved * gradients_[i];
      for (size_t l = first_[i]; l <= k; ++l) {  // the lower half
        if (sights_[l].row < 0 || !sights_[l].counts) continue;
        normal_.block<6, 6>(row, sights_[l].row).noalias() -= solved * couplings_[l].transpose();
      }
    }
  }

  Eigen::Vector3d PointStep(size_t i, const Eigen::VectorXd& poses) const {
    Eigen::Vector3d sum = gradients_[i];
    for (size_t k = first_[i]; k < first_[i + 1]; ++k) {
      if (sights_[k].row < 0) continue;
      sum.noalias() += couplings_[k].transpose() * poses.segment<6>(sights_[k].row);
    }
    return -inverses_[i] * sum;
  }

  const BundleOptions& options_;
  BundleState& state_;
  Pinhole camera_;
  bool cauchy_ = false;
  Eigen::Index size_ = 0;         ///< of the poses' equations
  std::vector<Sight> sights_;     ///< by point, then by pose; the held ones first
  std::vector<size_t> first_;     ///< of each point
  std::vector<size_t> place_of_;  ///< of each observation
  std::vector<Eigen::Matrix3d> rotations_;
  Eigen::MatrixXd normal_;  ///< of the poses; the lower half
  Eigen::VectorXd gradient_;
  std::vector<Matrix63> couplings_;         ///< of each sight: pose with point
  std::vector<Eigen::Matrix3d> inverses_;   ///< of each point's own equations
  std::vector<Eigen::Vector3d> gradients_;  ///< of each point
  std::vector<Eigen::Vector3d> diagonals_;
};

}  // namespace

std::unique_ptr<BundleSolver> MakeDenseBundle(const BundleOptions& options, BundleState* state) {
  return std::make_unique<DenseBundle>(options, state);
}

}  // namespace dmslam
