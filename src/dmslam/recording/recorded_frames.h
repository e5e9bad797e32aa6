#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/dataset/frame_source.h"
#include "dmslam/recording/log_index.h"

namespace dmslam {

/// How an image is to be read that a frame message holds.
ImageEncoding ToImageEncoding(FrameEncoding encoding);

/// The frames of one camera of a recorded session, with the indices, stamps and bytes with which they were
/// published.
class RecordedFrames : public FrameSource {
 public:
  /// `session`: 0: the only one. `camera`: where frames of a single camera were recorded it is that one,
  /// whatever its number. Throws InputError when the log holds no frames of it, or does not say what camera
  /// it is.
  RecordedFrames(std::shared_ptr<const LogIndex> log, uint32_t session, CameraId camera = 0);

  size_t size() const override { return frames_.size(); }
  int64_t StampNs(size_t index) const override { return camera_->stamps_ns.at(frames_.at(index).first); }
  std::string Name(size_t index) const override;
  EncodedImage Read(size_t index) override;
  size_t missing() const override;
  uint32_t FrameIndex(size_t index) const override { return frames_.at(index).first; }
  bool AsPublished() const override { return true; }
  std::vector<StampedPose> GroundTruth() const override;

  const CameraInfo& camera_info() const { return *camera_->info; }

 private:
  std::shared_ptr<const LogIndex> log_;
  const RecordedCamera* camera_;
  std::vector<std::pair<uint32_t, const RecordedMessage*>> frames_;
};

}  // namespace dmslam
