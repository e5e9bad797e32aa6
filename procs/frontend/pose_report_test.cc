#include "frontend/pose_report.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

FramePose PoseOf(uint32_t frame) {
  FramePose pose;
  pose.frame_index = frame;
  pose.stamp_ns = frame * kSecond;
  pose.state = TrackingState::kTracking;
  pose.map_id = 3;
  pose.reference = KeyframeId::Make(1, 1);
  pose.T_cam_world.translation = {-1.0 * frame, 0.5 * (frame % 3), 0};
  pose.num_static = 40;
  return pose;
}

FrameTrace TraceOf(uint32_t frame) {
  FrameTrace trace;
  trace.session = 7;
  trace.frame_index = frame;
  trace.stamp_ns = frame * kSecond;
  trace.publish_us = 1000;
  trace.published_us = 26'000;
  return trace;
}

std::optional<double> FirstMapS(const PoseReport& report) {
  FrontendStatus status;
  report.Fill(&status);
  return status.first_map_s;
}

TEST(PoseReportTest, TheFirstMapTakesFromTheFirstFrameToThePoseThatLasts) {
  PoseReport report;
  for (const uint32_t frame : {2, 3, 5}) report.OnFrame(frame * kSecond);
  FramePose without;
  without.stamp_ns = 4 * kSecond;
  report.OnEvent(without);
  EXPECT_FALSE(FirstMapS(report));
  report.OnEvent(PoseOf(5));
  report.OnEvent(PoseOf(6));
  EXPECT_EQ(FirstMapS(report), 3.0);
  report.OnEvent(MapReset());
  EXPECT_FALSE(FirstMapS(report));
  report.OnEvent(PoseOf(9));
  EXPECT_EQ(FirstMapS(report), 7.0);
}

TEST(PoseReportTest, OdometryIsOfTheFrameAndSaysHowWellItIsTracked) {
  PoseReport report;
  report.OnEvent(PoseOf(4));
  OdometryState state;
  state.segment = 2;
  state.measured = true;
  state.T_odom_cam.translation = {1, 2, 3};
  state.map_from_odom.scale = 4;
  state.depth = 5;
  Odometry told = report.OdometryOf(state, TraceOf(4));
  EXPECT_EQ(told.session, 7U);
  EXPECT_EQ(told.frame_index, 4U);
  EXPECT_EQ(told.stamp_ns, 4 * kSecond);
  EXPECT_EQ(told.state, TrackingState::kTracking);
  EXPECT_EQ(told.segment, 2U);
  EXPECT_TRUE(told.measured);
  EXPECT_EQ(told.T_odom_cam.translation, state.T_odom_cam.translation);
  EXPECT_EQ(told.scale_map_odom, 4);
  EXPECT_EQ(told.depth, 5);
  EXPECT_DOUBLE_EQ(told.latency_ms, 25);
  EXPECT_FALSE(told.has_velocity);
  EXPECT_FALSE(told.step_from);
  EXPECT_TRUE(told.step_covariance.empty());

  state.velocity.emplace();
  state.velocity->linear_per_s = {0, 0, 1};
  state.step.emplace();
  state.step->from = 3;
  told = report.OdometryOf(state, TraceOf(4));
  EXPECT_TRUE(told.has_velocity);
  EXPECT_EQ(told.linear_velocity.z(), 1);
  EXPECT_EQ(told.step_from, 3U);
  EXPECT_EQ(told.step_covariance.size(), kPoseCovarianceSize);
}

TEST(PoseReportTest, TheViewIsOfTheCameraInTheWorld) {
  PoseReport report;
  report.OnEvent(PoseOf(4));
  const PoseView view = report.ViewOf(TraceOf(4));
  EXPECT_EQ(view.session, 7U);
  EXPECT_EQ(view.frame_index, 4U);
  EXPECT_EQ(view.map_id, 3U);
  EXPECT_TRUE(view.has_pose);
  EXPECT_EQ(view.T_world_cam.translation.x(), 4);
  EXPECT_EQ(view.inliers, 40);
  EXPECT_DOUBLE_EQ(view.latency_ms, 25);
  EXPECT_FALSE(view.error_m) << "nobody has said where it truly was";
  report.OnEvent(FramePose());
  EXPECT_FALSE(report.ViewOf(TraceOf(5)).has_pose);
}

TEST(PoseReportTest, TheErrorIsOfTheMapThatIsTrackedIn) {
  PoseReport report;
  const auto error_of = [&](uint32_t frame) {
    const FramePose pose = PoseOf(frame);
    GroundTruthPose truth;
    truth.frame_index = frame;
    truth.T_world_cam.translation = 2 * pose.T_cam_world.Inverse().translation;
    report.OnTruth(truth);
    report.OnEvent(pose);
    return report.ViewOf(TraceOf(frame)).error_m;
  };
  for (uint32_t frame = 0; frame < 9; ++frame) EXPECT_FALSE(error_of(frame));
  EXPECT_NEAR(error_of(9).value(), 0, 1e-9);
  report.OnEvent(MapReset());
  EXPECT_FALSE(error_of(10)) << "too little was tracked in the new one";
}

}  // namespace
}  // namespace dmslam
