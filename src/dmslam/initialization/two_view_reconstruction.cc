#include "dmslam/initialization/two_view_reconstruction.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>

#include "dmslam/geometry/two_view.h"
#include "dmslam/robust/ransac.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {
namespace {

/// Matches as the solvers take them.
struct MatchColumns {
  std::vector<Eigen::Vector2d> x0, x1;
  std::vector<double> sigma_squared;

  MatchColumns(std::span<const Match> matches, const Pyramid& pyramid) {
    for (const Match& match : matches) {
      x0.push_back(match.uv0_px);
      x1.push_back(match.uv1_px);
      sigma_squared.push_back(pyramid.SigmaSquared(std::max(match.octave0, match.octave1)));
    }
  }
};

TwoViewReconstruction RefuseReconstruction(ReconstructionRefusal refusal, std::string explanation, size_t n) {
  TwoViewReconstruction result;
  result.refusal = refusal;
  result.explanation = std::move(explanation);
  result.has_point.assign(n, 0);
  return result;
}

/// The pose under which most of the masked matches triangulate, with the gates.
TwoViewReconstruction Reconstruct(std::span<const Rigid3d> candidates, const MatchColumns& columns,
                                  std::span<const char> mask, const Camera& camera, double max_runner_up,
                                  const ReconstructionOptions& options) {
  PoseChoiceOptions choice_options;
  choice_options.max_reprojection_error_squared_px = options.max_reprojection_squared_px;
  const auto choice = ChoosePose(candidates, camera.Ideal(), columns.x0, columns.x1, mask,
                                 columns.sigma_squared, choice_options);
  const size_t n = columns.x0.size();
  if (!choice) return RefuseReconstruction(ReconstructionRefusal::kNoModel, "the model has no pose", n);
  TwoViewReconstruction result;
  result.T_1_0 = choice->T_cam2_cam1;
  const double length = result.T_1_0.translation.norm();
  if (length > 0) result.T_1_0.translation /= length;
  result.points_cam0 = choice->points_cam1;
  for (Eigen::Vector3d& point : result.points_cam0) point /= length > 0 ? length : 1.0;
  result.has_point.assign(choice->good.begin(), choice->good.end());
  result.num_points = choice->num_good;
  result.parallax_rad = choice->parallax_rad;
  result.median_parallax_rad = choice->median_parallax_rad;
  if (choice->num_good < options.min_points) {
    result.refusal = ReconstructionRefusal::kTooFewPoints;
    result.explanation = std::to_string(choice->num_good) + " points triangulate well";
  } else if (choice->num_good_second > max_runner_up * choice->num_good) {
    result.refusal = ReconstructionRefusal::kAmbiguous;
    result.explanation = "a second pose explains " + std::to_string(choice->num_good_second) + " of " +
                         std::to_string(choice->num_good) + " points";
  } else if (choice->parallax_rad < options.min_parallax_rad) {
    result.refusal = ReconstructionRefusal::kParallaxTooSmall;
    result.explanation = "parallax " + std::to_string(choice->parallax_rad * 180.0 / M_PI) + " degrees";
  }
  return result;
}

/// A model of the baseline and its score: sum over matches and both directions of (bound - error) where below
/// the bound.
struct Scored {
  Eigen::Matrix3d model = Eigen::Matrix3d::Zero();
  double score = -1;
};

constexpr double kScoreBound = kChiSquared2Dof;  // the same for both models, so that their scores compare

double ScoreHomography(const Eigen::Matrix3d& H, const MatchColumns& columns,
                       const HomographyOrFundamentalOptions& options, std::vector<char>* inliers) {
  const Eigen::Matrix3d H_inverse = H.inverse();
  if (!H_inverse.allFinite()) return -1;
  const double inv = 1.0 / (options.sigma_px * options.sigma_px);
  double score = 0;
  for (size_t i = 0; i < columns.x0.size(); ++i) {
    const double forward = TransferErrorSquared(H, columns.x0[i], columns.x1[i]) * inv;
    const double backward = TransferErrorSquared(H_inverse, columns.x1[i], columns.x0[i]) * inv;
    const bool in_forward = forward <= options.chi2_homography,
               in_backward = backward <= options.chi2_homography;
    score += (in_forward ? kScoreBound - forward : 0.0) + (in_backward ? kScoreBound - backward : 0.0);
    if (inliers) (*inliers)[i] = in_forward && in_backward ? 1 : 0;
  }
  return score;
}

double ScoreFundamental(const Eigen::Matrix3d& F, const MatchColumns& columns,
                        const HomographyOrFundamentalOptions& options, std::vector<char>* inliers) {
  const Eigen::Matrix3d F_transposed = F.transpose();
  const double inv = 1.0 / (options.sigma_px * options.sigma_px);
  double score = 0;
  for (size_t i = 0; i < columns.x0.size(); ++i) {
    const double forward = EpipolarDistanceSquared(F, columns.x0[i], columns.x1[i]) * inv;
    const double backward = EpipolarDistanceSquared(F_transposed, columns.x1[i], columns.x0[i]) * inv;
    const bool in_forward = forward <= options.chi2_fundamental,
               in_backward = backward <= options.chi2_fundamental;
    score += (in_forward ? kScoreBound - forward : 0.0) + (in_backward ? kScoreBound - backward : 0.0);
    if (inliers) (*inliers)[i] = in_forward && in_backward ? 1 : 0;
  }
  return score;
}

}  // namespace

std::string_view ToString(ReconstructionRefusal refusal) {
  switch (refusal) {
    case ReconstructionRefusal::kNone:
      return "none";
    case ReconstructionRefusal::kNoModel:
      return "no model";
    case ReconstructionRefusal::kAmbiguous:
      return "ambiguous";
    case ReconstructionRefusal::kTooFewPoints:
      return "too few points";
    case ReconstructionRefusal::kParallaxTooSmall:
      return "parallax too small";
  }
  return "unknown";
}

TwoViewReconstruction ReconstructFromStatic(std::span<const Match> matches, const StaticSelection& selection,
                                            const Camera& camera, const ReconstructionOptions& options) {
  if (!selection.IsUsable()) {
    return RefuseReconstruction(ReconstructionRefusal::kNoModel, selection.explanation, matches.size());
  }
  const Eigen::Matrix3d E = selection.kind == ModelKind::kEssential
                                ? selection.E
                                : EssentialFromFundamental(selection.F, camera.Ideal(), camera.Ideal());
  const std::array<Rigid3d, 4> candidates = DecomposeEssential(E);
  const std::vector<char> mask(selection.is_static.begin(), selection.is_static.end());
  return Reconstruct(candidates, MatchColumns(matches, options.pyramid), mask, camera, options.max_runner_up,
                     options);
}

TwoViewReconstruction ReconstructBaseline(std::span<const Match> matches, const Camera& camera,
                                          const HomographyOrFundamentalOptions& options, uint64_t seed) {
  const size_t n = matches.size();
  if (n < 8) return RefuseReconstruction(ReconstructionRefusal::kNoModel, "fewer than 8 matches", n);
  const MatchColumns columns(matches, options.reconstruction.pyramid);
  Random random(DeriveSeed(seed, 0, "baseline-initialiser"));
  Scored best_H, best_F;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    std::array<int, 8> sample;
    DrawSample<8>(random, static_cast<int>(n), sample);
    if (const auto H = HomographyLinear(columns.x0, columns.x1, sample)) {
      const double score = ScoreHomography(*H, columns, options, nullptr);
      if (score > best_H.score) best_H = {*H, score};
    }
    if (const auto F = FundamentalEightPointMinimal(columns.x0, columns.x1, sample)) {
      const double score = ScoreFundamental(*F, columns, options, nullptr);
      if (score > best_F.score) best_F = {*F, score};
    }
  }
  if (best_H.score <= 0 && best_F.score <= 0) {
    return RefuseReconstruction(ReconstructionRefusal::kNoModel, "no sample gave a model", n);
  }
  std::vector<char> inliers(n, 0);
  const double h = std::max(0.0, best_H.score), f = std::max(0.0, best_F.score);
  if (h / (h + f) > options.homography_share) {
    ScoreHomography(best_H.model, columns, options, &inliers);
    std::vector<Rigid3d> candidates;
    for (const PlaneMotion& motion : DecomposeHomography(best_H.model, camera.Ideal(), camera.Ideal())) {
      candidates.push_back(motion.T_cam2_cam1);
    }
    TwoViewReconstruction result = Reconstruct(candidates, columns, inliers, camera,
                                               options.max_runner_up_homography, options.reconstruction);
    result.from_homography = true;
    return result;
  }
  ScoreFundamental(best_F.model, columns, options, &inliers);
  const auto candidates =
      DecomposeEssential(EssentialFromFundamental(best_F.model, camera.Ideal(), camera.Ideal()));
  return Reconstruct(candidates, columns, inliers, camera, options.reconstruction.max_runner_up,
                     options.reconstruction);
}

}  // namespace dmslam
