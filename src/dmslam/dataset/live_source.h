#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/image.h"

namespace dmslam {

/// One image as a camera delivered it.
struct LiveFrame {
  uint32_t index = 0;    ///< counts what the camera delivered, taken or not
  int64_t stamp_ns = 0;  ///< when it was taken, nanoseconds since 1970 (JoinedClock); rises strictly
  EncodedImage image;
};

/// A camera that delivers frames at a rate of its own. Whoever is late gets the newest one.
class LiveSource {
 public:
  virtual ~LiveSource() = default;
  /// Can be read when Take has something new to say.
  virtual int fd() const = 0;
  /// The newest frame that was not taken yet.
  virtual std::optional<LiveFrame> Take() = 0;
  /// No more frames will come, and the last one was taken.
  virtual bool ended() const = 0;
  /// The camera went away, and is being looked for: why, in a few words; empty while it is there.
  virtual std::string away() const { return {}; }
  /// How many frames were replaced by a newer one before they were taken.
  virtual int64_t dropped() const = 0;
};

/// Whether `path` names a camera rather than a recording: a device (/dev/video0) or the address of a stream
/// (rtsp://..., http://...).
bool IsLive(const std::string& path);

/// What OpenCV says of when a frame was taken [ms], as nanoseconds; none: it says nothing that is a time, as
/// of images that come over HTTP.
std::optional<int64_t> DriverNs(double driver_ms);

/// Opens a camera with OpenCV's videoio and asks it for the size and rate that `camera` states. A thread
/// reads it; a camera that goes away is looked for until it is back, at first every 0.2 s and then every 5 s.
/// Throws NotYetError where it cannot be opened, InputError where it delivers images of another size.
std::unique_ptr<LiveSource> OpenLive(const std::string& path, const Camera& camera);

}  // namespace dmslam
