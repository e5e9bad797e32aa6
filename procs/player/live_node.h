#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/dataset/live_source.h"
#include "dmslam/runtime/node.h"
#include "player/end_of_play.h"
#include "player/player_office.h"
#include "player/player_options.h"

namespace dmslam {

/// Feeds a camera's frames to the bus as they come, until so many were published, or somebody asks to stop (a
/// camera that goes away is waited for); then says that the sequence has ended, until the frontend has heard
/// it.
class LiveNode : public Node {
 public:
  /// Of the options those of a recording (start, speed, black-outs, jumps, mode) mean nothing here.
  LiveNode(NodeContext context, PlayerOptions options, std::unique_ptr<LiveSource> source);

  void Advance() override;
  int64_t deadline_ns() const override;
  /// Ends the sequence; the node is done when the frontend has heard it, or has said nothing for two seconds.
  void Stop() override;
  std::optional<int> exit_code() const override { return exit_code_; }
  std::string problem() const override { return problem_; }

  int64_t published() const { return published_; }

 private:
  void Receive(const std::string& channel, std::span<const uint8_t> bytes);
  void OnFrameDone(const FrameDone& done);
  int64_t InSessionTime(int64_t stamp_ns);
  void SayWhetherAway();
  void TakeFrame();
  CameraInfo MakeCameraInfo() const;
  void PublishStatus();
  void PublishEnd();

  NodeContext context_;
  PlayerOptions options_;
  std::unique_ptr<LiveSource> source_;
  Endpoint endpoint_;
  PlayerOffice office_;
  uint32_t first_index_ =
      0;  ///< of the camera's first frame: above 0 where a player before this one has published
  int64_t floor_stamp_ns_ = 0;  ///< of the newest frame of a player before this one
  int64_t shift_ns_ = 0;        ///< from this host's time to the session's
  std::string away_;            ///< why the camera is; empty while it is there
  Frame frame_;                 ///< the newest one published
  int64_t published_ = 0;
  bool ending_ = false, stopped_ = false;
  bool in_step_ = false;  ///< the frontend has done a frame of ours: it cannot be further than we are
  FurtherFrontend further_;
  EndOfPlay end_;
  int64_t next_info_ns_ = 0, next_status_ns_ = 0;
  int64_t infos_said_ = 0;
  std::optional<int> exit_code_;
  std::string problem_;
};

}  // namespace dmslam
