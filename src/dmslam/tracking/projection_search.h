#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/dynamics/frame_expectation.h"
#include "dmslam/dynamics/landmark_votes.h"
#include "dmslam/map/map.h"
#include "dmslam/place_recognition/landmark_matches.h"
#include "dmslam/tracking/tracking_options.h"

namespace dmslam {

/// Matches a frame's features with landmarks that have a vote: those of another frame, of a keyframe, or of
/// the map around. What it returns stays valid until the next call. Does not ask the heap for memory once its
/// buffers have grown.
class ProjectionSearch {
 public:
  explicit ProjectionSearch(const TrackingOptions& options) : options_(options) {}

  /// The landmarks that `last` saw, within `radius_px` (times the octave's scale) of their projections at
  /// `T_cam_world`. Only matches whose keypoints turned as most others did.
  const std::vector<LandmarkMatch>& MatchFrame(const Map& map, const LandmarkVotes& votes,
                                               const TrackedFrame& last, const Rigid3d& T_cam_world,
                                               double radius_px, const FrameFeatures& features);
  /// A keyframe's landmarks by descriptor alone, wherever they are.
  const std::vector<LandmarkMatch>& MatchKeyframe(const Map& map, const LandmarkVotes& votes,
                                                  const Keyframe& keyframe, const FrameFeatures& features);
  /// Adds to the frame's matches those of `landmarks` that lie near their projections at its pose; `wider`:
  /// times the radius. Returns all of them that the frame should see, matched or not.
  std::span<const ExpectedLandmark> MatchLandmarks(const Map& map, const LandmarkVotes& votes,
                                                   std::span<const LandmarkId> landmarks, double wider,
                                                   TrackedFrame* frame);

 private:
  void KeepConsistentTurns();

  TrackingOptions options_;
  std::vector<ExpectedLandmark> expected_;
  std::vector<LandmarkMatch> matches_;
  // Workspace:
  std::vector<float> turns_;    ///< of the keypoints of matches_ [1/256 of a turn]
  std::vector<uint8_t> taken_;  ///< features that are matched
  LandmarkSet matched_;         ///< landmarks that are
};

}  // namespace dmslam
