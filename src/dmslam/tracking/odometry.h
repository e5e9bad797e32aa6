#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/geometry/twist.h"
#include "dmslam/map/map.h"
#include "dmslam/tracking/motion_model.h"
#include "dmslam/tracking/pose_certainty.h"

namespace dmslam {

/// Where the camera is for who controls its motion, in two frames (REP 105): `odom`, in which it never jumps
/// and drifts, and where odom lies in the map, which changes with every correction of the map.
struct OdometryState {
  /// The unbroken way so far, counted from 1; none: no motion was measured yet, and nothing below means
  /// anything. What happened between two segments is not in odom, and their units of length may differ.
  std::optional<uint32_t> segment;
  /// This frame was tracked; else the pose is carried on for a while and then held, or it turns.
  bool measured = false;
  Rigid3d T_odom_cam;             ///< lengths in units of the segment's map at its beginning
  std::optional<Twist> velocity;  ///< along the camera's axes; none: no motion was measured just before
  std::optional<MapId> map_id;
  /// map_from_odom: takes points of odom into the map. As scales of maps are corrected, so is its own.
  Sim3d map_from_odom;
  double depth = 1.0;                       ///< of the scene [units of odom]
  std::optional<PoseCertainty::Step> step;  ///< as PoseCertainty's, in units of odom
};

/// Joins the steps from frame to frame to a way that does not jump.
class Odometer {
 public:
  /// A frame has come, and is not tracked yet, or will not be: the camera is where its motion leads.
  void Predict(const FrameTime& time);
  /// It was tracked. `follows`: from the frame before, not found anew.
  void OnTracked(const Map& map, const FrameTime& time, const PlacedPose& pose, const Rigid3d& T_cam_world,
                 const std::optional<PoseCertainty>& certainty, bool follows);

  /// It was not tracked, but how the camera has turned since an earlier frame was measured.
  void OnTurned(int64_t since_ns, const Eigen::Quaterniond& R_now_since);

  const OdometryState& state() const { return state_; }

 private:
  struct Last {
    PlacedPose pose;
    FrameTime time;
    Rigid3d T_odom_cam;
    uint32_t segment = 0;
  };
  /// Where turns are counted from.
  struct TurnedFrom {
    int64_t stamp_ns = 0;
    Eigen::Quaterniond R_odom_cam;
  };

  bool Continue(const Map& map, const FrameTime& time, const Rigid3d& T_cam_world, bool follows);
  void BeginSegment(bool same_units);
  void SetVelocity(const Twist& step, double duration_s);

  OdometryState state_;
  std::optional<Last> last_;  ///< the frame tracked last
  std::optional<TurnedFrom> turned_from_;
  double units_ = 1.0;  ///< map units in a unit of odom
};

}  // namespace dmslam
