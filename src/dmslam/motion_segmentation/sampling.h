#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "dmslam/motion_segmentation/ransac.h"
#include "dmslam/motion_segmentation/two_view_model.h"
#include "dmslam/robust/ransac.h"

namespace dmslam {

struct BestSample {
  TwoViewModel model;
  double score = -1;
  int iterations = 0;
  bool found() const { return score >= 0; }
};

/// How many of `range` agree with a model.
struct InlierCount {
  const MatchArrays& arrays;
  Range range;
  double operator()(const Eigen::Matrix3d& M, double more_than) const {
    return CountInliers(M, arrays, range, static_cast<int>(more_than));
  }
};

/// Which share of `range` agrees with a model.
struct InlierShare {
  const MatchArrays& arrays;
  Range range;
  double operator()(const Eigen::Matrix3d& M) const {
    return CountInliers(M, arrays, range) / static_cast<double>(range.size());
  }
};

/// Draws samples from `range` and keeps the model of the highest `score(M, best)`, which may be any number up
/// to `best` where it does not exceed that. `inlier_share(M)` is asked for only when a better model is found
/// and the options stop early.
template <typename Score, typename Share>
BestSample DrawModels(const SamplingOptions& options, const MatchArrays& arrays, Range range, int iterations,
                      Random& random, Score score, Share inlier_share) {
  BestSample best;
  std::array<Eigen::Matrix3d, kMaxModels> models;
  int limit = iterations;
  for (best.iterations = 0; best.iterations < limit; ++best.iterations) {
    const int count = SolveSample(options.kind, arrays, range, random, models);
    for (int k = 0; k < count; ++k) {
      const Eigen::Matrix3d& M = models[static_cast<size_t>(k)];
      const double value = score(M, best.score);
      if (!(value > best.score)) continue;
      best.score = value;
      best.model.M = M;
      if (options.stop_confidence > 0) {
        limit = std::min(limit, RansacIterations(inlier_share(M), SampleSize(options.kind),
                                                 options.stop_confidence, iterations));
      }
    }
  }
  return best;
}

/// Refits to the inliers of the whole and selects again, as often as `rounds` says. `flags` are of `model`
/// afterwards; returns their number.
int RefitOnAll(ModelKind kind, const MatchArrays& arrays, int rounds, TwoViewModel* model,
               std::vector<uint8_t>* flags);

/// Fills what every selector reports: model, flags (`flags[k]` belongs to match `order[k]`), counts,
/// distribution; or the refusal for too few static ones.
void Finish(std::span<const Match> matches, std::span<const uint32_t> order, std::span<const uint8_t> flags,
            const TwoViewModel& model, ModelKind kind, const Camera& camera, int min_static,
            StaticSelection* selection);

/// An answer that is none.
StaticSelection Refuse(Refusal refusal, std::string explanation, size_t num_matches);

}  // namespace dmslam
