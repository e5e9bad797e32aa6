#include "dmslam/dataset/live_source.h"

#include "dmslam/dataset/bgr_frame.h"
#include "dmslam/dataset/joined_clock.h"
#include "dmslam/util/check.h"
#include "dmslam/util/not_yet_error.h"

namespace dmslam {

bool IsLive(const std::string& path) {
  return path.starts_with("/dev/") || path.find("://") != std::string::npos;
}

std::optional<int64_t> DriverNs(double driver_ms) {
  constexpr double kLatestMs = 4e12;  // a century: what a driver means by more is no time
  if (!(driver_ms >= 0 && driver_ms < kLatestMs)) return std::nullopt;
  return static_cast<int64_t>(driver_ms * 1e6);
}

}  // namespace dmslam

#ifdef DMSLAM_HAVE_VIDEOIO

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <thread>

namespace dmslam {
namespace {

constexpr int64_t kFirstPauseMs = 200, kLongestPauseMs = 5000;

template <typename Clock>
int64_t Now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
}

cv::VideoCapture OpenCapture(const std::string& path, const Camera& camera) {
  cv::VideoCapture capture;
  if (!capture.open(path, path.starts_with("/dev/") ? cv::CAP_V4L2 : cv::CAP_ANY)) {
    throw NotYetError(path +
                      ": cannot be opened as a camera; check that it is there, that no other program "
                      "uses it and that you may read it (group video)");
  }
  capture.set(cv::CAP_PROP_FRAME_WIDTH, camera.width_px);
  capture.set(cv::CAP_PROP_FRAME_HEIGHT, camera.height_px);
  capture.set(cv::CAP_PROP_FPS, camera.fps);
  capture.set(cv::CAP_PROP_BUFFERSIZE, 1);
  return capture;
}

/// Throws InputError unless the frame is as the camera file says.
void CheckFrame(const cv::Mat& frame, const std::string& path, const Camera& camera) {
  if (frame.empty()) throw NotYetError(path + ": delivers no image; is the camera working?");
  if (frame.cols == camera.width_px && frame.rows == camera.height_px && frame.type() == CV_8UC3) return;
  throw InputError(path + ": delivers images of " + std::to_string(frame.cols) + "x" +
                   std::to_string(frame.rows) + " pixels, the camera file says " +
                   std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px) +
                   "; calibrate the camera at the size that it delivers");
}

/// A thread waits in the driver; the newest frame waits behind a lock, and an event says that it is there.
class OpenCvCamera : public LiveSource {
 public:
  OpenCvCamera(const std::string& path, const Camera& camera)
      : path_(path),
        camera_(camera),
        clock_(Now<std::chrono::system_clock>(), Now<std::chrono::steady_clock>()),
        capture_(OpenCapture(path, camera)),
        event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    DMSLAM_CHECK(event_ >= 0, "eventfd is part of every Linux");
    cv::Mat first;
    capture_.read(first);
    CheckFrame(first, path, camera);
    thread_ = std::thread([this] { Read(); });
  }
  ~OpenCvCamera() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    stopped_.notify_all();
    thread_.join();
    close(event_);
  }
  OpenCvCamera(const OpenCvCamera&) = delete;
  OpenCvCamera& operator=(const OpenCvCamera&) = delete;

  int fd() const override { return event_; }
  std::optional<LiveFrame> Take() override {
    uint64_t events = 0;
    if (read(event_, &events, sizeof(events)) < 0) events = 0;  // nothing was there
    const std::lock_guard lock(mutex_);
    return std::exchange(newest_, std::nullopt);
  }
  bool ended() const override {
    const std::lock_guard lock(mutex_);
    return ended_ && !newest_;
  }
  std::string away() const override {
    const std::lock_guard lock(mutex_);
    return away_;
  }
  int64_t dropped() const override { return dropped_; }

 private:
  void Read() {
    cv::Mat frame;
    for (uint32_t index = 0; !stop_; ++index) {
      const bool good = capture_.read(frame) && frame.type() == CV_8UC3;
      if (good) {
        Deliver({index, StampOfNewest(), ToEncoded(frame)});
      } else if (IsLive(path_)) {
        Reconnect();
      } else {
        return End();
      }
    }
  }

  int64_t StampOfNewest() {
    return clock_.Stamp(Now<std::chrono::steady_clock>(), DriverNs(capture_.get(cv::CAP_PROP_POS_MSEC)));
  }

  void Deliver(LiveFrame frame) {
    {
      const std::lock_guard lock(mutex_);
      if (newest_) ++dropped_;
      newest_ = std::move(frame);
    }
    Wake();
  }

  void End() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    Wake();
  }

  /// Until the camera is back as it was, or nobody wants it any more.
  void Reconnect() {
    std::string why = path_ + ": delivers no more frames";
    for (int64_t pause_ms = kFirstPauseMs; !stop_; pause_ms = std::min(2 * pause_ms, kLongestPauseMs)) {
      SetAway(why);
      Pause(pause_ms);
      try {
        capture_ = OpenCapture(path_, camera_);
        cv::Mat first;
        capture_.read(first);
        CheckFrame(first, path_, camera_);
        return SetAway("");
      } catch (const std::exception& error) {
        why = error.what();
      }
    }
  }

  void SetAway(const std::string& why) {
    {
      const std::lock_guard lock(mutex_);
      away_ = why;
    }
    Wake();
  }

  void Pause(int64_t milliseconds) {
    std::unique_lock lock(mutex_);
    stopped_.wait_for(lock, std::chrono::milliseconds(milliseconds), [this] { return stop_.load(); });
  }

  void Wake() const {
    const uint64_t one = 1;
    if (write(event_, &one, sizeof(one)) < 0) return;  // it is awake
  }

  const std::string path_;
  const Camera camera_;
  JoinedClock clock_;  ///< of the thread
  cv::VideoCapture capture_;
  const int event_;
  std::atomic<bool> stop_ = false;
  std::atomic<int64_t> dropped_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  std::optional<LiveFrame> newest_;  ///< under mutex_
  bool ended_ = false;               ///< under mutex_
  std::string away_;                 ///< under mutex_
  std::thread thread_;
};

}  // namespace

std::unique_ptr<LiveSource> OpenLive(const std::string& path, const Camera& camera) {
  return std::make_unique<OpenCvCamera>(path, camera);
}

}  // namespace dmslam

#else

namespace dmslam {

std::unique_ptr<LiveSource> OpenLive(const std::string& path, const Camera&) {
  throw InputError(path + ": this build reads no camera; install libopencv-videoio-dev and build again");
}

}  // namespace dmslam

#endif
