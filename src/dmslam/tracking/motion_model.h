#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/map/map.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/tracking/motion_filter.h"

namespace dmslam {

/// A pose told relative to a keyframe, so that it goes with the map's corrections.
struct PlacedPose {
  KeyframeId reference;
  Rigid3d T_cam_reference;
  double scale = 1.0;  ///< of the reference when the pose was told

  static PlacedPose Of(const Keyframe& reference, const Rigid3d& T_cam_world);
  /// None where there is no such keyframe.
  static std::optional<PlacedPose> Of(const Keyframe* reference, const Rigid3d& T_cam_world) {
    return reference == nullptr ? std::nullopt : std::optional(Of(*reference, T_cam_world));
  }
  /// T_cam_world in the map as it is now; none where nothing is known of the reference.
  std::optional<Rigid3d> In(const Map& map) const;
  /// The same where it is known what stands for the reference.
  Rigid3d In(const Map::ResolvedPose& resolved) const;
};

/// A pose that was found, and its covariance as its matches and what was known before leave it.
struct FoundPose {
  Rigid3d T_cam_world;
  Matrix6d covariance = Matrix6d::Zero();  ///< tangent (w, v) on the left
};

/// Which frame of the stream, and when.
struct FrameTime {
  uint32_t index = 0;
  int64_t stamp_ns = 0;
};

struct MotionModelOptions {
  EvennessOptions evenness;
  double prior_rotation_rad = 0.01;  ///< how far a step may be off, for its reach and for late frames...
  double prior_translation = 0.01;   ///< ...and its translation, as a share of the scene's depth
  double max_surprise = 4.0;  ///< a pose that lies more standard deviations of the prior off contradicts it
  double max_speed = 1.0;     ///< of a camera whose motion is not known [depths of the scene / s]...
  double speed_slack = 0.05;  ///< ...and how far it may be off besides [depths]
  double max_turn_rad_per_s = 2.0;  ///< the same for its rotation...
  double turn_slack_rad = 0.05;     ///< ...
  double reach_known_s = 5.0;       ///< of where it was longer ago nothing follows
};

/// What a motion model that predicts this pose so many `steps` ahead knows; `depth` of the scene [map
/// units].
PosePrior MotionPrior(const MotionModelOptions& options, const Rigid3d& T_cam_world, double depth,
                      double steps = 1.0);

/// Where the camera is expected: the newest pose, and its motion carried on. A weak pose that too few
/// landmarks support to be told may lead the search for a few frames (coasting).
class MotionModel {
 public:
  struct Prediction {
    std::optional<Rigid3d> T_cam_world;  ///< none: nothing is known
    std::optional<PosePrior> prior;      ///< where the motion is known and recent
    bool recent = false;  ///< the last frame was tracked so shortly ago that this leads anywhere
  };

  explicit MotionModel(const MotionModelOptions& options) : options_(options) {}

  /// Stands at a known pose; its motion is not known.
  void Begin(const PlacedPose& pose, const FrameTime& time);
  /// Has no pose.
  void BeginLost() {
    last_.reset();
    Stop();
  }
  Prediction Predict(const Map& map, const FrameTime& time) const;
  /// Whether a carried camera can have come to `T_cam_world` since its newest pose: near where its motion
  /// leads, and where that is not known, no faster than hands and cars are.
  bool IsReachable(const Map& map, const Rigid3d& T_cam_world, const FrameTime& time) const;
  /// The same from the pose that was tracked last: where a weak pose has led since is a guess.
  bool IsReachableFromTracked(const Map& map, const Rigid3d& T_cam_world, const FrameTime& time) const;
  /// A frame was tracked. `jumped`: not from the frame before (relocalised), so the step is no motion.
  void OnTracked(const Map& map, const PlacedPose& pose, const FoundPose& found, const FrameTime& time,
                 bool jumped);
  /// A frame was not tracked, but has a weak pose.
  void Coast(const Map& map, const FoundPose& found, const FrameTime& time);
  /// The motion is not known any more.
  void Stop();

  /// Of the frame tracked last; none: none was.
  std::optional<PlacedPose> last() const { return last_ ? std::optional(last_->pose) : std::nullopt; }
  std::optional<int64_t> last_stamp_ns() const {
    return last_ ? std::optional(last_->time.stamp_ns) : std::nullopt;
  }
  bool IsCoasting() const { return coasting_.has_value(); }

 private:
  struct Pose {
    PlacedPose pose;
    FrameTime time;
  };
  /// Coasted ones included.
  const std::optional<Pose>& Newest() const { return coasting_ ? coasting_ : last_; }
  // `depth`: of the scene (Depth), worked out once. Where it is not known, neither is the motion.
  Prediction Predict(const Map& map, const FrameTime& time, std::optional<double> depth) const;
  MotionFilter::Since Since(const Map& map, const Pose& newest, const FrameTime& time, double depth) const;
  std::optional<MotionFilter> MotionTo(const Map& map, const FoundPose& found, const FrameTime& time) const;
  static Matrix6d Floored(const Matrix6d& covariance, double depth);
  bool IsRemembered(const FrameTime& time) const;
  bool IsWithinSpeed(const Map& map, const Pose& pose, const Rigid3d& T_cam_world,
                     const FrameTime& time) const;
  static bool IsWithin(const FrameTime& newest, const FrameTime& time, int64_t limit_ns);
  std::optional<double> Depth(const Map& map) const;

  MotionModelOptions options_;
  std::optional<Pose> last_;
  std::optional<Pose> coasting_;
  std::optional<Matrix6d> covariance_;  ///< of the newest pose, coasted ones included; none: it was given
  std::optional<MotionFilter> motion_;  ///< to the newest pose; none: it is not known
};

}  // namespace dmslam
