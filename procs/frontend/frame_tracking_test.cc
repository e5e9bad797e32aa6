#include "frontend/frame_tracking.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <variant>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/features/testing/synthetic_images.h"
#include "dmslam/settings/frontend_setup.h"

namespace dmslam {
namespace {

using Kind = ImageProblem::Kind;

class FrameTrackingTest : public ::testing::Test {
 protected:
  FrameTrackingTest() {
    options_.wall_us = [this] { return now_us_ += 1000; };
  }

  static ReceivedFrame Received(int width_px, int height_px) {
    ReceivedFrame received;
    received.receive_us = 900;
    Frame& frame = received.frame;
    frame.frame_index = 4;
    frame.stamp_ns = 4000;
    frame.publish_us = 800;
    frame.width_px = width_px;
    frame.height_px = height_px;
    frame.encoding = FrameEncoding::kGray8;
    frame.data = dmslam::testing::RandomRectangles(width_px, height_px, 200, 1).pixels;
    return received;
  }
  std::variant<Tracked, ImageProblem> Track(const ReceivedFrame& received) {
    return FrameTracking(options_).Track(received, false, &core_);
  }
  ImageProblem ProblemOf(const ReceivedFrame& received) {
    const auto result = Track(received);
    const auto* problem = std::get_if<ImageProblem>(&result);
    EXPECT_NE(problem, nullptr);
    EXPECT_EQ(core_.counters().frames, 0U) << "it does not reach the core";
    return problem == nullptr ? ImageProblem() : *problem;
  }

  const Camera camera_ = TestCamera();
  int64_t now_us_ = 1000;
  FrameTracking::Options options_{7, camera_.width_px, camera_.height_px, "", 0, {}};
  FrontendCore core_{FrontendSetup(LoadSettings("", {}), camera_, nullptr)};
};

TEST_F(FrameTrackingTest, MakesOfAnImageWhatIsToBePublished) {
  const auto result = Track(Received(640, 480));
  const auto& tracked = std::get<Tracked>(result);
  const FrameTrace& trace = tracked.trace;
  EXPECT_EQ(trace.session, 7U);
  EXPECT_EQ(trace.frame_index, 4U);
  EXPECT_EQ(trace.stamp_ns, 4000);
  EXPECT_EQ(trace.publish_us, 800);
  EXPECT_EQ(trace.receive_us, 900);
  EXPECT_EQ(trace.begin_us, 2000);
  EXPECT_EQ(trace.decoded_us, 3000);
  EXPECT_EQ(trace.tracked_us, 4000);
  EXPECT_GE(trace.extracted_us, trace.decoded_us);
  EXPECT_EQ(trace.published_us, 0);
  ASSERT_FALSE(tracked.output.events.empty());
  EXPECT_EQ(std::get<FramePose>(tracked.output.events.back()).frame_index, 4U);
  EXPECT_GT(tracked.features.items.size(), 100U);
  EXPECT_EQ(tracked.features.items.size(), core_.frame().features->set.keypoints.size());
  EXPECT_EQ(tracked.features.frame_index, 4U);
}

TEST_F(FrameTrackingTest, AnImageThatCannotBeReadIsNamed) {
  ReceivedFrame truncated = Received(640, 480);
  truncated.frame.data.resize(1000);
  const ImageProblem problem = ProblemOf(truncated);
  EXPECT_EQ(problem.kind, Kind::kUnreadable);
  EXPECT_NE(problem.text.find("frame 4"), std::string::npos) << problem.text;
}

TEST_F(FrameTrackingTest, AnImageOfOtherSizeIsNamedWithTheCure) {
  const ImageProblem problem = ProblemOf(Received(320, 480));
  EXPECT_EQ(problem.kind, Kind::kOtherSize);
  for (const char* part : {"frame 4", "320x480", "640x480", "--camera"})
    EXPECT_NE(problem.text.find(part), std::string::npos) << problem.text;
}

TEST_F(FrameTrackingTest, EveryNthFrameIsDrawn) {
  const auto dir =
      std::filesystem::path(::testing::TempDir()) / ("dmslam_frame_tracking_" + std::to_string(getpid()));
  std::filesystem::create_directories(dir);
  options_.picture_dir = dir;
  options_.picture_every = 3;
  FrameTracking tracking(options_);
  for (const uint32_t index : {4, 5, 6}) {
    ReceivedFrame received = Received(640, 480);
    received.frame.frame_index = index;
    received.frame.stamp_ns = index * 1000;
    const auto result = tracking.Track(received, false, &core_);
    tracking.DrawPicture(std::get<Tracked>(result).output, core_.frame());
  }
  EXPECT_TRUE(std::filesystem::exists(dir / "frame_000006.png"));
  EXPECT_FALSE(std::filesystem::exists(dir / "frame_000004.png"));
  EXPECT_FALSE(std::filesystem::exists(dir / "frame_000005.png"));
  std::filesystem::remove_all(dir);
}

}  // namespace
}  // namespace dmslam
