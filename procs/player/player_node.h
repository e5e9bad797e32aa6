#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/frame_source.h"
#include "dmslam/dataset/play_changes.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/messaging/bus.h"
#include "dmslam/runtime/node.h"
#include "dmslam/runtime/wait_notice.h"
#include "dmslam/wire/codec.h"
#include "player/end_of_play.h"
#include "player/frame_encoding.h"
#include "player/play_schedule.h"
#include "player/player_office.h"
#include "player/readiness.h"

namespace dmslam {

/// What is played, and how.
struct PlayerOptions {
  std::string sequence;  ///< path of what is played; its last part names it
  Camera camera;
  uint32_t session = 1;
  CameraId camera_id = 0;  ///< of several that work on one map
  bool take_over = false;  ///< asks a present player of the session to leave
  PlaybackMode mode = PlaybackMode::kRealtime;
  double speed = 1.0;        ///< factor on the recorded rate; 0: as fast as possible
  size_t start = 0;          ///< first frame
  size_t frames = SIZE_MAX;  ///< at most so many
  /// Frames up to the one of this index were played before this process began: they count, and are not played
  /// again.
  std::optional<uint32_t> behind;
  EncodingOptions encoding;
  bool local_frames = false;  ///< frames stay on this host: the frontend runs here, and the bus leaves it
  /// Who is to be ready before the first frame: of frontend and mapper. Only in real time: in lock-step a
  /// frame is repeated until it is done.
  std::vector<std::string> awaited;
  double lead_s = 0.5;  ///< between the first camera info and the first frame, so that others can get ready
  std::vector<BlackOut> black_outs;
  std::vector<Jump> jumps;
};

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
  /// Of frames.
  struct Counts {
    int64_t published = 0, repeats = 0;
    size_t jumped = 0, black = 0, unreadable = 0;
  };

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
  Counts counts_;
  PlaySchedule schedule_;
  Frame frame_;  ///< the newest one published
  SharedBytes frame_bytes_;
  bool awaiting_done_ = false;  ///< lock-step
  Readiness readiness_;
  WaitNotice wait_notice_{1'000'000'000};
  FurtherFrontend further_;
  EndOfPlay end_;
  bool held_back_ = false;  ///< others are not ready yet
  bool playing_ = false;    ///< the office is held: nobody else plays this session
  int64_t playing_since_ns_ = 0;
  int64_t next_info_ns_ = 0, next_repeat_ns_ = 0, next_status_ns_ = 0;
  int64_t infos_said_ = 0;
  std::optional<int> exit_code_;
  std::string problem_, first_unreadable_;
};

}  // namespace dmslam
