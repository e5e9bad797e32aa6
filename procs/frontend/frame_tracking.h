#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "dmslam/dataset/image.h"
#include "dmslam/slam/frontend_core.h"
#include "dmslam/wire/frontend_messages.h"
#include "frontend/incoming_frames.h"
#include "frontend/refused_images.h"

namespace dmslam {

/// What the core makes of a frame, to be published.
struct Tracked {
  FrameTrace trace;  ///< all but when it was published
  FrontendOutput output;
  OdometryState odometry;
  FeatureView features;
  double extract_ms = 0;
};

/// Makes of a frame as it came what is to be published of it: decodes its image and has the core track it. Of
/// the core's jobs: nobody else touches it.
class FrameTracking {
 public:
  struct Options {
    uint32_t session = 0;
    int width_px = 0;  ///< of the camera's images
    int height_px = 0;
    std::string picture_dir;
    int picture_every = 0;             ///< every Nth frame is drawn; 0: none
    std::function<int64_t()> wall_us;  ///< for the trace alone
  };
  explicit FrameTracking(Options options) : options_(std::move(options)) {}

  /// `withheld`: no keyframes now. A frame whose image is refused does not reach the core.
  std::variant<Tracked, ImageProblem> Track(const ReceivedFrame& received, bool withheld, FrontendCore* core);
  /// Of the frame that was tracked last, where pictures are wanted of it. Throws InputError when the folder
  /// cannot be written.
  void DrawPicture(const FrontendOutput& output, const TrackedFrame& frame) const;

 private:
  std::optional<ImageProblem> Decode(const Frame& frame);

  Options options_;
  GrayDecoder decoder_;
  GrayImage image_;  ///< of the newest frame
};

}  // namespace dmslam
