#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/geometry/uncertain_pose.h"

namespace dmslam {

/// A pose as it was told while the camera moved.
struct ToldPose {
  StampedPose pose;  ///< in the map as it was then
  uint32_t frame = 0;
  int state = 0;  ///< as dmslam_frame_pose_t numbers them
  uint32_t map = 0;
  uint32_t reference_frame = 0;  ///< of the keyframe that it was told relative to...
  Rigid3d T_cam_reference;       ///< ...
  double reference_scale = 1.0;
  double depth = 1.0;  ///< of the scene, median [map units]
  /// In the reference's frame: position, rotation vector, along its axes; none: not known.
  std::optional<Matrix6d> covariance;
  std::optional<uint32_t> step_from;
  std::optional<Matrix6d> step_covariance;  ///< in the camera of frame step_from

  /// For RelativeCovariance(): along the map's axes. None where the covariance is not known.
  std::optional<UncertainPose> InMap() const;
};

/// Writes poses_online.csv: a line of names, a line for each pose; a covariance is 21 columns, its upper
/// triangle row by row, empty where it is not known. Throws InputError when it cannot be written.
void WriteToldPoses(const std::string& path, std::span<const ToldPose> poses);

/// Reads such a file. Throws InputError that names file and line where it is not one.
std::vector<ToldPose> ReadToldPoses(const std::string& path);

}  // namespace dmslam
