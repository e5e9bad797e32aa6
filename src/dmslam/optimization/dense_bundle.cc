#include "dmslam/optimization/dense_bundle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "dmslam/optimization/dense_equations.h"

namespace dmslam {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kMostDamping = 1e3;
constexpr double kLeastDamping = 1e-16;
constexpr double kLeastGainRatio = 1e-3;

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

/// The points' sights in their order; the poses that are free get numbers in theirs.
BundleSights SightsByPoint(const BundleState& state) {
  const std::vector<BundleObservation>& observations = state.problem.observations;
  std::vector<std::optional<size_t>> free_pose(state.poses.size());
  size_t free_poses = 0;
  for (size_t k = 0; k < free_pose.size(); ++k) {
    if (!state.pose_held[k]) free_pose[k] = free_poses++;
  }
  BundleSights sights;
  sights.first.assign(state.problem.points.size() + 1, 0);
  for (const BundleObservation& o : observations) ++sights.first[At(o.point) + 1];
  std::partial_sum(sights.first.begin(), sights.first.end(), sights.first.begin());
  sights.all.resize(observations.size());
  std::vector<size_t> next(sights.first.begin(), sights.first.end() - 1);
  for (size_t i = 0; i < observations.size(); ++i) {
    const BundleObservation& o = observations[i];
    const std::optional<size_t> pose = free_pose[At(o.pose)];
    const bool adjusts = pose.has_value() || !state.PointHeld(o.point);
    sights.all[next[At(o.point)]++] = {
        i, At(o.pose), pose, o.uv_px, std::sqrt(o.inv_sigma_squared), state.active[i] && adjusts};
  }
  for (size_t i = 0; i < sights.num_points(); ++i) {
    std::ranges::sort(sights.all.begin() + static_cast<ptrdiff_t>(sights.first[i]),
                      sights.all.begin() + static_cast<ptrdiff_t>(sights.first[i + 1]), {},
                      &BundleSight::free_pose);
  }
  return sights;
}

class DenseBundle : public BundleSolver {
 public:
  DenseBundle(const BundleOptions& options, BundleState* state)
      : options_(options),
        state_(*state),
        camera_(state->problem.camera),
        loss_{.huber_delta = options.huber_delta, .cauchy_width = options.cauchy_width},
        sights_(SightsByPoint(*state)),
        rotations_(state->poses.size()),
        equations_(static_cast<size_t>(std::ranges::count(state->pose_held, 0)), sights_) {
    place_of_.resize(sights_.all.size());
    for (size_t k = 0; k < sights_.all.size(); ++k) place_of_[sights_.all[k].observation] = k;
  }

  int NumTerms() const override {
    return static_cast<int>(
        std::ranges::count_if(sights_.all, [](const BundleSight& sight) { return sight.counts; }));
  }

  void Disable(size_t observation) override { sights_.all[place_of_[observation]].counts = false; }

  BundleStageResult Solve(const BundleStage& stage) override {
    BundleStageResult result;
    loss_.cauchy = stage.cauchy;
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
  double Cost(const std::vector<Rigid3d>& poses, const std::vector<Eigen::Vector3d>& points) {
    SetRotations(poses);
    return CostOf(camera_, loss_, sights_, {poses, rotations_, points, {}});
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
    SetRotations(state_.poses);
    SetEquations(camera_, loss_, sights_,
                 {state_.poses, rotations_, state_.problem.points, state_.problem.point_fixed}, &equations_);
    const Eigen::VectorXd diagonal = DampPoses(damping);
    EliminatePoints(sights_, damping, &equations_);
    Step step;
    if (!SolvePoses(&step.poses)) return std::nullopt;
    double slope = ToVector(equations_.gradient).dot(step.poses);
    double damped = step.poses.cwiseAbs2().dot(diagonal);
    for (size_t i = 0; i < sights_.num_points(); ++i) {
      const Eigen::Vector3d& moved = step.points.emplace_back(PointStep(i, step.poses));
      slope += equations_.point_gradients[i].dot(moved);
      damped += moved.cwiseAbs2().dot(equations_.points[i].diagonal());
    }
    step.predicted_gain = 0.5 * (damping * damped - slope);
    return step;
  }

  /// The diagonal as it was. A pose that sees nothing which counts stays: its equations are empty, and
  /// nothing could be solved with them.
  Eigen::VectorXd DampPoses(double damping) {
    Eigen::VectorXd diagonal(static_cast<Eigen::Index>(kPoseSize * equations_.num_poses()));
    for (size_t k = 0; k < equations_.num_poses(); ++k) {
      for (size_t i = 0; i < kPoseSize; ++i) {
        double& own = equations_.Pose(k, k)[i].row[i];
        diagonal[static_cast<Eigen::Index>(kPoseSize * k + i)] = own;
        own = own == 0.0 ? 1.0 : own + damping * own;
      }
    }
    return diagonal;
  }

  bool SolvePoses(Eigen::VectorXd* step) {
    const auto size = static_cast<Eigen::Index>(kPoseSize * equations_.num_poses());
    normal_.resize(size, size);
    for (size_t k = 0; k < equations_.num_poses(); ++k) {
      for (size_t l = 0; l <= k; ++l) {
        const PoseBlock& block = equations_.Pose(k, l);
        for (size_t c = 0; c < kPoseSize; ++c) {
          const auto row = static_cast<Eigen::Index>(kPoseSize * k);
          normal_.block<kPoseSize, 1>(row, static_cast<Eigen::Index>(kPoseSize * l + c)) = block[c].Numbers();
        }
      }
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factored(normal_);  // of the lower half
    if (factored.info() != Eigen::Success) return false;
    *step = -factored.solve(ToVector(equations_.reduced));
    return true;
  }

  static Eigen::VectorXd ToVector(const std::vector<PoseColumn>& columns) {
    Eigen::VectorXd all(static_cast<Eigen::Index>(kPoseSize * columns.size()));
    for (size_t k = 0; k < columns.size(); ++k)
      all.segment<kPoseSize>(static_cast<Eigen::Index>(kPoseSize * k)) = columns[k].Numbers();
    return all;
  }

  Eigen::Vector3d PointStep(size_t i, const Eigen::VectorXd& poses) const {
    Eigen::Vector3d sum = equations_.point_gradients[i];
    for (size_t k = sights_.first[i]; k < sights_.first[i + 1]; ++k) {
      const std::optional<size_t> pose = sights_.all[k].free_pose;
      if (!pose) continue;
      const auto moved = poses.segment<kPoseSize>(static_cast<Eigen::Index>(kPoseSize * *pose));
      for (int c = 0; c < 3; ++c)
        sum[c] += equations_.couplings[k][static_cast<size_t>(c)].Numbers().dot(moved);
    }
    return -equations_.point_inverses[i] * sum;
  }

  const BundleOptions& options_;
  BundleState& state_;
  Pinhole camera_;
  BundleRobustLoss loss_;
  BundleSights sights_;
  std::vector<size_t> place_of_;  ///< of each observation, among the sights
  std::vector<Eigen::Matrix3d> rotations_;
  DenseEquations equations_;
  Eigen::MatrixXd normal_;  ///< of the poses without the points; the lower half
};

}  // namespace

std::unique_ptr<BundleSolver> MakeDenseBundle(const BundleOptions& options, BundleState* state) {
  return std::make_unique<DenseBundle>(options, state);
}

}  // namespace dmslam
