#pragma once

#include <memory>

#include "dmslam/runtime/map_snapshots.h"
#include "dmslam/runtime/stream_node.h"
#include "tour_map.h"

namespace dmslam {

struct TourNodeOptions {
  TourOptions tour;
  double rate = 300;  ///< keyframes per second
};

/// Writes the map stream in a mapper's place, and says what a player would say of the camera. It stays when
/// the map is whole.
class TourNode : public StreamNode {
 public:
  TourNode(NodeContext context, NodeOptions options, const TourNodeOptions& tour);

 protected:
  void Begin(const CameraInfo& info) override;
  bool WorkOnce() override;
  void PublishStatus() override;
  int64_t WorkDeadline() const override { return tour_ && !tour_->done() ? next_ns_ : INT64_MAX; }

 private:
  void PublishPose(const Keyframe& keyframe);

  TourNodeOptions tour_options_;
  std::unique_ptr<TourMap> tour_;
  std::unique_ptr<MapSnapshots> snapshots_;
  int64_t next_ns_ = 0;
};

}  // namespace dmslam
