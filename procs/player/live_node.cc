#include "player/live_node.h"

#include <algorithm>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/publish.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"
#include "dmslam/wire/codec.h"
#include "player/intervals.h"

namespace dmslam {
namespace {

/// What to call the camera in messages: its device, or the address without a password.
std::string CameraName(const std::string& path) {
  const size_t from = path.find_last_of('@');
  return path.substr(from == std::string::npos ? 0 : from + 1);
}

}  // namespace

LiveNode::LiveNode(NodeContext context, PlayerOptions options, std::unique_ptr<LiveSource> source)
    : context_(std::move(context)),
      options_(std::move(options)),
      source_(std::move(source)),
      endpoint_(context_.bus, context_.now_ns),
      office_(context_, {options_.session, options_.camera_id}, options_.take_over, &endpoint_) {
  if (options_.behind) first_index_ = *options_.behind + 1;
  endpoint_.SetOtherHandler(PlayerOffice::AnswersTo(options_.camera_id),
                            [this](const std::string& channel, std::span<const uint8_t> bytes) {
                              Receive(SplitCamera(channel).channel, bytes);
                            });
  if (context_.watch) context_.watch(source_->fd(), [this] { TakeFrame(); });
}

void LiveNode::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  end_.OnStatus(channel, bytes, options_.session, context_.now_ns());
  if (channel == channels::kSequenceDone) {
    const auto done = wire::Decode<SequenceDone>(bytes);
    if (!done || done->session != options_.session) return;
    ending_ = end_.OnSequenceDone(context_.now_ns()) || ending_;
    return;
  }
  if (channel == channels::kCameraInfo) {
    if (const auto said = wire::Decode<CameraInfo>(bytes)) office_.HearCamera(*said, MakeCameraInfo());
    return;
  }
  const auto done = wire::Decode<FrameDone>(bytes);
  if (done && done->session == options_.session) OnFrameDone(*done);
}

/// A player before this one was further: its frames are followed by ours, and its time by ours, whatever the
/// clock of this host says. The frontend says so to each frame of ours that it refuses.
void LiveNode::OnFrameDone(const FrameDone& done) {
  if (published_ == 0 || in_step_) return;
  if (done.frame_index <= frame_.frame_index) {
    in_step_ = done.frame_index == frame_.frame_index;
    if (in_step_) office_.OnFrameTaken();
    return;
  }
  const auto newest = further_.OnAnswer({done.frame_index, done.stamp_ns}, context_.now_ns());
  if (!newest) return;
  first_index_ = std::max(first_index_, newest->index + 1);
  floor_stamp_ns_ = std::max(floor_stamp_ns_, newest->stamp_ns);
}

/// In the dataset's time: behind what a player before this one has said.
int64_t LiveNode::InSessionTime(int64_t stamp_ns) {
  if (stamp_ns + shift_ns_ <= floor_stamp_ns_) {
    const double period_s = options_.camera.fps > 0 ? 1 / options_.camera.fps : 0.05;
    shift_ns_ = floor_stamp_ns_ - stamp_ns + ToNs(period_s);
    LogWarning("player: the session is {:.1f} s ahead of this host's clock; stamps go on behind it",
               static_cast<double>(shift_ns_) * 1e-9);
  }
  return stamp_ns + shift_ns_;
}

void LiveNode::SayWhetherAway() {
  const std::string away = source_->away();
  if (away == away_) return;
  if (away_.empty()) LogWarning("{}; it is looked for until it is back", away);
  if (away.empty()) LogInfo("{}: the camera is back", CameraName(options_.sequence));
  away_ = away;
}

/// Called when the camera has something to say. Late frames were dropped by the source, which keeps the
/// newest.
void LiveNode::TakeFrame() {
  auto live = source_->Take();
  if (!live) {
    if (source_->ended() && !ending_) {
      LogWarning("{}: the camera delivers no more frames", CameraName(options_.sequence));
      ending_ = true;
    }
    return;
  }
  if (ending_ || !office_.held()) return;
  frame_ = Frame();
  frame_.camera_id = options_.camera_id;
  frame_.session = options_.session;
  frame_.frame_index = first_index_ + live->index;
  frame_.stamp_ns = InSessionTime(live->stamp_ns);
  frame_.capture_us = live->stamp_ns / 1000;
  EncodeFrame(live->image, CameraName(options_.sequence), options_.encoding, false, &frame_);
  frame_.publish_us = context_.wall_us();
  context_.bus->Publish({ChannelOfCamera(channels::kFrame, options_.camera_id),
                         std::make_shared<const Bytes>(wire::Encode(frame_)), options_.local_frames});
  ++published_;
  ending_ = static_cast<size_t>(published_) >= options_.frames;
}

CameraInfo LiveNode::MakeCameraInfo() const {
  CameraInfo info;
  info.utime = context_.wall_us();
  info.session = options_.session;
  info.camera = options_.camera;
  info.sequence = CameraName(options_.sequence);
  const bool bounded = options_.frames > 0 && options_.frames != SIZE_MAX;
  if (bounded) info.num_frames = static_cast<int64_t>(options_.frames);
  info.mode = PlaybackMode::kRealtime;
  return info;
}

void LiveNode::PublishStatus() {
  PlayerStatus status;
  status.head.utime = context_.wall_us();
  status.head.session = options_.session;
  status.head.health = office_.Health();
  if (!away_.empty()) status.head.reason = "the camera is away";
  status.state = ending_ ? PlayerStatus::State::kDone : PlayerStatus::State::kPlaying;
  status.frames_published = published_;
  status.frames_missing = source_->dropped();
  if (published_ > 0) status.frame_index = static_cast<int32_t>(frame_.frame_index);
  status.late_ms = published_ > 0 ? static_cast<double>(frame_.publish_us - frame_.capture_us) * 1e-3 : 0;
  PublishLoose(context_.bus, status, false, options_.camera_id);
}

void LiveNode::PublishEnd() {
  EndOfSequence end;
  end.utime = context_.wall_us();
  end.session = options_.session;
  end.frames_published = published_ + first_index_;  // with those of players before this one
  end.frames_listed = end.frames_published + source_->dropped();
  end.frames_missing = source_->dropped();
  if (published_ > 0) end.last_frame_index = static_cast<int32_t>(frame_.frame_index);
  end.last_stamp_ns = frame_.stamp_ns;
  PublishLoose(context_.bus, end, false, options_.camera_id);
}

void LiveNode::Advance() {
  const int64_t now = context_.now_ns();
  if (exit_code_) return;
  office_.Advance();
  if (office_.exit_code()) {
    exit_code_ = office_.exit_code();
    problem_ = office_.problem();
  }
  if (exit_code_ || !office_.held()) return;
  if (now >= next_info_ns_) {
    next_info_ns_ = now + InfoAgainNs(infos_said_++);
    PublishLoose(context_.bus, MakeCameraInfo(), false, options_.camera_id);
  }
  SayWhetherAway();
  if (now >= next_status_ns_) {
    next_status_ns_ = now + kStatusEveryNs;
    PublishStatus();
  }
  if (!ending_) TakeFrame();
  if (!ending_) return;
  if (end_.IsDue(now)) PublishEnd();
  if (const std::optional<int> code = end_.ExitCode(now, stopped_)) exit_code_ = code;
  if (exit_code_ == kExitNoFrontend) problem_ = EndOfPlay::NobodyAnswered();
}

void LiveNode::Stop() {
  if (!office_.held()) exit_code_ = kExitDone;  // it has not begun
  ending_ = true;
  stopped_ = true;
}

int64_t LiveNode::deadline_ns() const {
  if (!office_.held()) return std::min(endpoint_.deadline_ns(), office_.deadline_ns());
  const int64_t deadline = std::min({next_info_ns_, next_status_ns_, endpoint_.deadline_ns()});
  return ending_ ? std::min(deadline, end_.due_ns()) : deadline;
}

}  // namespace dmslam
