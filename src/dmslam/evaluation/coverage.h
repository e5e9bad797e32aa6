#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"

namespace dmslam {

/// How much of a sequence a trajectory covers: an error without it is no result.
struct Coverage {
  size_t poses = 0;
  // Frames of the sequence; nothing where they are not known.
  std::optional<size_t> frames;
  // Listed frames that have a pose / frames, in percent.
  std::optional<double> percent;
  // From the first frame to the first that has a pose [s]; nothing where none has one, or where the frames'
  // stamps are not known.
  std::optional<double> time_to_first_pose_s;
  // Poses whose stamp is within half a millisecond of no listed frame.
  size_t poses_of_no_frame = 0;
};

/// Coverage of the frames taken at `frame_stamps_ns` (rising).
Coverage ComputeCoverage(std::span<const StampedPose> estimate, std::span<const int64_t> frame_stamps_ns);

/// Coverage where only the number of frames is known (0: not even that).
Coverage ComputeCoverage(std::span<const StampedPose> estimate, size_t frames);

/// The stamps of a TUM image list (`rgb.txt`: "stamp filename" per line). Throws InputError that names file
/// and line.
std::vector<int64_t> ReadFrameStamps(const std::string& path);

}  // namespace dmslam
