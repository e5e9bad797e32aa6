#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "dmslam/loops/loopcloser_core.h"
#include "dmslam/mapping/mapper_core.h"
#include "dmslam/slam/frontend_core.h"
#include "dmslam/slam/trajectory_builder.h"

namespace dmslam {

/// The whole SLAM as one value: frontend, mapper and loop closer in lock-step, on the caller's thread. Knows
/// no bus and no clock. The same frames give the same poses, and those that the processes give in lock-step.
class Slam {
 public:
  /// Everything that it is made of; SlamSetup() (dmslam/settings/slam_setup.h) fills it from settings.
  struct Setup {
    FrontendCore::Setup frontend;  ///< also says camera, pyramid, seed and vocabulary
    MapperOptions mapper;
    LoopcloserOptions loop;
  };
  explicit Slam(const Setup& setup);
  Slam(const Slam&) = delete;  ///< the mapper reports to this object
  Slam& operator=(const Slam&) = delete;

  /// Tracks one frame and maps what it adds; returns what is known of its pose now. Index and stamp increase.
  FramePose Process(uint32_t frame_index, int64_t stamp_ns, const GrayView& image);
  FramePose ProcessFeatures(uint32_t frame_index, int64_t stamp_ns, FeatureSet features);

  /// No frame follows: places frames that had no pose, adjusts the maps as a whole, finds every pose once
  /// more and joins them. Call once; takes about as long as some seconds of frames.
  TrajectoryBuilder::Trajectories Finish();

  const Map& map() const { return mapper_.map(); }
  const FrontendCore& frontend() const { return frontend_; }

 private:
  FramePose Handle(const FrontendOutput& output);
  void Settle(KeyframeId id, MapId map_id, bool is_new, std::string why_refused = {});
  void TellLoopcloser();
  void TellFrontend(bool all);

  FrontendCore frontend_;
  MapperCore mapper_;
  LoopcloserCore loopcloser_;
  TrajectoryBuilder trajectory_;
  std::vector<MapDelta> deltas_;  ///< of the mapper, which the frontend has not seen
  size_t told_ = 0;               ///< of them, to the loop closer and the trajectory
};

}  // namespace dmslam
