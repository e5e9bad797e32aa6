#include "dmslam/motion_segmentation/ransac.h"

#include <Eigen/LU>
#include <algorithm>
#include <numeric>

#include "dmslam/motion_segmentation/sampling.h"

namespace dmslam {
namespace {

std::vector<uint32_t> Identity(size_t n) {
  std::vector<uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  return order;
}

/// ARSAC's cells: which one every match lies in, and how many lie there.
struct EvennessGrid {
  std::vector<uint16_t> cell_of;
  std::vector<double> total;
  std::vector<Eigen::Vector2d> center;

  EvennessGrid(std::span<const Match> matches, const Camera& camera, int columns, int rows)
      : total(static_cast<size_t>(columns * rows), 0.0), center(total.size()) {
    const double width = static_cast<double>(camera.width_px) / columns;
    const double height = static_cast<double>(camera.height_px) / rows;
    for (int cell = 0; cell < columns * rows; ++cell) {
      const int column = cell % columns, row = cell / columns;
      center[static_cast<size_t>(cell)] = {(column + 0.5) * width, (row + 0.5) * height};
    }
    for (const Match& match : matches) {
      const int column = std::clamp(static_cast<int>(match.uv0_px.x() / width), 0, columns - 1);
      const int row = std::clamp(static_cast<int>(match.uv0_px.y() / height), 0, rows - 1);
      cell_of.push_back(static_cast<uint16_t>(row * columns + column));
      total[cell_of.back()] += 1.0;
    }
  }

  /// pi sqrt(det C) sum_i e_i.
  double Score(std::span<const uint8_t> flags, std::vector<double>* scratch) const {
    scratch->assign(total.size(), 0.0);
    for (size_t i = 0; i < flags.size(); ++i) (*scratch)[cell_of[i]] += flags[i];
    double sum = 0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (size_t c = 0; c < total.size(); ++c) {
      if (total[c] == 0) continue;
      (*scratch)[c] /= total[c];
      sum += (*scratch)[c];
      mean += (*scratch)[c] * center[c];
    }
    if (sum == 0) return 0;
    mean /= sum;
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    for (size_t c = 0; c < total.size(); ++c) {
      const Eigen::Vector2d offset = center[c] - mean;
      covariance += ((*scratch)[c] / sum) * offset * offset.transpose();
    }
    return M_PI * std::sqrt(std::max(0.0, covariance.determinant())) * sum;
  }
};

}  // namespace

StaticSelection Refuse(Refusal refusal, std::string explanation, size_t num_matches) {
  StaticSelection selection;
  selection.refusal = refusal;
  selection.explanation = std::move(explanation);
  selection.is_static.assign(num_matches, 0);
  return selection;
}

int RefitOnAll(ModelKind kind, const MatchArrays& arrays, int rounds, TwoViewModel* model,
               std::vector<uint8_t>* flags) {
  const Range all{0, arrays.size()};
  flags->resize(arrays.size());
  int count = FlagInliers(model->M, arrays, all, *flags);
  for (int round = 0; round < rounds; ++round) {
    TwoViewModel refitted = *model;
    std::vector<uint8_t> refitted_flags(arrays.size());
    if (round == 0 && kind == ModelKind::kEssential) ChooseEssentialPose(arrays, *flags, &refitted);
    if (!Refine(kind, arrays, *flags, 5, &refitted)) break;
    const int refitted_count = FlagInliers(refitted.M, arrays, all, refitted_flags);
    if (refitted_count < count) break;
    const bool settled = refitted_flags == *flags;
    *model = refitted;
    *flags = std::move(refitted_flags);
    count = refitted_count;
    if (settled) break;
  }
  return count;
}

void Finish(std::span<const Match> matches, std::span<const uint32_t> order, std::span<const uint8_t> flags,
            const TwoViewModel& model, ModelKind kind, const Camera& camera, int min_static,
            StaticSelection* selection) {
  selection->is_static.assign(matches.size(), 0);
  selection->kind = kind;
  std::vector<Eigen::Vector2d> points;
  for (size_t k = 0; k < flags.size(); ++k) {
    if (!flags[k]) continue;
    selection->is_static[order[k]] = 1;
    points.push_back(matches[order[k]].uv0_px);
  }
  selection->num_static = static_cast<int>(points.size());
  selection->distribution_px = Spread(points);
  if (selection->num_static < min_static) {
    selection->refusal = Refusal::kTooFewStatic;
    selection->explanation = "only " + std::to_string(selection->num_static) + " of " +
                             std::to_string(matches.size()) + " matches agree with the model";
    selection->is_static.assign(matches.size(), 0);
    selection->num_static = 0;
    return;
  }
  StoreModel(model, kind, camera, selection);
}

StaticSelection RansacSelector::Select(std::span<const Match> matches, const Camera& camera,
                                       uint64_t seed) const {
  if (const auto problem = CheckMatches(matches, camera, options_.input)) {
    return Refuse(problem->refusal, problem->explanation, matches.size());
  }
  const std::vector<uint32_t> order = Identity(matches.size());
  const MatchArrays arrays = MakeArrays(matches, order, camera, options_.inlier);
  const Range all{0, arrays.size()};
  Random random(DeriveSeed(seed, 0, "ransac"));
  BestSample best = DrawModels(options_.sampling, arrays, all, options_.sampling.max_iterations, random,
                               InlierCount{arrays, all}, InlierShare{arrays, all});
  if (!best.found()) return Refuse(Refusal::kNoModel, "no sample gave a model", matches.size());
  StaticSelection selection;
  selection.iterations = best.iterations;
  std::vector<uint8_t> flags;
  RefitOnAll(options_.sampling.kind, arrays, options_.sampling.refit_rounds, &best.model, &flags);
  Finish(matches, order, flags, best.model, options_.sampling.kind, camera, options_.min_static, &selection);
  return selection;
}

StaticSelection Arsac::Select(std::span<const Match> matches, const Camera& camera, uint64_t seed) const {
  if (const auto problem = CheckMatches(matches, camera, options_.input)) {
    return Refuse(problem->refusal, problem->explanation, matches.size());
  }
  const std::vector<uint32_t> order = Identity(matches.size());
  const MatchArrays arrays = MakeArrays(matches, order, camera, options_.inlier);
  const Range all{0, arrays.size()};
  const EvennessGrid grid(matches, camera, options_.columns, options_.rows);
  Random random(DeriveSeed(seed, 0, "arsac"));
  std::vector<uint8_t> flags(arrays.size());
  std::vector<double> scratch;
  const auto score = [&](const Eigen::Matrix3d& M, double) {
    FlagInliers(M, arrays, all, flags);
    return grid.Score(flags, &scratch);
  };
  BestSample best = DrawModels(options_.sampling, arrays, all, options_.sampling.max_iterations, random,
                               score, InlierShare{arrays, all});
  if (!best.found()) return Refuse(Refusal::kNoModel, "no sample gave a model", matches.size());
  StaticSelection selection;
  selection.iterations = best.iterations;
  RefitOnAll(options_.sampling.kind, arrays, options_.sampling.refit_rounds, &best.model, &flags);
  Finish(matches, order, flags, best.model, options_.sampling.kind, camera, options_.min_static, &selection);
  return selection;
}

}  // namespace dmslam
