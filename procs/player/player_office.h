#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/messaging/endpoint.h"
#include "dmslam/runtime/camera_claims.h"
#include "dmslam/runtime/node.h"
#include "dmslam/util/ids.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// Who plays a session is elected as any writer is: it listens first whether another one plays, is refused by
/// name where one does, and says ten times a second that it is there. Frames carry no records; the stream has
/// none.
class PlayerOffice {
 public:
  /// What is played: a camera of a session.
  struct Part {
    uint32_t session = 1;
    CameraId camera_id = 0;
  };
  PlayerOffice(const NodeContext& context, const Part& part, bool take_over, Endpoint* endpoint);
  ~PlayerOffice();
  PlayerOffice(const PlayerOffice&) = delete;
  PlayerOffice& operator=(const PlayerOffice&) = delete;

  /// The channels on which a player of that camera is answered.
  static std::vector<std::string> AnswersTo(CameraId camera_id);

  /// What is said of the camera that is played, and which it is by `ours`. Where others who have played in
  /// this session mean another camera or another recording, and say so twice before a frame was taken, there
  /// is nothing to play in it.
  void HearCamera(const CameraInfo& said, const CameraInfo& ours);
  /// A frame was taken: whatever is said of the camera now is said by nobody who knows better.
  void OnFrameTaken() { frame_taken_ = true; }
  /// To be called before each turn.
  void Advance();
  /// The election is won, and no other player has asked to go on in this one's place.
  bool held() const { return writer_ != nullptr && !hands_over_until_ns_; }
  /// Set when it may not play (any more): the process's exit code, and why. 0: another player goes on in this
  /// one's place.
  std::optional<int> exit_code() const { return exit_code_; }
  const std::string& problem() const { return problem_; }
  /// Of this process: the beginning of each status.
  ProcessHealth Health() const;
  /// When Advance has something to do that no message brings.
  int64_t deadline_ns() const { return hands_over_until_ns_.value_or(INT64_MAX); }

 private:
  void Open();
  void WatchWriter();

  NodeContext context_;
  Part part_;
  Endpoint* endpoint_;
  int64_t begun_ns_;
  WriterElection election_;
  std::unique_ptr<StreamWriter> writer_;
  std::optional<int64_t> hands_over_until_ns_;  ///< then who asked for it must have gone on
  CameraClaims claims_;                         ///< of others
  bool frame_taken_ = false;
  std::optional<int> exit_code_;
  std::string problem_;
};

}  // namespace dmslam
