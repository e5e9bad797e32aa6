#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/dataset/frame_source.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/messaging/bus.h"
#include "dmslam/runtime/node.h"
#include "dmslam/runtime/wait_notice.h"
#include "dmslam/wire/codec.h"
#include "player/end_of_play.h"
#include "player/frame_under_way.h"
#include "player/play_counts.h"
#include "player/play_schedule.h"
#include "player/player_office.h"
#include "player/player_options.h"
#include "player/readiness.h"

namespace dmslam {

/// Feeds frames to the bus, in real time or in lock-step.
class PlayerNode : public Node {
 public:
  PlayerNode(NodeContext context, PlayerOptions options, std::unique_ptr<FrameSource> source);

  void Advance() override;
  int64_t deadline_ns() const override;
  void Stop() override { exit_code_ = 0; }
  std::optional<int> exit_code() const override { return exit_code_; }
  std::string problem() const override { return problem_; }

  int64_t published() const { return counts_.published; }
  size_t total() const { return schedule_.size(); }

 private:
  bool MayPlay();
  void Receive(const std::string& channel, std::span<const uint8_t> bytes);
  void OnFrameDone(const FrameDone& done);
  void OnSequenceDone(const SequenceDone& done);
  void SkipBehind(uint32_t frame_index);
  CameraInfo MakeCameraInfo() const;
  bool OthersAreReady(int64_t now_ns);
  void PublishFrame();
  bool MakeFrame(size_t index);
  void PublishGroundTruth(size_t index);
  void PublishEnd();
  void PublishStatus(PlayerStatus::State state);
  bool IsBlack(size_t index) const;

  NodeContext context_;
  PlayerOptions options_;
  std::unique_ptr<FrameSource> source_;
  Endpoint endpoint_;
  PlayerOffice office_;
  std::vector<StampedPose> ground_truth_;
  PlayCounts counts_;
  PlaySchedule schedule_;
  FrameUnderWay under_way_;
  Readiness readiness_;
  WaitNotice wait_notice_{1'000'000'000};
  FurtherFrontend further_;
  EndOfPlay end_;
  bool held_back_ = false;  ///< others are not ready yet
  bool playing_ = false;    ///< the office is held: nobody else plays this session
  int64_t playing_since_ns_ = 0;
  int64_t next_info_ns_ = 0, next_status_ns_ = 0;
  int64_t infos_said_ = 0;
  std::optional<int> exit_code_;
  std::string problem_;
};

}  // namespace dmslam
