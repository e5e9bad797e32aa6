#pragma once

#include "dmslam/camera/camera.h"
#include "dmslam/map/tracked_frame.h"

namespace dmslam {

/// What tracking one frame against the map came to.
struct TrackingReport {
  static constexpr int kEnoughOld = 60;

  bool ok = false;
  bool doubtful = false;     ///< it is, but what it sees may be no part of the room
  const char* reason = "";   ///< why not, or why it is doubtful
  bool by_rival = false;     ///< by a wider motion than that of the frames before
  bool contradicts = false;  ///< what looks like the map lies elsewhere than it says; else it is not seen
  int num_expected = 0;      ///< landmarks of the map around that it should see
  int num_old_expected = 0;  ///< of them, older than people stand: fewer than kEnoughOld say nothing...
  int num_old = 0;           ///< ...and matched
  int num_static = 0;        ///< inliers
  int num_moving = 0;
  int num_unknown = 0;      ///< matched, neither inlier nor moving
  int cells = 0;            ///< of an 8 x 6 grid that hold inliers
  double moving_share = 0;  ///< of the cells that hold matches, those with more moving than static ones
  double mean_chi2 = 0;
};

/// Counts the frame's features by class, in all and by image cell. Decides nothing.
TrackingReport CountClasses(const Camera& camera, const TrackedFrame& frame);

}  // namespace dmslam
