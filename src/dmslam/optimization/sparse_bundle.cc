#include "dmslam/optimization/sparse_bundle.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <deque>

#include "dmslam/optimization/bundle_cost.h"
#include "dmslam/optimization/ceres_support.h"

namespace dmslam {
namespace {

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

class SparseBundle : public BundleSolver {
 public:
  SparseBundle(const BundleOptions& options, BundleState* state)
      : options_(options),
        state_(*state),
        loss_(options.huber_delta, options.cauchy_width),
        refresh_(shared_) {
    shared_.camera = state->problem.camera;
    shared_.poses.resize(state->poses.size());
    for (size_t i = 0; i < shared_.poses.size(); ++i) {
      shared_.poses[i].start = state->poses[i];
      shared_.poses[i].Update();
    }
    ceres::Problem::Options problem;
    problem.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem.disable_all_safety_checks = true;
    problem.evaluation_callback = &refresh_;
    ceres_problem_ = std::make_unique<ceres::Problem>(problem);
    ordering_ = std::make_shared<ceres::ParameterBlockOrdering>();
    const size_t count = state->problem.observations.size();
    block_of_.assign(count, {nullptr, nullptr, nullptr});
    for (size_t i = 0; i < count; ++i) AddObservation(i);
  }

  int NumTerms() const override { return ceres_problem_->NumResidualBlocks(); }

  BundleStageResult Solve(const BundleStage& stage) override {
    loss_.kind = stage.cauchy ? BundleLoss::Kind::kCauchy : BundleLoss::Kind::kHuber;
    ceres::Solver::Options options = QuietSolverOptions(kBundleTrustRegion);
    options.max_num_iterations = stage.iterations;
    options.function_tolerance = stage.relative_tolerance;
    options.linear_solver_type = ceres::SPARSE_SCHUR;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>(*ordering_);
    InterruptCallback interrupt(options_.interrupt);
    if (options_.interrupt) options.callbacks.push_back(&interrupt);
    ceres::Solver::Summary summary;
    ceres::Solve(options, ceres_problem_.get(), &summary);
    for (size_t i = 0; i < shared_.poses.size(); ++i) {
      shared_.poses[i].Update();
      if (!state_.pose_held[i]) state_.poses[i] = shared_.poses[i].Current();
    }
    BundleStageResult result;
    result.sound = summary.IsSolutionUsable();
    result.interrupted = interrupt.interrupted();
    result.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
    if (!result.sound) result.message = summary.message;
    return result;
  }

  void Disable(size_t observation) override {
    const Block& block = block_of_[observation];
    if (block.both) block.both->Disable();
    if (block.pose_only) block.pose_only->Disable();
    if (block.point_only) block.point_only->Disable();
  }

 private:
  struct Block {
    BothCost* both;
    PoseCost* pose_only;
    PointCost* point_only;
  };

  void AddObservation(size_t i) {
    const BundleObservation& o = state_.problem.observations[i];
    const bool pose_held = state_.PoseHeld(o.pose), point_held = state_.PointHeld(o.point);
    if (!state_.active[i] || (pose_held && point_held)) return;
    PoseState& pose = shared_.poses[At(o.pose)];
    Eigen::Vector3d& point = state_.problem.points[At(o.point)];
    if (point_held) {
      block_of_[i].pose_only = &pose_only_.emplace_back(shared_.camera, pose, point, o);
      ceres_problem_->AddResidualBlock(block_of_[i].pose_only, &loss_, pose.step.data());
    } else if (pose_held) {
      block_of_[i].point_only = &point_only_.emplace_back(shared_.camera, pose, point, o);
      ceres_problem_->AddResidualBlock(block_of_[i].point_only, &loss_, point.data());
    } else {
      block_of_[i].both = &both_.emplace_back(shared_.camera, pose, point, o);
      ceres_problem_->AddResidualBlock(block_of_[i].both, &loss_, pose.step.data(), point.data());
    }
    if (!point_held) ordering_->AddElementToGroup(point.data(), 0);
    if (!pose_held) ordering_->AddElementToGroup(pose.step.data(), 1);
  }

  const BundleOptions& options_;
  BundleState& state_;
  Shared shared_;
  BundleLoss loss_;
  RefreshPoses refresh_;
  std::deque<BothCost> both_;
  std::deque<PoseCost> pose_only_;
  std::deque<PointCost> point_only_;
  std::vector<Block> block_of_;
  std::unique_ptr<ceres::Problem> ceres_problem_;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_;
};

}  // namespace

std::unique_ptr<BundleSolver> MakeSparseBundle(const BundleOptions& options, BundleState* state) {
  return std::make_unique<SparseBundle>(options, state);
}

}  // namespace dmslam
