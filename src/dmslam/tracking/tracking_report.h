#pragma once

#include <cstdint>

#include "dmslam/camera/camera.h"
#include "dmslam/map/tracked_frame.h"

namespace dmslam {

/// What tracking one frame against the map came to.
struct TrackingReport {
  static constexpr int kEnoughOld = 60;
  static constexpr double kChanceShare = 0.1;  ///< of what is expected: so much may match by chance

  enum class Outcome : uint8_t {
    kNotSeen,       ///< no pose: too little of the map is seen
    kContradicted,  ///< no pose: what looks like the map lies elsewhere than it says
    kDoubtful,      ///< a pose, but what it rests on may be no part of the room
    kTracked,       ///< a pose
  };
  Outcome outcome = Outcome::kNotSeen;
  const char* reason = "";   ///< why there is no pose, or why it is doubtful
  bool by_rival = false;     ///< by a wider motion than that of the frames before
  int num_expected = 0;      ///< landmarks of the map around that it should see
  int num_old_expected = 0;  ///< of them, older than people stand: fewer than kEnoughOld say nothing...
  int num_old = 0;           ///< ...and matched
  int num_static = 0;        ///< inliers
  int num_elsewhere = 0;     ///< look like a landmark that should lie elsewhere, by the pose
  int num_moving = 0;
  int num_unknown = 0;      ///< matched, neither inlier nor moving
  int cells = 0;            ///< of an 8 x 6 grid that hold inliers
  double moving_share = 0;  ///< of the cells that hold matches, those with more moving than static ones
  double mean_chi2 = 0;

  bool HasPose() const { return outcome == Outcome::kTracked || outcome == Outcome::kDoubtful; }
  bool IsTracked() const { return outcome == Outcome::kTracked; }
  bool IsDoubtful() const { return outcome == Outcome::kDoubtful; }
  bool MayMatchByChance() const { return num_static < kChanceShare * num_expected; }
  /// The pose, if there was one, is not to be used. What was seen then tells which outcome it is.
  void TakePoseAway();
  void TakePoseAway(const char* why) {
    TakePoseAway();
    reason = why;
  }
};

/// Counts the frame's features by class, in all and by image cell. Decides nothing.
TrackingReport CountClasses(const Camera& camera, const TrackedFrame& frame);

}  // namespace dmslam
