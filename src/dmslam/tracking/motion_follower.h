#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "dmslam/tracking/motion_model.h"
#include "dmslam/tracking/pose_search.h"
#include "dmslam/tracking/tracking_options.h"

namespace dmslam {

/// Follows a camera from frame to frame: from where its motion leads to what the map around it says. Frames
/// may come in the order of time or against it; the caller's times must always go on.
class MotionFollower {
 public:
  explicit MotionFollower(const TrackingOptions& options) : options_(options), motion_(options.motion) {}

  /// Stands at a keyframe; nothing is known of the motion.
  void BeginAt(const Keyframe& keyframe, const FrameTime& time);
  /// Is nowhere.
  void BeginLost() { motion_.BeginLost(); }
  /// The motion is not known any more.
  void Stop() { motion_.Stop(); }

  struct Attempt {
    TrackingReport report;
    std::optional<FoundPose> weak_pose;  ///< that too few landmarks support, but enough to lead the search on
    bool begins_anew = false;  ///< the pose is no step on from the frame before, whose motion was wrong
  };
  /// Looks for the camera where its motion leads. `careful`: more is asked, as of a camera that was found
  /// anew. `seed`: of the search by the reference keyframe's features.
  Attempt Follow(const Map& map, const FrameTime& time, bool careful, uint64_t seed, PoseSearch* search,
                 TrackedFrame* frame);
  /// The frame was placed. `jumped`: not from the frame before, so the step is no motion.
  void OnTracked(const Map& map, const PlacedPose& pose, const FoundPose& found, const FrameTime& time,
                 const TrackedFrame& frame, bool jumped);
  /// The frame was not placed, but has a weak pose that leads on.
  void Coast(const Map& map, const FoundPose& found, const FrameTime& time) {
    motion_.Coast(map, found, time);
  }
  /// The frame placed last lies elsewhere now, or knows more.
  void SetLast(TrackedFrame frame) { last_ = std::move(frame); }

  const MotionModel& motion() const { return motion_; }
  /// The frame placed last.
  const TrackedFrame& last() const { return last_; }

 private:
  bool FindFirstPose(const Map& map, const MotionModel::Prediction& prediction, uint64_t seed,
                     PoseSearch* search, TrackedFrame* frame, Attempt* attempt) const;

  TrackingOptions options_;
  MotionModel motion_;
  TrackedFrame last_;
};

}  // namespace dmslam
