#include "dmslam/optimization/essential_graph.h"

#include <ceres/ceres.h>

#include <array>
#include <cmath>
#include <deque>

#include "dmslam/optimization/ceres_support.h"
#include "dmslam/util/check.h"

namespace dmslam {

Vector7d EssentialGraphResidual(const Sim3d& S_j_i, const Sim3d& S_i_world, const Sim3d& S_j_world,
                                Matrix7d* jacobian_i, Matrix7d* jacobian_j) {
  Vector7d residual = LogSim3(S_j_i * S_i_world * S_j_world.Inverse());
  // Log(S_j_i Exp(d) S_i S_j^-1) = Log(Exp(Ad d) E), and Log(E Exp(-d)) turns with the right Jacobian.
  if (jacobian_i != nullptr) *jacobian_i = LeftJacobianInverseSim3(residual) * AdjointSim3(S_j_i);
  if (jacobian_j != nullptr) *jacobian_j = -LeftJacobianInverseSim3(-residual);
  return residual;
}

namespace {

/// A node during the optimisation: rotation (x, y, z, w), translation, log of the scale.
using NodeState = std::array<double, 8>;

Sim3d ToSim3(const double* x) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x)), Eigen::Map<const Eigen::Vector3d>(x + 4),
          std::exp(x[7])};
}

void FromSim3(const Sim3d& S, double* x) {
  Eigen::Map<Eigen::Vector4d>{x} = S.rotation.coeffs();
  Eigen::Map<Eigen::Vector3d>{x + 4} = S.translation;
  x[7] = std::log(S.scale);
}

/// Left steps on Sim(3), of the scale too or not. The cost functions write their Jacobians with respect to
/// the step into the first columns of the eight, which this manifold's Jacobian picks.
template <int kTangent>
class LeftStepManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 8; }
  int TangentSize() const override { return kTangent; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    Vector7d step = Vector7d::Zero();
    step.head<kTangent>() = Eigen::Map<const Eigen::Matrix<double, kTangent, 1>>(delta);
    FromSim3(ExpSim3(step) * ToSim3(x), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 8, kTangent, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Vector7d step = LogSim3(ToSim3(y) * ToSim3(x).Inverse());
    Eigen::Map<Eigen::Matrix<double, kTangent, 1>>{y_minus_x} = step.head<kTangent>();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kTangent, 8, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

class EdgeCost : public ceres::SizedCostFunction<7, 8, 8> {
 public:
  explicit EdgeCost(const EssentialGraphEdge& edge)
      : S_j_i_(edge.S_j_i), root_weight_(std::sqrt(edge.weight)) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    Matrix7d wrt_i, wrt_j;
    const bool wants_i = jacobians != nullptr && jacobians[0] != nullptr;
    const bool wants_j = jacobians != nullptr && jacobians[1] != nullptr;
    Eigen::Map<Vector7d>(residuals, 7) =
        root_weight_ * EssentialGraphResidual(S_j_i_, ToSim3(parameters[0]), ToSim3(parameters[1]),
                                              wants_i ? &wrt_i : nullptr, wants_j ? &wrt_j : nullptr);
    if (wants_i) Write(wrt_i, jacobians[0]);
    if (wants_j) Write(wrt_j, jacobians[1]);
    return true;
  }

 private:
  void Write(const Matrix7d& jacobian, double* out) const {
    Eigen::Map<Eigen::Matrix<double, 7, 8, Eigen::RowMajor>> map(out);
    map.leftCols<7>() = root_weight_ * jacobian;
    map.col(7).setZero();
  }

  Sim3d S_j_i_;
  double root_weight_;
};

void CheckGraph(const EssentialGraphProblem& problem) {
  const int count = static_cast<int>(problem.S_cam_world.size());
  DMSLAM_CHECK(problem.fixed.empty() || problem.fixed.size() == problem.S_cam_world.size(),
               "one fixed flag per node");
  for (const EssentialGraphEdge& edge : problem.edges) {
    DMSLAM_CHECK(edge.i >= 0 && edge.i < count && edge.j >= 0 && edge.j < count, "edge names two nodes");
    DMSLAM_CHECK(edge.i != edge.j, "edge connects two different nodes");
  }
}

/// Where a long chain ends is determined the worse the longer it is.
constexpr double kGraphTrustRegion = 1e8;

class GraphSolver {
 public:
  GraphSolver(const EssentialGraphOptions& options, const EssentialGraphProblem& problem)
      : options_(options), problem_(problem), ceres_problem_(ProblemOptions()) {
    states_.resize(problem.S_cam_world.size());
    for (size_t i = 0; i < states_.size(); ++i) FromSim3(problem.S_cam_world[i], states_[i].data());
    for (const EssentialGraphEdge& edge : problem.edges) {
      costs_.emplace_back(edge);
      ceres_problem_.AddResidualBlock(&costs_.back(), nullptr, State(edge.i), State(edge.j));
    }
    HoldNodes();
  }

  EssentialGraphReport Run(std::vector<Sim3d>& S_cam_world) {
    EssentialGraphReport report;
    ceres::Solver::Options options = QuietSolverOptions(kGraphTrustRegion);
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = options_.max_iterations;
    options.function_tolerance = options_.relative_tolerance;
    InterruptCallback interrupt(options_.interrupt);
    if (options_.interrupt) options.callbacks.push_back(&interrupt);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_problem_, &summary);
    report.interrupted = interrupt.interrupted();
    report.initial_cost = summary.initial_cost;
    report.final_cost = summary.final_cost;
    report.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
    report.usable = summary.IsSolutionUsable();
    if (!report.usable) report.message = summary.message;
    if (report.usable) WriteBack(S_cam_world);
    return report;
  }

 private:
  static ceres::Problem::Options ProblemOptions() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    return options;
  }

  double* State(int node) { return states_[static_cast<size_t>(node)].data(); }

  bool Held(size_t node) const {
    bool any = false;
    for (const char fixed : problem_.fixed) any = any || fixed;
    return any ? problem_.fixed[node] != 0 : node == 0;
  }

  void HoldNodes() {
    for (size_t i = 0; i < states_.size(); ++i) {
      double* state = states_[i].data();
      if (!ceres_problem_.HasParameterBlock(state)) continue;
      ceres_problem_.SetManifold(state, options_.fix_scale ? static_cast<ceres::Manifold*>(&without_scale_)
                                                           : static_cast<ceres::Manifold*>(&with_scale_));
      if (Held(i)) ceres_problem_.SetParameterBlockConstant(state);
    }
  }

  void WriteBack(std::vector<Sim3d>& S_cam_world) const {
    for (size_t i = 0; i < states_.size(); ++i) {
      if (!Held(i)) S_cam_world[i] = ToSim3(states_[i].data());
    }
  }

  const EssentialGraphOptions& options_;
  const EssentialGraphProblem& problem_;
  LeftStepManifold<7> with_scale_;
  LeftStepManifold<6> without_scale_;
  std::vector<NodeState> states_;
  std::deque<EdgeCost> costs_;
  ceres::Problem ceres_problem_;
};

}  // namespace

EssentialGraphReport OptimizeEssentialGraph(const EssentialGraphOptions& options,
                                            EssentialGraphProblem& problem) {
  CheckGraph(problem);
  if (problem.edges.empty()) {
    EssentialGraphReport report;
    report.message = "the graph has no edges";
    return report;
  }
  return GraphSolver(options, problem).Run(problem.S_cam_world);
}

}  // namespace dmslam
