#include "tour_node.h"

#include <algorithm>

#include "dmslam/console/log.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/wire/streams.h"

namespace dmslam {

TourNode::TourNode(NodeContext context, NodeOptions options, const TourNodeOptions& tour)
    : StreamNode(std::move(context), std::move(options), roles::kMapper), tour_options_(tour) {
  if (session_ == 0) session_ = 1;
}

void TourNode::Begin(const CameraInfo&) {
  tour_ = std::make_unique<TourMap>(tour_options_.tour, session_);
  tour_->KeepFeaturesIn(feature_store_);
  snapshots_ = std::make_unique<MapSnapshots>(&tour_->map());
  WantWriter({StreamId::kMap, ReadersOf(StreamId::kMap, 1), {}, snapshots_.get()});
}

bool TourNode::WorkOnce() {
  const int64_t now = context_.now_ns();
  if (tour_->done() || now < next_ns_) return false;
  next_ns_ = std::max(next_ns_, now - 50'000'000) + static_cast<int64_t>(1e9 / tour_options_.rate);
  PublishChange(tour_->Step());
  endpoint_.Advance();
  PublishPose(tour_->map().keyframes().rbegin()->second);
  if (tour_->done()) {
    LogInfo("the map is whole: {} keyframes, {} landmarks", tour_->map().keyframes().size(),
            tour_->map().num_landmarks());
  }
  return true;
}

void TourNode::PublishPose(const Keyframe& keyframe) {
  PoseView view;
  view.session = session_;
  view.frame_index = keyframe.id.frame_index();
  view.stamp_ns = keyframe.stamp_ns;
  view.state = TrackingState::kTracking;
  view.map_id = keyframe.map_id;
  view.has_pose = true;
  view.T_world_cam = keyframe.T_cam_world.Inverse();
  view.inliers = static_cast<int32_t>(keyframe.landmarks.size());
  PublishLoose(view);
}

void TourNode::PublishStatus() {
  CameraInfo info;
  info.utime = context_.wall_us();
  info.session = session_;
  info.camera = TourMap::TourCamera();
  info.sequence = "a made-up tour";
  PublishLoose(info);
  MapperStatus status;
  status.head = MakeStatusHead("", {});
  status.state = MapperStatus::State::kMapping;
  if (tour_) {
    status.version = static_cast<int64_t>(tour_->map().version());
    status.keyframes = static_cast<int32_t>(tour_->map().keyframes().size());
    status.landmarks = static_cast<int32_t>(tour_->map().num_landmarks());
  }
  PublishLoose(status);
}

}  // namespace dmslam
