#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "dmslam/util/random.h"

namespace dmslam {

struct RansacOptions {
  int max_iterations = 1000;
  int min_iterations = 0;
  double confidence = 0.99;  ///< Probability that one sample was all inliers when the loop stops early.
  int min_inliers = 0;       ///< Fewer: no success.
  uint64_t seed = 0;
};

template <typename Model>
struct RansacReport {
  bool success = false;
  Model model{};
  int iterations = 0;
  int num_inliers = 0;
  double cost = std::numeric_limits<double>::infinity();  ///< Sum of min(r^2 / threshold, 1).
  std::vector<char> inliers;                              ///< Parallel to the data.
};

/// A problem for Ransac(): data held by the problem, models fitted to samples of indices.
template <typename P>
concept RansacProblem = requires(const P& p, std::span<const int, P::kSampleSize> sample,
                                 std::array<typename P::Model, P::kMaxModels>& models,
                                 const typename P::Model& model) {
  { p.size() } -> std::convertible_to<int>;               // How many data.
  { p.Fit(sample, models) } -> std::convertible_to<int>;  // How many models the sample gave.
  {
    p.NormalizedErrorSquared(model, 0)
    } -> std::convertible_to<double>;  // r^2 / threshold: an inlier below 1.
};

/// Problems that can fit a model to any number of inliers, starting from the model: bool Refit(span<const
/// int>, Model&).
template <typename P>
concept RefittingProblem = RansacProblem<P> &&
    requires(const P& p, std::span<const int> indices, typename P::Model& model) {
  { p.Refit(indices, model) } -> std::convertible_to<bool>;
};

/// Samples needed to draw one free of outliers with this confidence (the paper's Eq. 4: log(1 - p) / log(1 -
/// w^m)), at most `limit`.
inline int RansacIterations(double inlier_share, int sample_size, double confidence, int limit) {
  const double all_good = std::pow(inlier_share, sample_size);
  if (all_good >= 1.0) return 1;
  const double denominator = std::log1p(-all_good);
  if (!(denominator < 0.0)) return limit;
  const double needed = std::ceil(std::log(1.0 - confidence) / denominator);
  return needed >= limit ? limit : std::max(1, static_cast<int>(needed));
}

/// `kSize` different numbers below `count` (at least kSize).
template <int kSize>
void DrawSample(Random& random, int count, std::array<int, kSize>& sample) {
  for (int k = 0; k < kSize; ++k) {
    bool fresh;
    do {
      sample[static_cast<size_t>(k)] = static_cast<int>(random.Below(static_cast<uint32_t>(count)));
      fresh =
          std::find(sample.begin(), sample.begin() + k, sample[static_cast<size_t>(k)]) == sample.begin() + k;
    } while (!fresh);
  }
}

/// Truncated cost of a model; gives up as soon as it exceeds `bound`. Counts the inliers.
template <RansacProblem P>
double ScoreModel(const P& problem, const typename P::Model& model, double bound, int& num_inliers) {
  const int count = problem.size();
  double cost = 0.0;
  int good = 0;
  for (int i = 0; i < count; ++i) {
    const double error = problem.NormalizedErrorSquared(model, i);
    if (error < 1.0) {
      cost += error;
      ++good;
    } else {
      cost += 1.0;
    }
    if (cost >= bound) break;
  }
  num_inliers = good;
  return cost;
}

template <RansacProblem P>
void CollectInliers(const P& problem, const typename P::Model& model, std::vector<int>& indices) {
  indices.clear();
  for (int i = 0; i < problem.size(); ++i) {
    if (problem.NormalizedErrorSquared(model, i) < 1.0) indices.push_back(i);
  }
}

/// Replaces the model by one fitted to its inliers as long as the cost falls (at most three times).
template <RefittingProblem P>
void RefitBest(const P& problem, std::vector<int>& indices, RansacReport<typename P::Model>& report) {
  for (int round = 0; round < 3; ++round) {
    CollectInliers(problem, report.model, indices);
    typename P::Model model = report.model;
    if (static_cast<int>(indices.size()) < P::kSampleSize || !problem.Refit(indices, model)) return;
    int num_inliers = 0;
    const double cost = ScoreModel(problem, model, report.cost, num_inliers);
    if (!(cost < report.cost)) return;
    report.model = model;
    report.cost = cost;
    report.num_inliers = num_inliers;
  }
}

/// RANSAC (Fischler and Bolles 1981) with the truncated quadratic score of MSAC (Torr and Zisserman 2000),
/// local refitting of every new best model, and adaptive stopping. Deterministic in (problem, options).
template <RansacProblem P>
RansacReport<typename P::Model> Ransac(const P& problem, const RansacOptions& options) {
  RansacReport<typename P::Model> report;
  const int count = problem.size();
  if (count < P::kSampleSize) return report;
  Random random(options.seed);
  std::array<int, P::kSampleSize> sample{};
  std::array<typename P::Model, P::kMaxModels> models;
  std::vector<int> indices;
  indices.reserve(static_cast<size_t>(count));
  int limit = options.max_iterations;
  for (; report.iterations < limit; ++report.iterations) {
    DrawSample<P::kSampleSize>(random, count, sample);
    const int num_models = problem.Fit(std::span<const int, P::kSampleSize>(sample), models);
    bool better = false;
    for (int m = 0; m < num_models; ++m) {
      int num_inliers = 0;
      const double cost = ScoreModel(problem, models[static_cast<size_t>(m)], report.cost, num_inliers);
      if (!(cost < report.cost) || num_inliers < P::kSampleSize) continue;
      report.cost = cost;
      report.num_inliers = num_inliers;
      report.model = models[static_cast<size_t>(m)];
      better = true;
    }
    if (!better) continue;
    if constexpr (RefittingProblem<P>) RefitBest(problem, indices, report);
    const double share = static_cast<double>(report.num_inliers) / count;
    limit = std::max(options.min_iterations,
                     RansacIterations(share, P::kSampleSize, options.confidence, options.max_iterations));
  }
  report.inliers.assign(static_cast<size_t>(count), 0);
  if (!std::isfinite(report.cost)) return report;
  CollectInliers(problem, report.model, indices);
  for (const int i : indices) report.inliers[static_cast<size_t>(i)] = 1;
  report.num_inliers = static_cast<int>(indices.size());
  report.success = report.num_inliers >= std::max(options.min_inliers, P::kSampleSize);
  return report;
}

}  // namespace dmslam
