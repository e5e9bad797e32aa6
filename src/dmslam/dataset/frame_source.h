#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/trajectory.h"

namespace dmslam {

/// Frames of a recording in their order in time, by index. Stamps increase strictly.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  virtual size_t size() const = 0;
  virtual int64_t StampNs(size_t index) const = 0;
  /// What to call a frame in a message to the user: its file, or the video's name and the frame's number.
  virtual std::string Name(size_t index) const = 0;
  /// The frame as it is stored, or raw where it is stored as part of a video. Throws InputError.
  virtual EncodedImage Read(size_t index) = 0;
  /// How many frames the recording lists that are not there; they are left out of size().
  virtual size_t missing() const { return 0; }
  /// A trajectory in TUM format with the true poses, where there is one.
  virtual std::optional<std::string> GroundTruthPath() const { return std::nullopt; }
  /// The true poses, where they are known: by default what stands at GroundTruthPath.
  virtual std::vector<StampedPose> GroundTruth() const;
  /// The number under which a frame is published: it counts the frames of the original recording.
  virtual uint32_t FrameIndex(size_t index) const { return static_cast<uint32_t>(index); }
  /// Whether Read gives what was published once: raw frames stay raw.
  virtual bool AsPublished() const { return false; }
};

struct FrameSourceOptions {
  double fps =
      30.0;  ///< Rate of what carries no stamps: numbered images, and videos that do not state theirs.
};

/// Opens whatever `path` is: a TUM RGB-D folder (it has rgb.txt), a EuRoC folder (mav0/cam0, or cam0 itself),
/// a folder of numbered images, or a video file. Throws InputError that says what was looked for.
std::unique_ptr<FrameSource> OpenFrameSource(const std::string& path, const FrameSourceOptions& options = {});

/// "TUM1", "TUM2" or "TUM3" where the folder's name (or one above it) names a camera of the TUM RGB-D
/// benchmark
/// ("freiburg1", or "fr1" between separators).
std::optional<std::string> TumCameraName(const std::string& sequence_dir);

/// The camera of a recording that brings it along or is named after it: camera.yaml in the folder,
/// sensor.yaml of a EuRoC camera, or `config_dir`/TUM{1,2,3}.yaml by the folder's name. None where nothing is
/// known. Throws InputError for a camera file that is there and wrong.
std::optional<Camera> FindCamera(const std::string& sequence_dir, const std::string& config_dir);
/// The same; where nothing is known it throws InputError, too.
Camera KnownCamera(const std::string& sequence_dir, const std::string& config_dir);

}  // namespace dmslam
