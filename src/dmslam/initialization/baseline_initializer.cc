#include "dmslam/initialization/baseline_initializer.h"

#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/util/random.h"

namespace dmslam {

InitializerReport BaselineInitializer::BeginWith(const InitializerFrame& frame, WaitReason wait,
                                                 const char* reason) {
  reference_.reset();
  if (static_cast<int>(frame.features->size()) >= options_.min_features) reference_ = frame;
  InitializerReport report;
  report.wait = wait;
  report.reason = reason;
  return report;
}

InitializerReport BaselineInitializer::AddFrame(const InitializerFrame& frame) {
  if (!reference_) return BeginWith(frame, WaitReason::kTooFewFrames, "this is the reference frame");
  if (static_cast<int>(frame.features->size()) < options_.min_features) {
    return BeginWith(frame, WaitReason::kTooFewFeatures, "too few features");
  }
  const std::vector<Match> matches =
      MatchFrames(*reference_->features, *frame.features, camera_, options_.matching, &matcher_);
  if (static_cast<int>(matches.size()) < options_.min_matches) {
    return BeginWith(frame, WaitReason::kTooFewMatches, "too few matches with the reference frame");
  }
  InitializerReport report;
  report.num_matches = static_cast<int>(matches.size());
  const TwoViewReconstruction reconstruction =
      ReconstructBaseline(matches, camera_, options_.model, DeriveSeed(seed_, frame.index, "baseline"));
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
