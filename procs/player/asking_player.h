#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "dmslam/runtime/node.h"
#include "dmslam/runtime/session_choice.h"
#include "dmslam/runtime/wait_notice.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// A player that was not told its session. For a second it hears which sessions there are on the bus. Where
/// there is one it plays in that; of several it guesses none, and ends. Where there is none, the player of
/// the first camera begins one, under a number drawn at random, and that of a further camera waits until
/// there is one.
class AskingPlayer : public Node {
 public:
  /// Makes the player itself, once the session is known.
  using Factory = std::function<std::unique_ptr<Node>(uint32_t session)>;
  /// `num_cameras`: of how many cameras the players and frontends are heard.
  AskingPlayer(NodeContext context, CameraId camera_id, CameraId num_cameras, Factory make_player);

  void Advance() override;
  int64_t deadline_ns() const override;
  void Stop() override;
  std::optional<int> exit_code() const override { return player_ ? player_->exit_code() : exit_code_; }
  std::string problem() const override { return player_ ? player_->problem() : problem_; }
  bool Hangs(int64_t now_ns, int64_t longest_ns) const override {
    return player_ && player_->Hangs(now_ns, longest_ns);
  }

 private:
  void Receive(const std::string& channel, std::span<const uint8_t> bytes);
  void Choose();
  void Play(uint32_t session);

  NodeContext context_;
  CameraId camera_id_;
  int64_t until_ns_;  ///< nothing is chosen before
  SessionChoice choice_;
  WaitNotice wait_notice_{0};
  Factory make_player_;
  std::unique_ptr<Node> player_;  ///< none: it asks
  std::optional<int> exit_code_;
  std::string problem_;
};

}  // namespace dmslam
