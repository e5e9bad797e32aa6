#include "dmslam/initialization/two_frame_initializer.h"

#include <algorithm>
#include <cmath>

#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr double kPaperMeanParallaxRad = 0.0175;  // one degree

double MeanParallax(const TwoViewReconstruction& reconstruction) {
  const Eigen::Vector3d centre1 = reconstruction.T_1_0.Inverse().translation;
  double sum = 0;
  for (size_t i = 0; i < reconstruction.points_cam0.size(); ++i) {
    if (!reconstruction.has_point[i]) continue;
    const Eigen::Vector3d& point = reconstruction.points_cam0[i];
    sum += std::acos(std::clamp(point.normalized().dot((point - centre1).normalized()), -1.0, 1.0));
  }
  return reconstruction.num_points > 0 ? sum / reconstruction.num_points : 0;
}

InitializerReport Waiting(WaitReason wait, const char* reason) {
  InitializerReport report;
  report.wait = wait;
  report.reason = reason;
  return report;
}

}  // namespace

ReconstructPair ReconstructByRansac(const Camera& camera, const Pyramid& pyramid) {
  HomographyOrFundamentalOptions options;
  options.reconstruction.pyramid = pyramid.OfImages(camera.width_px, camera.height_px);
  options.sigma_px = options.reconstruction.pyramid.Sigma(0);
  return [camera, options](std::span<const Match> matches, uint64_t seed) {
    return ReconstructBaseline(matches, camera, options, seed);
  };
}

ReconstructPair ReconstructByPaper(const Camera& camera, const Pyramid& pyramid) {
  DlrsacOptions options = DlrsacOptions::Paper();
  options.min_distribution_share = kMinDistributionShare;
  ReconstructionOptions gates;
  gates.min_parallax_rad = 0;  // the paper's is on the mean
  gates.pyramid = pyramid.OfImages(camera.width_px, camera.height_px);
  return [camera, gates, selector = Dlrsac(options)](std::span<const Match> matches, uint64_t seed) {
    TwoViewReconstruction reconstruction =
        ReconstructFromStatic(matches, selector.Select(matches, camera, seed), camera, gates);
    if (reconstruction.IsUsable() && MeanParallax(reconstruction) < kPaperMeanParallaxRad) {
      reconstruction.refusal = ReconstructionRefusal::kParallaxTooSmall;
      reconstruction.explanation = "the mean parallax is too small";
    }
    return reconstruction;
  };
}

InitializerReport TwoFrameInitializer::BeginWith(const InitializerFrame& frame, WaitReason wait,
                                                 const char* reason) {
  reference_.reset();
  if (static_cast<int>(frame.features->size()) >= options_.min_features) reference_ = frame;
  return Waiting(wait, reason);
}

InitializerReport TwoFrameInitializer::AddFrame(const InitializerFrame& frame) {
  if (static_cast<int>(frame.features->size()) < options_.min_features)
    return BeginWith(frame, WaitReason::kTooFewFeatures, "too few features");
  if (!reference_) return BeginWith(frame, WaitReason::kTooFewFrames, "this is the reference frame");
  const std::vector<Match> matches =
      MatchFrames(*reference_->features, *frame.features, camera_, options_.matching, &matcher_);
  if (static_cast<int>(matches.size()) < options_.min_matches) {
    return BeginWith(frame, WaitReason::kTooFewMatches, "too few matches with the reference frame");
  }
  if (static_cast<double>(frame.stamp_ns - reference_->stamp_ns) * 1e-9 < options_.min_gap_s) {
    return Waiting(WaitReason::kTooFewFrames, "too near to the reference frame");
  }
  InitializerReport report;
  report.num_matches = static_cast<int>(matches.size());
  const TwoViewReconstruction reconstruction =
      reconstruct_(matches, DeriveSeed(seed_, frame.index, "baseline"));
  if (!reconstruction.IsUsable()) {
    report.wait = WaitReason::kNoReconstruction;
    report.reason = reconstruction.explanation;
    return report;
  }
  FirstMap map;
  map.frame0 = *reference_;
  map.frame1 = frame;
  map.T_1_0 = reconstruction.T_1_0;
  map.matches = matches;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (reconstruction.has_point[i]) {
      map.points.push_back({matches[i].index0, matches[i].index1, reconstruction.points_cam0[i]});
    }
  }
  map.median_parallax_rad = reconstruction.median_parallax_rad;
  map.num_views = 2;
  report.wait = WaitReason::kNone;
  report.reason = "a first map of two frames";
  report.result = std::move(map);
  reference_.reset();
  return report;
}

}  // namespace dmslam
