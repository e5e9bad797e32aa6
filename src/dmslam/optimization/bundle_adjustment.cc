#include "dmslam/optimization/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <future>
#include <limits>
#include <memory>

#include "dmslam/optimization/bundle_cost.h"
#include "dmslam/optimization/ceres_support.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int kMaxPosesDense = 60;  ///< Above, the reduced camera system is factorised as a sparse matrix.
/// Whether a camera turned or moved aside before a wall is determined a hundred thousand times worse than the
/// diagonal says. Much more, and a young map bends for what is left of people.
constexpr double kBundleTrustRegion = 1e7;

/// What the cost functions of one problem share.
struct Shared {
  Pinhole camera;
  std::vector<PoseState> poses;
};

/// Refreshes the poses before Ceres evaluates.
class RefreshPoses : public ceres::EvaluationCallback {
 public:
  explicit RefreshPoses(Shared& shared) : shared_(shared) {}
  void PrepareForEvaluation(bool, bool new_evaluation_point) override {
    if (!new_evaluation_point) return;
    for (PoseState& pose : shared_.poses) pose.Update();
  }

 private:
  Shared& shared_;
};

class Adjustment {
 public:
  Adjustment(const BundleOptions& options, BundleProblem& problem)
      : options_(options),
        problem_(problem),
        loss_(options.huber_delta, options.cauchy_width),
        refresh_(shared_) {
    shared_.camera = problem.camera;
    CheckIndices();
    HoldPoses();
    active_.assign(problem.observations.size(), 1);
  }

  BundleReport Run() {
    BundleReport report;
    const std::vector<Eigen::Vector3d> points_before = problem_.points;
    report.initial_cost = RobustCost();
    SetAsideBehind();
    if (BuildCeresProblem() == 0) {
      report.message = "nothing to adjust";
    } else {
      const bool two_stages = options_.second_iterations > 0;
      const double tolerance = options_.relative_tolerance;
      // The first of two stages only has to tell the outliers.
      bool sound = SolveStage(options_.first_iterations, two_stages ? 10.0 * tolerance : tolerance,
                              BundleLoss::Kind::kHuber, report);
      if (sound && !report.interrupted && two_stages) {
        SetAsideOutliers();
        sound = SolveStage(options_.second_iterations, tolerance, BundleLoss::Kind::kCauchy, report);
      }
      report.usable = sound && AllFinite();
    }
    if (report.usable) {
      WritePoses();
    } else {
      problem_.points = points_before;
      for (PoseState& pose : shared_.poses) {
        pose.step.fill(0.0);
        pose.Update();
      }
    }
    report.final_cost = RobustCost();
    FlagOutliers(report);
    if (report.usable && options_.keep_scale) KeepScale();
    return report;
  }

 private:
  static size_t At(int index) { return static_cast<size_t>(index); }
  bool PoseHeld(int pose) const { return pose_held_[At(pose)]; }
  bool PointHeld(int point) const { return !problem_.point_fixed.empty() && problem_.point_fixed[At(point)]; }

  void CheckIndices() const {
    DMSLAM_CHECK(problem_.pose_fixed.empty() || problem_.pose_fixed.size() == problem_.T_cam_world.size(),
                 "one fixed flag per pose");
    DMSLAM_CHECK(problem_.point_fixed.empty() || problem_.point_fixed.size() == problem_.points.size(),
                 "one fixed flag per point");
    for (const BundleObservation& o : problem_.observations) {
      DMSLAM_CHECK(o.pose >= 0 && At(o.pose) < problem_.T_cam_world.size(), "observation names a pose");
      DMSLAM_CHECK(o.point >= 0 && At(o.point) < problem_.points.size(), "observation names a point");
    }
  }

  void HoldPoses() {
    const size_t count = problem_.T_cam_world.size();
    pose_held_.assign(count, 0);
    for (size_t i = 0; i < count; ++i) {
      pose_held_[i] = !problem_.pose_fixed.empty() && problem_.pose_fixed[i];
      num_held_ += pose_held_[i];
    }
    if (num_held_ == 0 && count > 0) pose_held_[0] = 1, num_held_ = 1;
    shared_.poses.resize(count);
    for (size_t i = 0; i < count; ++i) {
      shared_.poses[i].start = problem_.T_cam_world[i];
      shared_.poses[i].Update();
    }
  }

  Eigen::Vector3d InCamera(const BundleObservation& o) const {
    const PoseState& pose = shared_.poses[At(o.pose)];
    return pose.rotation * problem_.points[At(o.point)] + pose.translation;
  }

  double Chi2(const BundleObservation& o) const {
    const Eigen::Vector3d p = InCamera(o);
    if (!(p.z() > kMinBundleDepth)) return std::numeric_limits<double>::infinity();
    return (shared_.camera.Project(p) - o.uv_px).squaredNorm() * o.inv_sigma_squared;
  }

  double RobustCost() const {
    double cost = 0.0;
    for (const BundleObservation& o : problem_.observations) {
      double rho[3];
      loss_.EvaluateHuber(std::min(Chi2(o), kErrorBehind * kErrorBehind), rho);
      cost += 0.5 * rho[0];
    }
    return cost;
  }

  void SetAsideBehind() {
    for (size_t i = 0; i < active_.size(); ++i) {
      active_[i] = InCamera(problem_.observations[i]).z() > kMinBundleDepth;
    }
  }

  /// Residual blocks in the order of the observations. Returns how many.
  int BuildCeresProblem() {
    const size_t count = problem_.observations.size();
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    options.evaluation_callback = &refresh_;
    ceres_problem_ = std::make_unique<ceres::Problem>(options);
    ordering_ = std::make_shared<ceres::ParameterBlockOrdering>();
    block_of_.assign(count, {nullptr, nullptr, nullptr});
    for (size_t i = 0; i < count; ++i) AddObservation(i);
    return ceres_problem_->NumResidualBlocks();
  }

  void AddObservation(size_t i) {
    const BundleObservation& o = problem_.observations[i];
    if (!active_[i] || (PoseHeld(o.pose) && PointHeld(o.point))) return;
    PoseState& pose = shared_.poses[At(o.pose)];
    Eigen::Vector3d& point = problem_.points[At(o.point)];
    if (PointHeld(o.point)) {
      block_of_[i].pose_only = &pose_only_.emplace_back(shared_.camera, pose, point, o);
      ceres_problem_->AddResidualBlock(block_of_[i].pose_only, &loss_, pose.step.data());
    } else if (PoseHeld(o.pose)) {
      block_of_[i].point_only = &point_only_.emplace_back(shared_.camera, pose, point, o);
      ceres_problem_->AddResidualBlock(block_of_[i].point_only, &loss_, point.data());
    } else {
      block_of_[i].both = &both_.emplace_back(shared_.camera, pose, point, o);
      ceres_problem_->AddResidualBlock(block_of_[i].both, &loss_, pose.step.data(), point.data());
    }
    if (!PointHeld(o.point)) ordering_->AddElementToGroup(point.data(), 0);
    if (!PoseHeld(o.pose)) ordering_->AddElementToGroup(pose.step.data(), 1);
  }

  bool SolveStage(int iterations, double tolerance, BundleLoss::Kind loss, BundleReport& report) {
    loss_.kind = loss;
    ceres::Solver::Options options = QuietSolverOptions(kBundleTrustRegion);
    options.max_num_iterations = iterations;
    options.function_tolerance = tolerance;
    const int free_poses = static_cast<int>(problem_.T_cam_world.size()) - num_held_;
    options.linear_solver_type = free_poses <= kMaxPosesDense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>(*ordering_);
    InterruptCallback interrupt(options_.interrupt);
    if (options_.interrupt) options.callbacks.push_back(&interrupt);
    ceres::Solver::Summary summary;
    ceres::Solve(options, ceres_problem_.get(), &summary);
    for (PoseState& pose : shared_.poses) pose.Update();
    report.interrupted = interrupt.interrupted();
    report.iterations += std::max(0, static_cast<int>(summary.iterations.size()) - 1);
    if (!summary.IsSolutionUsable()) report.message = summary.message;
    return summary.IsSolutionUsable();
  }

  void SetAsideOutliers() {
    for (size_t i = 0; i < active_.size(); ++i) {
      if (!active_[i] || Chi2(problem_.observations[i]) <= options_.max_chi2) continue;
      active_[i] = 0;
      if (block_of_[i].both) block_of_[i].both->Disable();
      if (block_of_[i].pose_only) block_of_[i].pose_only->Disable();
      if (block_of_[i].point_only) block_of_[i].point_only->Disable();
    }
  }

  bool AllFinite() const {
    for (const PoseState& pose : shared_.poses) {
      if (!pose.Current().AllFinite()) return false;
    }
    for (const Eigen::Vector3d& point : problem_.points) {
      if (!point.allFinite()) return false;
    }
    return true;
  }

  void WritePoses() {
    for (size_t i = 0; i < shared_.poses.size(); ++i) {
      if (!pose_held_[i]) problem_.T_cam_world[i] = shared_.poses[i].Current();
    }
  }

  void FlagOutliers(BundleReport& report) const {
    report.outliers.assign(problem_.observations.size(), 0);
    for (size_t i = 0; i < report.outliers.size(); ++i) {
      report.outliers[i] = !(Chi2(problem_.observations[i]) <= options_.max_chi2);
      report.num_outliers += report.outliers[i];
    }
  }

  /// With one pose held and no point, the scale is free: the farthest camera gets its old distance back.
  void KeepScale() {
    if (num_held_ != 1) return;
    for (const char fixed : problem_.point_fixed) {
      if (fixed) return;
    }
    const size_t held =
        At(static_cast<int>(std::find(pose_held_.begin(), pose_held_.end(), 1) - pose_held_.begin()));
    const Eigen::Vector3d center = problem_.T_cam_world[held].Center();
    size_t farthest = held;
    double distance = 0.0;
    for (size_t i = 0; i < shared_.poses.size(); ++i) {
      const double d = (shared_.poses[i].start.Center() - center).norm();
      if (d > distance) distance = d, farthest = i;
    }
    const double now = (problem_.T_cam_world[farthest].Center() - center).norm();
    if (!(distance > 0.0) || !(now > 0.0)) return;
    const double scale = distance / now;
    for (Eigen::Vector3d& point : problem_.points) point = center + scale * (point - center);
    for (size_t i = 0; i < shared_.poses.size(); ++i) {
      if (i == held) continue;
      Rigid3d& T = problem_.T_cam_world[i];
      const Eigen::Vector3d moved = center + scale * (T.Center() - center);
      T.translation = T.rotation * -moved;
    }
  }

  struct Block {
    BothCost* both;
    PoseCost* pose_only;
    PointCost* point_only;
  };

  const BundleOptions& options_;
  BundleProblem& problem_;
  Shared shared_;
  BundleLoss loss_;
  RefreshPoses refresh_;
  std::vector<char> pose_held_;
  int num_held_ = 0;
  std::vector<char> active_;
  std::deque<BothCost> both_;
  std::deque<PoseCost> pose_only_;
  std::deque<PointCost> point_only_;
  std::vector<Block> block_of_;
  std::unique_ptr<ceres::Problem> ceres_problem_;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_;
};

}  // namespace

BundleReport AdjustBundle(const BundleOptions& options, BundleProblem& problem) {
  // Ceres makes some hundred thousand small allocations, all of which end with the adjustment. On the heap of
  // a long run they would lie in the gaps between landmarks all over it, and with a large map the adjustment
  // would spend two thirds of its time waiting for memory. A thread has a heap of its own (an arena of
  // malloc), which is empty before and after. The caller waits for it; nothing runs beside it, and
  // `interrupt` only reads a flag.
  return std::async(std::launch::async, [&] { return Adjustment(options, problem).Run(); }).get();
}

BundleOptions GlobalBundleOptions(int iterations) {
  BundleOptions options;
  options.first_iterations = iterations;
  options.second_iterations = 0;
  options.relative_tolerance = 1e-6;
  return options;
}

}  // namespace dmslam
