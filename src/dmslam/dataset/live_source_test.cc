#include "dmslam/dataset/live_source.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <ctime>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>

#include "dmslam/dataset/joined_clock.h"
#include "dmslam/util/check.h"

namespace {

/// While this is on somebody sets the wall clock back by a minute whenever it was read.
std::atomic<bool> g_clock_is_set{false};
std::atomic<int> g_times_read{0};

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (result == 0 && clock == CLOCK_REALTIME && g_clock_is_set) time->tv_sec -= 60 * g_times_read++;
  return result;
}

namespace dmslam {
namespace {

/// Five frames, each of one grey value that tells its number; none where OpenCV cannot write videos here.
std::string WriteVideo() {
  const std::string path = testing::TempDir() + "dmslam_live.avi";
  cv::VideoWriter writer(path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10.0,
                         {64, 48});
  for (int i = 0; i < 5 && writer.isOpened(); ++i)
    writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(40 * i + 20)));
  return writer.isOpened() ? path : "";
}

Camera SmallCamera() {
  return {.width_px = 64, .height_px = 48, .fx_px = 60, .fy_px = 60, .cx_px = 32, .cy_px = 24};
}

TEST(LiveSource, TellsCamerasFromRecordings) {
  EXPECT_TRUE(IsLive("/dev/video0"));
  EXPECT_TRUE(IsLive("rtsp://robot/stream"));
  EXPECT_FALSE(IsLive("video.avi"));
  EXPECT_FALSE(IsLive("/data/kitchen"));
}

TEST(JoinedClock, AWallClockThatIsSetChangesNothing) {
  constexpr int64_t kSecond = 1'000'000'000;
  JoinedClock clock(1000 * kSecond, 5 * kSecond);
  EXPECT_EQ(clock.Stamp(6 * kSecond, 0), 1001 * kSecond)
      << "a driver that says nothing, or counts from elsewhere";
  EXPECT_EQ(clock.Stamp(8 * kSecond, 7'900'000'000), 1002'900'000'000)
      << "the driver knows better when it was";
  EXPECT_EQ(clock.Stamp(8 * kSecond, 9 * kSecond), 1003 * kSecond) << "no frame is from the future";
  EXPECT_EQ(clock.Stamp(8 * kSecond, 8 * kSecond), 1003 * kSecond + 1) << "stamps rise";
  EXPECT_EQ(clock.Stamp(9 * kSecond, std::nullopt), 1004 * kSecond);
}

TEST(JoinedClock, ADriverThatIsFarOffIsNotBelieved) {
  constexpr int64_t kSecond = 1'000'000'000;
  for (const int64_t driver_ns : {INT64_MIN, INT64_MIN + kSecond, -kSecond, INT64_MAX}) {
    JoinedClock clock(1000 * kSecond, 5 * kSecond);
    EXPECT_EQ(clock.Stamp(6 * kSecond, driver_ns), 1001 * kSecond) << driver_ns;
  }
}

// A stream of images over HTTP has no time of its own; what OpenCV says of it is no time either.
TEST(LiveSource, WhatIsNoTimeOfTheDriverCountsAsNone) {
  EXPECT_EQ(DriverNs(1234.5), 1'234'500'000);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double driver_ms : {nan, inf, -inf, -3.7e17, -1.0, 9.3e15})
    EXPECT_EQ(DriverNs(driver_ms), std::nullopt) << driver_ms;
}

// A file stands for the camera: it delivers as fast as it can be read, and ends.
TEST(LiveSource, GivesTheNewestFrameAndCountsTheOthers) {
  const std::string path = WriteVideo();
  if (path.empty()) GTEST_SKIP() << "OpenCV writes no videos here";
  const auto source = OpenLive(path, SmallCamera());
  int64_t taken = 0, last_stamp_ns = 0, last_index = -1;
  while (!source->ended()) {
    pollfd waiting{source->fd(), POLLIN, 0};
    ASSERT_EQ(poll(&waiting, 1, 10'000), 1) << "the source says nothing more and has not ended";
    if (const auto frame = source->Take()) {
      ++taken;
      EXPECT_GT(frame->stamp_ns, last_stamp_ns);
      EXPECT_GT(frame->index, last_index);
      last_stamp_ns = frame->stamp_ns;
      last_index = frame->index;
      // The first frame of the file was read to see its size.
      EXPECT_NEAR(DecodeGray(frame->image, "frame").at(30, 20), 40.0 * (frame->index + 1) + 20, 4);
    }
  }
  EXPECT_EQ(last_index, 3);
  EXPECT_EQ(taken + source->dropped(), 4);
  EXPECT_FALSE(source->Take().has_value());
}

TEST(LiveSource, AWallClockThatIsSetBackMovesNoStamp) {
  const std::string path = WriteVideo();
  if (path.empty()) GTEST_SKIP() << "OpenCV writes no videos here";
  g_clock_is_set = true;
  const auto source = OpenLive(path, SmallCamera());
  std::vector<int64_t> stamps;
  while (!source->ended()) {
    pollfd waiting{source->fd(), POLLIN, 0};
    ASSERT_EQ(poll(&waiting, 1, 10'000), 1) << "the source says nothing more and has not ended";
    if (const auto frame = source->Take()) stamps.push_back(frame->stamp_ns);
  }
  g_clock_is_set = false;
  ASSERT_FALSE(stamps.empty());
  EXPECT_GT(g_times_read, 0) << "stamps are joined to the wall clock once";
  const int64_t wall_ns = static_cast<int64_t>(std::time(nullptr)) * 1'000'000'000;
  EXPECT_LT(std::abs(wall_ns - stamps.front()), 50'000'000'000) << "by its first reading";
  for (size_t i = 1; i < stamps.size(); ++i) {
    EXPECT_GT(stamps[i] - stamps[i - 1], 1) << "not pressed behind the one before";
    EXPECT_LT(stamps[i] - stamps[i - 1], 50'000'000'000);
  }
}

TEST(LiveSource, RefusesWhatIsNoCameraOfThatSize) {
  EXPECT_THROW(OpenLive("/dev/no_such_camera", SmallCamera()), InputError);
  const std::string path = WriteVideo();
  if (path.empty()) GTEST_SKIP() << "OpenCV writes no videos here";
  Camera camera = SmallCamera();
  camera.width_px = 128;
  try {
    OpenLive(path, camera);
    FAIL() << "another size was taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("64x48 pixels, the camera file says 128x48"), std::string::npos);
  }
}

}  // namespace
}  // namespace dmslam
