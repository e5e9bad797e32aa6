#include "dmslam/dataset/video_source.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Five frames at 10 Hz, each of one grey value that tells its number; none where OpenCV cannot write videos
/// here.
std::string WriteVideo() {
  const std::string path = testing::TempDir() + "dmslam_video.avi";
  cv::VideoWriter writer(path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10.0,
                         {64, 48});
  for (int i = 0; i < 5 && writer.isOpened(); ++i)
    writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(40 * i + 20)));
  return writer.isOpened() ? path : "";
}

TEST(VideoSource, ReadsForwardAndBack) {
  const std::string path = WriteVideo();
  if (path.empty()) GTEST_SKIP() << "OpenCV writes no videos here";
  const auto video = OpenVideo(path, 30.0);
  ASSERT_EQ(video->size(), 5u);
  EXPECT_EQ(video->StampNs(2), 200'000'000);
  for (const size_t index : {size_t{0}, size_t{3}, size_t{1}, size_t{4}}) {
    const EncodedImage frame = video->Read(index);
    EXPECT_EQ(frame.encoding, ImageEncoding::kBgr8);
    EXPECT_EQ(frame.width, 64);
    EXPECT_NEAR(DecodeGray(frame, video->Name(index)).at(30, 20), 40.0 * static_cast<double>(index) + 20, 4)
        << index;
  }
  EXPECT_THROW(video->Read(5), InputError);
}

TEST(VideoSource, WhatIsNoVideoIsRefused) { EXPECT_THROW(OpenVideo("/nonexistent.avi", 30.0), InputError); }

}  // namespace
}  // namespace dmslam
