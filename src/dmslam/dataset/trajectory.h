#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// A camera's pose at an instant. T_world_cam takes points of the camera frame (x right, y down, z forward)
/// into the world; its translation is where the camera stands.
struct StampedPose {
  int64_t stamp_ns = 0;
  Rigid3d T_world_cam;
};

/// Reads a trajectory in TUM format: "stamp tx ty tz qx qy qz qw" per line, separated by blanks or commas,
/// '#' starts a comment line. Stamps are read exactly and must increase strictly; quaternions are normalised.
/// Throws InputError that names file and line for a wrong column count, a stamp or value that is not a finite
/// number, a stamp that repeats or goes back, a zero quaternion, and a file without any pose.
std::vector<StampedPose> ReadTrajectory(const std::string& path);

/// A reference trajectory, and what was passed over in it.
struct GroundTruth {
  std::vector<StampedPose> poses;
  // "file:line" of the poses left out because their stamp repeats the one before.
  std::vector<std::string> repeated;
};

/// Reads a ground truth as ReadTrajectory does, but for this: a motion capture system may record a stamp
/// twice, as in one line of TUM's freiburg2_desk, which is no error of the user's. While at most one pose in
/// a thousand does, the first of both is kept; beyond, the first repetition is named in an InputError as
/// ever.
GroundTruth ReadGroundTruth(const std::string& path);

/// Writes a trajectory in TUM format (nine decimals, quaternions with w >= 0), with a comment line that names
/// the columns. The same poses give the same bytes. Throws InputError when the file cannot be written.
void WriteTrajectory(const std::string& path, std::span<const StampedPose> poses);

/// One line of such a file, without the line end.
std::string FormatPose(const StampedPose& pose);

}  // namespace dmslam
