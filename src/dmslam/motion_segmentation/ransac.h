#pragma once

#include "dmslam/motion_segmentation/static_selector.h"

namespace dmslam {

/// Sampling that all selectors share.
struct SamplingOptions {
  ModelKind kind = ModelKind::kEssential;
  int max_iterations = 2000;  ///< samples in all
  /// Stop early once a better sample is this improbable to be missing (paper Eq. 4, Fischler and Bolles
  /// 1981): N = log(1 - p) / log(1 - w^s), w the best inlier share, s the sample's size. 0: never stop early.
  double stop_confidence = 0.0;
  int refit_rounds =
      3;  ///< refit to the inliers and select again, at the end; 0: the best sample's model stands
};

/// Plain RANSAC: the model with most inliers (Fischler and Bolles 1981).
struct RansacSelectorOptions {
  SamplingOptions sampling;
  InputOptions input;
  InlierOptions inlier;
  int min_static = 12;  ///< fewer matches that agree: refused
};

class RansacSelector : public StaticSelector {
 public:
  explicit RansacSelector(const RansacSelectorOptions& options) : options_(options) {}
  std::string_view name() const override { return "ransac"; }
  StaticSelection Select(std::span<const Match> matches, const Camera& camera, uint64_t seed) const override;

 private:
  RansacSelectorOptions options_;
};

/// ARSAC: RANSAC that scores a model by how evenly its inliers are spread over image cells (the adaptive
/// sampling of Tan, Liu, Dong, Zhang, Bao, "Robust monocular SLAM in dynamic environments", ISMAR 2013, Sec.
/// 5, without its prior): with e_i the inlier share of cell i and C the covariance of the cells' centres
/// weighted by e_i, the score is pi sqrt(det C) sum_i e_i.
struct ArsacOptions {
  SamplingOptions sampling;
  InputOptions input;
  InlierOptions inlier;
  int columns = 10;     ///< cells across
  int rows = 10;        ///< cells down
  int min_static = 12;  ///< fewer matches that agree: refused
};

class Arsac : public StaticSelector {
 public:
  explicit Arsac(const ArsacOptions& options) : options_(options) {}
  std::string_view name() const override { return "arsac"; }
  StaticSelection Select(std::span<const Match> matches, const Camera& camera, uint64_t seed) const override;

 private:
  ArsacOptions options_;
};

}  // namespace dmslam
