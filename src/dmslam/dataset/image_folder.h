#pragma once

#include <string>
#include <vector>

#include "dmslam/dataset/frame_source.h"
#include "dmslam/dataset/tum_sequence.h"

namespace dmslam {

/// A folder of numbered images ("frame7.png" before "frame10.png"), played at a constant rate: stamps start
/// at zero.
class ImageFolder : public FrameSource {
 public:
  /// Throws InputError for a folder that is not there, has no numbered image, or has a number twice.
  ImageFolder(const std::string& folder, double fps);

  size_t size() const override { return frames_.size(); }
  int64_t StampNs(size_t index) const override { return frames_.at(index).stamp_ns; }
  std::string Name(size_t index) const override { return frames_.at(index).path; }
  EncodedImage Read(size_t index) override;

  /// Whether the folder holds at least one image with a number in its name.
  static bool Recognises(const std::string& folder);

 private:
  std::vector<StampedFile> frames_;
};

/// The left camera of a sequence of the EuRoC MAV dataset: cam0/data.csv lists stamps in nanoseconds and
/// files in cam0/data. Images that are listed and not there are counted and left out.
class EurocSequence : public FrameSource {
 public:
  /// `folder` is the sequence (it has mav0/cam0), mav0, or cam0. Throws InputError as TumSequence does.
  explicit EurocSequence(const std::string& folder);

  size_t size() const override { return frames_.size(); }
  int64_t StampNs(size_t index) const override { return frames_.at(index).stamp_ns; }
  std::string Name(size_t index) const override { return frames_.at(index).path; }
  EncodedImage Read(size_t index) override;
  size_t missing() const override { return missing_; }

  /// The folder of the left camera for any of the three spellings; none where there is no data.csv.
  static std::optional<std::string> CameraFolder(const std::string& folder);
  /// Intrinsics and distortion from cam0/sensor.yaml. Throws InputError that names file and field.
  static Camera ReadCamera(const std::string& sensor_yaml);

 private:
  std::vector<StampedFile> frames_;
  size_t missing_ = 0;
};

}  // namespace dmslam
