#include "frontend/pose_report.h"

#include <variant>

#include "dmslam/geometry/uncertain_pose.h"

namespace dmslam {
namespace {

/// From the publication of the image to that of its pose.
double LatencyMs(const FrameTrace& trace) {
  return static_cast<double>(trace.published_us - trace.publish_us) * 1e-3;
}

}  // namespace

void PoseReport::OnFrame(int64_t stamp_ns) {
  if (!first_frame_ns_) first_frame_ns_ = stamp_ns;
}

void PoseReport::OnEvent(const FrontendEvent& event) {
  if (const auto* pose = std::get_if<FramePose>(&event)) {
    last_ = *pose;
    if (!first_map_s_ && first_frame_ns_ && pose->HasPose())
      first_map_s_ = static_cast<double>(pose->stamp_ns - *first_frame_ns_) * 1e-9;
  }
  if (std::holds_alternative<MapReset>(event)) {
    first_map_s_.reset();
    error_.Reset();
  }
}

void PoseReport::OnTruth(const GroundTruthPose& truth) {
  error_.OnTruth(truth.frame_index, truth.T_world_cam.translation);
}

Odometry PoseReport::OdometryOf(const OdometryState& odometry, const FrameTrace& trace) const {
  Odometry told;
  told.session = trace.session;
  told.frame_index = trace.frame_index;
  told.stamp_ns = trace.stamp_ns;
  told.state = last_.state;
  told.segment = odometry.segment.value_or(0);
  told.measured = odometry.measured;
  told.T_odom_cam = odometry.T_odom_cam;
  told.has_velocity = odometry.velocity.has_value();
  if (odometry.velocity) {
    told.linear_velocity = odometry.velocity->linear_per_s;
    told.angular_velocity = odometry.velocity->angular_rad_per_s;
  }
  told.map_id = odometry.map_id;
  told.T_map_odom = {odometry.map_from_odom.rotation, odometry.map_from_odom.translation};
  told.scale_map_odom = odometry.map_from_odom.scale;
  told.depth = odometry.depth;
  told.latency_ms = LatencyMs(trace);
  if (odometry.step) {
    told.step_from = odometry.step->from;
    told.step_covariance = UpperTriangle(odometry.step->covariance);
  }
  return told;
}

PoseView PoseReport::ViewOf(const FrameTrace& trace) {
  PoseView view;
  view.session = trace.session;
  view.frame_index = last_.frame_index;
  view.stamp_ns = last_.stamp_ns;
  view.state = last_.state;
  view.map_id = last_.map_id;
  view.has_pose = last_.HasPose();
  if (last_.HasPose()) {
    view.T_world_cam = last_.T_cam_world.Inverse();
    view.error_m = error_.OnPose(last_.frame_index, view.T_world_cam.translation);
  }
  view.inliers = last_.num_static;
  view.moving = last_.num_moving;
  view.unknown = last_.num_unknown;
  view.moving_share = last_.moving_image_share;
  view.latency_ms = LatencyMs(trace);
  return view;
}

void PoseReport::Fill(FrontendStatus* status) const {
  status->features = last_.num_features;
  status->inliers = last_.num_static;
  status->moving = last_.num_moving;
  status->unknown = last_.num_unknown;
  status->moving_share = last_.moving_image_share;
  status->map_id = last_.map_id;
  status->first_map_s = first_map_s_;
}

}  // namespace dmslam
