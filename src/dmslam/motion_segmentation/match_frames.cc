#include "dmslam/motion_segmentation/match_frames.h"

#include <algorithm>
#include <limits>

#include "dmslam/camera/image_scale.h"

namespace dmslam {

std::vector<Match> MatchFrames(const FrameFeatures& frame0, const FrameFeatures& frame1, const Camera& camera,
                               const MatchingOptions& options, FeatureMatcher* matcher,
                               std::span<const Eigen::Vector2d> predicted_px) {
  const MatchSide side0{frame0.set.keypoints, frame0.set.descriptors, frame0.uv_px, {}};
  const MatchSide side1{frame1.set.keypoints, frame1.set.descriptors, frame1.uv_px, {}};
  MatchOptions match;
  match.max_distance = options.max_distance;
  match.max_ratio = options.max_ratio;
  match.check_orientation = options.check_orientation;
  std::vector<FeatureMatch> found;
  if (options.use_window) {
    WindowMatchOptions window;
    window.match = match;
    window.window_px = options.window_rad * FocalPx(camera);
    window.octave_slack = options.octave_slack;
    matcher->MatchWindow(side0, side1, frame1.grid, window, &found, predicted_px);
  } else {
    matcher->MatchAll(side0, side1, match, &found);
  }
  std::vector<Match> matches;
  matches.reserve(found.size());
  for (const FeatureMatch& pair : found) {
    Match match_px;
    match_px.index0 = pair.index0;
    match_px.index1 = pair.index1;
    match_px.uv0_px = frame0.uv_px[pair.index0];
    match_px.uv1_px = frame1.uv_px[pair.index1];
    match_px.octave0 = frame0.set.keypoints[pair.index0].octave;
    match_px.octave1 = frame1.set.keypoints[pair.index1].octave;
    matches.push_back(match_px);
  }
  return matches;
}

void AddMatchesInPlace(const FrameFeatures& frame0, const FrameFeatures& frame1, const Camera& camera,
                       const MatchingOptions& options, FeatureMatcher* matcher, std::vector<Match>* matches) {
  const Eigen::Vector2d nowhere = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  std::vector<Eigen::Vector2d> places(frame0.uv_px.begin(), frame0.uv_px.end());
  std::vector<uint8_t> is_taken(frame1.size(), 0);
  for (const Match& match : *matches) {
    places[match.index0] = nowhere;
    is_taken[match.index1] = 1;
  }
  for (const Match& match : MatchFrames(frame0, frame1, camera, options, matcher, places)) {
    if (!is_taken[match.index1]) matches->push_back(match);
  }
  std::ranges::sort(*matches, {}, &Match::index0);
}

std::vector<Match> ChooseEvenly(const std::vector<Match>& matches, size_t most) {
  if (matches.size() <= most) return matches;
  std::vector<Match> chosen;
  chosen.reserve(most);
  for (size_t k = 0; k < most; ++k) chosen.push_back(matches[k * matches.size() / most]);
  return chosen;
}

}  // namespace dmslam
