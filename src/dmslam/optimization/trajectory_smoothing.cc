#include "dmslam/optimization/trajectory_smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dmslam/geometry/symmetric_eigen.h"
#include "dmslam/optimization/block_tridiagonal.h"
#include "dmslam/util/parallel.h"

namespace dmslam {
namespace {

// The motion: pose, its rate, and the rate's rate; each (rotation, centre). With it the error that the frame
// has in common with the one before.
constexpr int kPose = 6, kMotion = 3 * kPose, kState = kMotion + kPose;
constexpr double kLeastInformation = 1e-12;  // keeps determined what nothing is known of
constexpr double kMinInterval = 0.05;        // of two frames, in usual intervals
constexpr double kMinLogVariance = -37.0, kMaxLogVariance = 14.0;       // of a standing camera; of any
constexpr double kMaxCarried = 0.9999;                                  // of a common error to the next frame
constexpr double kFirstStep = 2.0, kLaterStep = 0.5, kLeastStep = 0.1;  // of a logarithm
constexpr double kMinSpread = 1e-9;  // of an information's eigenvalue to the largest: less says nothing
using StateMatrix = BlockTridiagonal::Block;
using StateVector = BlockTridiagonal::Part;
static_assert(kState == BlockTridiagonal::kBlock);

/// Of one frame; times are in usual frame intervals.
struct State {
  Eigen::Quaterniond R_world_cam;
  Eigen::Vector3d center;
  Vector6d rate = Vector6d::Zero(), acceleration = Vector6d::Zero();
  Vector6d common = Vector6d::Zero();  ///< error, in standard deviations of the pose

  void Step(const StateVector& step) {
    R_world_cam = (R_world_cam * ExpSo3(step.head<3>())).normalized();
    center += step.segment<3>(3);
    rate += step.segment<kPose>(kPose);
    acceleration += step.segment<kPose>(2 * kPose);
    common += step.tail<kPose>();
  }
};

/// Motion from `a` to `b`: (rotation in a's frame, shift in the world).
Vector6d Difference(const State& a, const State& b) {
  Vector6d difference;
  difference << LogSo3(a.R_world_cam.conjugate() * b.R_world_cam), b.center - a.center;
  return difference;
}

/// What a frame's errors have in common with the frame before: common(k) = carried * common(k - 1) + new,
/// such that the variance stays the same.
struct Likeness {
  Matrix6d carried = Matrix6d::Zero();
  Matrix6d weight = Matrix6d::Identity();  ///< of what is new: (1 - carried carried^T)^-1
  double log_determinant = 0.0;            ///< of the weight
};

/// For A = U diag(carried) U^T, or turned on its right.
Likeness MakeLikeness(const Vector6d& carried, const Matrix6d& U) {
  const Vector6d is_new = Vector6d::Ones() - carried.cwiseAbs2();
  Likeness likeness;
  likeness.carried = U * carried.asDiagonal() * U.transpose();
  likeness.weight = U * is_new.cwiseInverse().asDiagonal() * U.transpose();
  likeness.log_determinant = -is_new.array().log().sum();
  return likeness;
}

/// Errors in standard deviations, I^(1/2) error: those of frames j and k that the same landmarks make have
/// the covariance I_k^(-1/2) I_shared I_j^(-1/2). `shared` is told from frame k, as if j had seen all of it:
/// a singular value s above 1 is a direction in which j knows less, and of j's error at most 1/s goes on
/// there.
Likeness LikenessOf(const Matrix6d& shared, const Matrix6d& inverse_root,
                    const Matrix6d& inverse_root_before) {
  const Matrix6d covariance = inverse_root * shared * inverse_root_before;
  const SymmetricEigen<6> eigen = EigenOfSymmetric<6>(covariance * covariance.transpose());
  const Matrix6d& U = eigen.vectors;
  const Vector6d singular = eigen.values.cwiseMax(kMinSpread).cwiseSqrt();
  const Vector6d carried = singular.cwiseMin(singular.cwiseInverse()).cwiseMin(kMaxCarried);
  Likeness likeness = MakeLikeness(carried, U);
  likeness.carried = U * carried.cwiseQuotient(singular).asDiagonal() * U.transpose() * covariance;
  return likeness;
}

/// What is searched for besides the states, as logarithms.
struct Variances {
  double pose = 0.0, rotation = 0.0, translation = 0.0;
  double& operator[](int i) { return i == 0 ? pose : i == 1 ? rotation : translation; }
};

/// How well the motion holds, of the rotation and of the centre, in each direction.
struct Precision {
  double rotation = 0.0, translation = 0.0;

  Eigen::Matrix<double, kPose, 3> Times(const Eigen::Matrix<double, kPose, 3>& error) const {
    Eigen::Matrix<double, kPose, 3> weighed;
    weighed << rotation * error.topRows<3>(), translation * error.bottomRows<3>();
    return weighed;
  }

  /// Adds `times` of it to the block of (pose, rate, acceleration) i by j, its rotation turned.
  void AddTo(int i, int j, double times, const Eigen::Matrix3d& turn, StateMatrix* to) const {
    to->block<3, 3>(kPose * i, kPose * j) += times * rotation * turn;
    to->block<3, 3>(kPose * i + 3, kPose * j + 3).diagonal().array() += times * translation;
  }
};

/// turn^T on the left, turn on the right, or both, which cancel.
Eigen::Matrix3d Turned(const Eigen::Matrix3d& turn, bool left, bool right) {
  if (left == right) return Eigen::Matrix3d::Identity();
  return left ? Eigen::Matrix3d(turn.transpose()) : turn;
}

/// The sum of squares around the present states. The right side is the negative gradient.
struct NormalEquations {
  BlockTridiagonal system;
  double cost = 0.0;              ///< sum of the squared errors
  double log_determinants = 0.0;  ///< of the information of all errors
};

class Smoother {
 public:
  Smoother(std::span<const PoseEstimate> estimates, const SmoothingOptions& options)
      : estimates_(estimates), options_(options), weights_(estimates.size(), 1.0) {
    interval_s_ = UsualInterval();
    for (const PoseEstimate& estimate : estimates) AddEstimate(estimate);
    FirstGuess();
    if (options.noise) variances_ = ToVariances(*options.noise);
  }

  SmoothedTrajectory Run() {
    for (int round = 0; round < options_.rounds; ++round) {
      if (!options_.noise) FindVariances(round == 0 ? kFirstStep : kLaterStep);
      for (int k = 0; k < 2; ++k) Update();
      Weigh();
    }
    Update();
    return Result();
  }

 private:
  void AddEstimate(const PoseEstimate& estimate) {
    State state;
    state.R_world_cam = estimate.T_cam_world.rotation.conjugate();
    state.center = estimate.T_cam_world.Center();
    states_.push_back(state);
    measured_.push_back(state);
    // A step (w, v) on the left of T_cam_world turns the camera by -w in its own frame and shifts its
    // centre by -R_world_cam v.
    Matrix6d left = Matrix6d::Zero();
    left.topLeftCorner<3, 3>() = -Eigen::Matrix3d::Identity();
    left.bottomRightCorner<3, 3>() = -estimate.T_cam_world.rotation.toRotationMatrix();
    const Matrix6d information = left.transpose() * estimate.information * left;
    const SymmetricEigen<6> eigen = EigenOfSymmetric(information);
    const Vector6d root = eigen.values.cwiseMax(0.0).cwiseSqrt();
    const double least = std::sqrt(kMinSpread) * root.maxCoeff();
    const Vector6d inverse = (root.array() > least).select(root.cwiseInverse(), 0.0);
    const Matrix6d inverse_root = eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
    if (!likeness_.empty() && root.isZero(0.0)) {
      likeness_.push_back(MakeLikeness(kMaxCarried * Vector6d::Ones(), Matrix6d::Identity()));
    } else {
      likeness_.push_back(
          LikenessOf(left.transpose() * estimate.shared * left, inverse_root, inverse_root_before_));
      inverse_root_before_ = inverse_root;
    }
    roots_.push_back(eigen.vectors * root.asDiagonal() * eigen.vectors.transpose());
  }

  /// The median of the times between frames.
  double UsualInterval() const {
    std::vector<double> intervals_s;
    for (size_t k = 0; k + 1 < estimates_.size(); ++k) {
      intervals_s.push_back(estimates_[k + 1].time_s - estimates_[k].time_s);
    }
    const auto middle = intervals_s.begin() + static_cast<std::ptrdiff_t>(intervals_s.size() / 2);
    std::nth_element(intervals_s.begin(), middle, intervals_s.end());
    return std::max(*middle, 1e-6);
  }
  /// From frame k to the next, in usual intervals.
  double Interval(size_t k) const {
    return std::max((estimates_[k + 1].time_s - estimates_[k].time_s) / interval_s_, kMinInterval);
  }
  bool Joined(size_t k) const {
    return !estimates_[k + 1].leaps && estimates_[k + 1].time_s - estimates_[k].time_s <= options_.max_gap_s;
  }

  void FirstGuess() {
    for (size_t k = 0; k + 1 < states_.size(); ++k) {
      if (!Joined(k)) continue;
      states_[k].rate = Difference(states_[k], states_[k + 1]) / Interval(k);
    }
    // As if all that the motions change from frame to frame were their own doing.
    double rotation = 0.0, translation = 0.0;
    for (size_t k = 0; k + 1 < states_.size(); ++k) {
      if (!Joined(k)) continue;
      const Vector6d change = states_[k + 1].rate - states_[k].rate;
      rotation += change.head<3>().squaredNorm();
      translation += change.tail<3>().squaredNorm();
    }
    const double count = 3.0 * static_cast<double>(states_.size());
    variances_.rotation = std::log(std::max(rotation / count, 1e-16));
    variances_.translation = std::log(std::max(translation / count, 1e-16));
    variances_.pose = std::min(variances_.pose, std::log(options_.max_variance));
  }

  /// What is wrong with the measured pose, in its standard deviations, besides what is common.
  Vector6d OwnError(size_t k) const {
    return roots_[k] * Difference(measured_[k], states_[k]) + states_[k].common;
  }

  void AddPoses(const Variances& variances, NormalEquations* equations) const {
    for (size_t k = 0; k < states_.size(); ++k) {
      if (roots_[k].isZero(0.0)) continue;
      const double weight = weights_[k] * std::exp(-variances.pose);
      const Vector6d error = OwnError(k);
      Eigen::Matrix<double, kPose, kState> J = Eigen::Matrix<double, kPose, kState>::Zero();
      J.leftCols<kPose>() = roots_[k];
      J.rightCols<kPose>().setIdentity();
      equations->system.diagonal[k].noalias() += weight * J.transpose() * J;
      equations->system.right[k].noalias() -= weight * J.transpose() * error;
      equations->cost += weight * error.squaredNorm();
      equations->log_determinants -= kPose * variances.pose;
    }
  }

  void AddCommonErrors(NormalEquations* equations) const {
    for (size_t k = 0; k < states_.size(); ++k) {
      const Likeness& likeness = likeness_[k];
      const Matrix6d weight = likeness.weight / options_.common_variance;
      const bool first = k == 0;
      const Vector6d error =
          first ? states_[k].common : states_[k].common - likeness.carried * states_[k - 1].common;
      equations->cost += error.dot(weight * error);
      equations->log_determinants += likeness.log_determinant;
      equations->system.right[k].tail<kPose>() -= weight * error;
      equations->system.diagonal[k].bottomRightCorner<kPose, kPose>() += weight;
      if (first) continue;
      const Matrix6d carried = likeness.carried.transpose() * weight;
      equations->system.right[k - 1].tail<kPose>() += carried * error;
      equations->system.diagonal[k - 1].bottomRightCorner<kPose, kPose>() += carried * likeness.carried;
      equations->system.above[k - 1].bottomRightCorner<kPose, kPose>() -= carried;
    }
  }

  /// White noise on the jerk between frames k and k + 1. The error of (pose, rate, acceleration) is what b is
  /// beyond where a goes on to: d error / d a = -T, but that the pose's rotation is turned into b's frame,
  /// and d error / d b = 1. Its weight is that of the three by each other, times `precision` for each
  /// direction.
  void AddMotion(size_t k, const Variances& variances, NormalEquations* equations) const {
    const double dt = Interval(k), dt2 = dt * dt, dt3 = dt2 * dt;
    Eigen::Matrix3d covariance, T;
    covariance << dt2 * dt3 / 20.0, dt2 * dt2 / 8.0, dt3 / 6.0, dt2 * dt2 / 8.0, dt3 / 3.0, dt2 / 2.0,
        dt3 / 6.0, dt2 / 2.0, dt;
    T << 1.0, dt, 0.5 * dt2, 0.0, 1.0, dt, 0.0, 0.0, 1.0;
    const Eigen::Matrix3d weight = covariance.inverse(), before = T.transpose() * weight, both = before * T;
    const State &a = states_[k], &b = states_[k + 1];
    const Eigen::Matrix3d turn = (b.R_world_cam.conjugate() * a.R_world_cam).toRotationMatrix();
    const Precision precision = {std::exp(-variances.rotation), std::exp(-variances.translation)};
    Eigen::Matrix<double, kPose, 3> error;  // a column each
    error << Difference(a, b) - dt * a.rate - 0.5 * dt2 * a.acceleration,
        b.rate - a.rate - dt * a.acceleration, b.acceleration - a.acceleration;
    const Eigen::Matrix<double, kPose, 3> weighed = precision.Times(error);
    Eigen::Matrix<double, kPose, 3> of_a = weighed * before.transpose();
    of_a.topLeftCorner<3, 1>() = turn.transpose() * of_a.topLeftCorner<3, 1>();
    const Eigen::Matrix<double, kPose, 3> of_b = weighed * weight;
    BlockTridiagonal& system = equations->system;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        precision.AddTo(i, j, both(i, j), Turned(turn, i == 0, j == 0), &system.diagonal[k]);
        precision.AddTo(i, j, weight(i, j), Turned(turn, false, false), &system.diagonal[k + 1]);
        precision.AddTo(i, j, -before(i, j), Turned(turn, i == 0, false), &system.above[k]);
      }
      system.right[k].segment<kPose>(kPose * i) += of_a.col(i);
      system.right[k + 1].segment<kPose>(kPose * i) -= of_b.col(i);
    }
    equations->cost += error.cwiseProduct(of_b).sum();
    equations->log_determinants -= 9.0 * (variances.rotation + variances.translation);
  }

  void Linearize(const Variances& variances, NormalEquations* equations) const {
    equations->cost = equations->log_determinants = 0.0;
    equations->system.diagonal.assign(states_.size(), kLeastInformation * StateMatrix::Identity());
    equations->system.above.assign(states_.size() - 1, StateMatrix::Zero());
    equations->system.right.assign(states_.size(), StateVector::Zero());
    AddPoses(variances, equations);
    AddCommonErrors(equations);
    for (size_t k = 0; k + 1 < states_.size(); ++k) {
      if (Joined(k)) AddMotion(k, variances, equations);
    }
  }

  /// -2 log of the likelihood of the poses, the states integrated out.
  double Unlikelihood(const Variances& variances, NormalEquations* equations) const {
    Linearize(variances, equations);
    const std::vector<StateVector> downhill = equations->system.right;
    const std::optional<double> log_determinant = Solve(&equations->system);
    if (!log_determinant) return std::numeric_limits<double>::infinity();
    double cost = equations->cost;  // at the minimum: less by what the steps gain
    for (size_t k = 0; k < downhill.size(); ++k) cost -= downhill[k].dot(equations->system.right[k]);
    return cost + *log_determinant - equations->log_determinants;
  }

  /// One logarithm after the other, by steps that become smaller.
  void FindVariances(double step) {
    double best = Unlikelihood(variances_, &equations_[0]);
    for (; step > kLeastStep; step *= 0.5) {
      for (int i = 0; i < 3; ++i) FindVariance(i, step, &best);
    }
  }

  /// Up if that is better, else down, as far as it goes. Both ways are tried at the same time, as most often
  /// neither is better.
  void FindVariance(int i, double step, double* best) {
    const std::array<double, 2> ways = {step, -step};
    std::array<double, 2> after{};
    ForEachInParallel(2, options_.threads,
                      [&](size_t way) { after[way] = UnlikelihoodAfter(i, ways[way], &equations_[way]); });
    const size_t way = after[0] < *best ? 0 : 1;
    for (double now = after[way]; now < *best; now = UnlikelihoodAfter(i, ways[way], &equations_[way])) {
      *best = now;
      variances_[i] += ways[way];
    }
  }

  double UnlikelihoodAfter(int i, double by, NormalEquations* equations) const {
    Variances tried = variances_;
    tried[i] += by;
    if (tried.pose < std::log(options_.min_variance) || tried.pose > std::log(options_.max_variance) ||
        tried[i] < kMinLogVariance || tried[i] > kMaxLogVariance) {
      return std::numeric_limits<double>::infinity();
    }
    return Unlikelihood(tried, equations);
  }

  void Update() {
    Linearize(variances_, &equations_[0]);
    if (!Solve(&equations_[0].system)) return;
    for (size_t k = 0; k < states_.size(); ++k) states_[k].Step(equations_[0].system.right[k]);
  }

  void Weigh() {
    for (size_t k = 0; k < states_.size(); ++k) {
      const double chi2 = OwnError(k).squaredNorm() * std::exp(-variances_.pose);
      weights_[k] = (options_.freedom + kPose) / (options_.freedom + chi2);
    }
  }

  Variances ToVariances(const MotionNoise& noise) const {
    const double s5 = std::pow(interval_s_, 5.0);
    return {std::log(noise.variance), std::log(noise.jerk_rotation * s5),
            std::log(noise.jerk_translation * s5)};
  }

  MotionNoise ToNoise(const Variances& variances) const {
    const double s5 = std::pow(interval_s_, 5.0);
    return {std::exp(variances.pose), std::exp(variances.rotation) / s5,
            std::exp(variances.translation) / s5};
  }

  SmoothedTrajectory Result() const {
    SmoothedTrajectory result;
    result.noise = ToNoise(variances_);
    for (const State& state : states_) {
      result.T_cam_world.push_back(Rigid3d(state.R_world_cam, state.center).Inverse());
    }
    return result;
  }

  std::span<const PoseEstimate> estimates_;
  const SmoothingOptions& options_;
  double interval_s_ = 1.0;
  std::vector<State> states_, measured_;
  std::vector<Matrix6d> roots_;  ///< of the information of (rotation, centre)
  std::vector<Likeness> likeness_;
  Matrix6d inverse_root_before_ = Matrix6d::Zero();
  std::vector<double> weights_;
  Variances variances_;
  std::array<NormalEquations, 2> equations_;  ///< for what is tried at the same time; kept for their memory
};

}  // namespace

SmoothedTrajectory SmoothTrajectory(std::span<const PoseEstimate> estimates,
                                    const SmoothingOptions& options) {
  const bool enough = static_cast<int>(estimates.size()) >= std::max(options.min_poses, 2) &&
                      estimates.back().time_s > estimates.front().time_s;
  if (enough) return Smoother(estimates, options).Run();
  SmoothedTrajectory result;
  for (const PoseEstimate& estimate : estimates) result.T_cam_world.push_back(estimate.T_cam_world);
  return result;
}

}  // namespace dmslam
