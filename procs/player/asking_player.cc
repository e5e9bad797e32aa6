#include "player/asking_player.h"

#include <algorithm>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

/// Between 1 and 2^30. The id of a process is odd.
uint32_t DrawSession(int64_t random_id) {
  return 1 + static_cast<uint32_t>((random_id >> 1) & ((int64_t{1} << 30) - 1));
}

}  // namespace

AskingPlayer::AskingPlayer(NodeContext context, CameraId camera_id, CameraId num_cameras, Factory make_player)
    : context_(std::move(context)),
      camera_id_(camera_id),
      until_ns_(context_.now_ns() + (context_.fresh_system ? 0 : SessionChoice::kListenNs)),
      choice_(until_ns_),
      make_player_(std::move(make_player)) {
  context_.bus->SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) {
    if (!player_) Receive(channel, bytes);
  });
  const CameraId heard = std::max(num_cameras, camera_id_ + 1);
  for (const std::string& channel : SessionChoice::Channels(heard)) context_.bus->Subscribe(channel);
  for (CameraId camera = 0; camera < heard; ++camera)
    context_.bus->Subscribe(ChannelOfCamera(channels::kCameraInfo, camera));
}

void AskingPlayer::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  if (SessionChoice::IsOne(channel)) return choice_.HearBeacon(channel, bytes);
  const auto info = wire::Decode<CameraInfo>(bytes);
  if (info) choice_.HearCamera(info->session, info->sequence, info->utime);
}

void AskingPlayer::Advance() {
  if (!player_ && !exit_code_) Choose();
  if (player_) player_->Advance();
}

void AskingPlayer::Choose() {
  const int64_t now = context_.now_ns();
  if (!choice_.MayChoose(now)) return;
  problem_ = choice_.Problem();
  if (!problem_.empty()) {
    exit_code_ = kExitMisfit;
  } else if (!choice_.sessions().empty()) {
    const auto& [session, name] = *choice_.sessions().begin();
    LogInfo("player: takes session {}, that of the bus ({})", session, name);
    Play(static_cast<uint32_t>(session));
  } else if (camera_id_ == 0) {
    const uint32_t session = DrawSession(context_.random_id);
    LogInfo("player: no session is on the bus; begins session {}", session);
    Play(session);
  } else if (const auto notice = wait_notice_.Due("a session: that of the player of camera 0", now)) {
    LogInfo("player: {}", *notice);
  }
}

void AskingPlayer::Play(uint32_t session) {
  player_ = make_player_(session);  // takes the bus's handler for itself
  make_player_ = {};
}

int64_t AskingPlayer::deadline_ns() const {
  if (player_) return player_->deadline_ns();
  return context_.now_ns() < until_ns_ ? until_ns_ : INT64_MAX;  // then a message brings what it waits for
}

void AskingPlayer::Stop() {
  if (player_) return player_->Stop();
  exit_code_ = kExitDone;
}

}  // namespace dmslam
