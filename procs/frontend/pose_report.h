#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/slam/frontend_output.h"
#include "dmslam/tracking/odometry.h"
#include "dmslam/wire/frontend_messages.h"
#include "dmslam/wire/player_messages.h"
#include "dmslam/wire/status.h"
#include "frontend/online_error.h"

namespace dmslam {

/// What is published of the newest pose beside its record: for who controls the camera's motion, for eyes and
/// plots, and in the status.
class PoseReport {
 public:
  /// A frame is tracked next; the first one begins the time to the first map.
  void OnFrame(int64_t stamp_ns);
  /// The frontend's stream says this.
  void OnEvent(const FrontendEvent& event);
  void OnTruth(const GroundTruthPose& truth);

  /// `trace`: of the newest frame, all of it.
  Odometry OdometryOf(const OdometryState& odometry, const FrameTrace& trace) const;
  /// The same for eyes; once for each frame.
  PoseView ViewOf(const FrameTrace& trace);
  /// Why its state is what it is.
  const std::string& reason() const { return last_.reason; }
  void Fill(FrontendStatus* status) const;

 private:
  FramePose last_;
  OnlineError error_;
  std::optional<int64_t> first_frame_ns_;  ///< its stamp
  std::optional<double> first_map_s_;      ///< from then to the first pose; none: there is none yet
};

}  // namespace dmslam
