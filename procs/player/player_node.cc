#include "player/player_node.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/publish.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"
#include "player/intervals.h"

namespace dmslam {
namespace {

std::string SequenceName(const std::string& path) {
  const std::filesystem::path p = std::filesystem::path(path).lexically_normal();
  return p.filename().empty() ? p.parent_path().filename().string() : p.filename().string();
}

/// Frames in the order of play: jumps taken out. Throws InputError where there are none.
std::vector<size_t> OrderOfPlay(const PlayerOptions& options, size_t available, size_t* jumped) {
  std::vector<size_t> order;
  for (size_t i = options.start; i < available && order.size() < options.frames; ++i) {
    order.push_back(i);
    for (const Jump& jump : options.jumps) {
      if (jump.from == i && jump.to > i) {
        *jumped += jump.to - i - 1;
        i = jump.to - 1;
        break;
      }
    }
  }
  if (order.empty()) {
    throw InputError(options.sequence + ": --start " + std::to_string(options.start) +
                     " leaves no frame of " + std::to_string(available));
  }
  return order;
}

/// In lock-step frames are due when the one before is done.
double SpeedOf(const PlayerOptions& options) {
  return options.mode == PlaybackMode::kLockstep ? 0.0 : options.speed;
}

}  // namespace

PlayerNode::PlayerNode(NodeContext context, PlayerOptions options, std::unique_ptr<FrameSource> source)
    : context_(std::move(context)),
      options_(std::move(options)),
      source_(std::move(source)),
      endpoint_(context_.bus, context_.now_ns),
      office_(context_, {options_.session, options_.camera_id}, options_.take_over, &endpoint_),
      schedule_(source_.get(), OrderOfPlay(options_, source_->size(), &counts_.jumped), SpeedOf(options_)),
      readiness_(options_.mode == PlaybackMode::kRealtime ? options_.awaited : std::vector<std::string>()) {
  if (options_.behind) SkipBehind(*options_.behind);
  ground_truth_ = source_->GroundTruth();
  endpoint_.SetOtherHandler(PlayerOffice::AnswersTo(options_.camera_id),
                            [this](const std::string& channel, std::span<const uint8_t> bytes) {
                              Receive(SplitCamera(channel).channel, bytes);
                            });
}

/// Whether nobody else plays this session. The first time that is certain the sequence begins.
bool PlayerNode::MayPlay() {
  office_.Advance();
  if (office_.exit_code()) {
    exit_code_ = office_.exit_code();
    problem_ = office_.problem();
    return false;
  }
  if (office_.held() && !playing_) {
    playing_ = true;
    playing_since_ns_ = context_.now_ns();
    if (schedule_.position() > 0)
      LogInfo("player: others have {} frames already; goes on behind them", schedule_.position());
    schedule_.MakeDue(context_.now_ns() + ToNs(options_.lead_s));
  }
  return playing_ && office_.held();
}

void PlayerNode::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  end_.OnStatus(channel, bytes, options_.session, context_.now_ns());
  readiness_.OnStatus(channel, bytes, options_.session);
  if (channel == channels::kFrameDone) {
    if (const auto done = wire::Decode<FrameDone>(bytes)) OnFrameDone(*done);
  } else if (channel == channels::kSequenceDone) {
    if (const auto done = wire::Decode<SequenceDone>(bytes)) OnSequenceDone(*done);
  } else if (channel == channels::kCameraInfo) {
    if (const auto said = wire::Decode<CameraInfo>(bytes)) office_.HearCamera(*said, MakeCameraInfo());
  }
}

void PlayerNode::OnSequenceDone(const SequenceDone& done) {
  if (done.session != options_.session || !end_.OnSequenceDone(context_.now_ns())) return;
  schedule_.GoTo(schedule_.size());
  under_way_.awaiting_done = false;
}

/// What is said before a frame of ours was played is no answer to us. Once one is, the frontend says how far
/// it is to each frame and each repeat.
void PlayerNode::OnFrameDone(const FrameDone& done) {
  if (done.session != options_.session || !under_way_.bytes ||
      done.frame_index < under_way_.frame.frame_index)
    return;
  if (done.frame_index == under_way_.frame.frame_index) {
    further_.Clear();
    office_.OnFrameTaken();
    end_.OnFrameDone();
    under_way_.awaiting_done = false;
  } else if (const auto newest = further_.OnAnswer({done.frame_index, done.stamp_ns}, context_.now_ns())) {
    SkipBehind(newest->index);
  }
}

/// The frontend is further than this player, which was started again: goes on where the one before was, and
/// never back. What was published last is done in any case, also where nothing comes after it.
void PlayerNode::SkipBehind(uint32_t frame_index) {
  const size_t next = schedule_.PositionBehind(frame_index);
  if (next < schedule_.position() || (next == schedule_.position() && !under_way_.awaiting_done)) return;
  if (playing_) LogInfo("player: the frontend has frame {} already; goes on behind it", frame_index);
  schedule_.GoTo(next);
  counts_.published = static_cast<int64_t>(next);
  under_way_.awaiting_done = false;
  schedule_.MakeDue(playing_ ? context_.now_ns() : 0);
}

CameraInfo PlayerNode::MakeCameraInfo() const {
  CameraInfo info;
  info.utime = context_.wall_us();
  info.session = options_.session;
  info.camera = options_.camera;
  info.sequence = SequenceName(options_.sequence);
  info.num_frames = static_cast<int64_t>(schedule_.size());
  info.first_frame = source_->FrameIndex(schedule_.first());
  info.mode = options_.mode;
  info.speed = options_.speed;
  return info;
}

/// Frames that nobody can track yet are not played: the first one waits, and is due when it need not any
/// more.
bool PlayerNode::OthersAreReady(int64_t now_ns) {
  const bool was_held = held_back_;
  const std::string missing = readiness_.Missing(options_.camera_id);
  if (const auto notice = wait_notice_.Due(missing, now_ns)) LogInfo("player: {}", *notice);
  if (!missing.empty() && now_ns - playing_since_ns_ >= Readiness::kAtMostNs) {
    LogWarning("player: plays without {}, not ready after {} s: the first frames may be skipped", missing,
               Readiness::kAtMostNs / 1'000'000'000);
    readiness_.GiveUp();
  }
  held_back_ = !readiness_.AllReady();
  if (was_held && !held_back_) schedule_.MakeDueNoEarlier(now_ns);
  return !held_back_;
}

bool PlayerNode::IsBlack(size_t index) const {
  const double seconds = static_cast<double>(source_->StampNs(index)) * 1e-9;
  return std::any_of(options_.black_outs.begin(), options_.black_outs.end(), [&](const BlackOut& b) {
    const size_t from = std::min(b.from, source_->size() - 1);
    const double begin = static_cast<double>(source_->StampNs(from)) * 1e-9;
    return index >= from && seconds < begin + b.seconds;
  });
}

bool PlayerNode::MakeFrame(size_t index) {
  Frame& frame = under_way_.frame;
  frame = Frame();
  frame.camera_id = options_.camera_id;
  frame.session = options_.session;
  frame.frame_index = source_->FrameIndex(index);
  frame.stamp_ns = source_->StampNs(index);
  frame.capture_us = context_.wall_us();
  try {
    if (IsBlack(index)) {
      ++counts_.black;
      frame.data = EncodePng(GrayImage(options_.camera.width_px, options_.camera.height_px));
      frame.encoding = FrameEncoding::kPng;
    } else {
      EncodedImage image = source_->Read(index);
      if (image.encoding == ImageEncoding::kFile) image.encoding = DetectEncoding(image.bytes);
      EncodeFrame(image, source_->Name(index), options_.encoding, source_->AsPublished(), &frame);
    }
  } catch (const InputError& error) {
    if (counts_.unreadable++ == 0) {
      counts_.first_unreadable = error.what();
      LogWarning("{} (left out; further ones are only counted)", error.what());
    }
    if (counts_.unreadable == schedule_.size())
      problem_ = counts_.first_unreadable + "; no frame could be read";
    return false;
  }
  return true;
}

void PlayerNode::PublishFrame() {
  const size_t index = schedule_.Take(context_.now_ns());
  if (!MakeFrame(index)) {
    if (!problem_.empty()) exit_code_ = kExitInput;
    return;
  }
  under_way_.frame.publish_us = context_.wall_us();
  under_way_.bytes = std::make_shared<const Bytes>(wire::Encode(under_way_.frame));
  context_.bus->Publish(
      {ChannelOfCamera(channels::kFrame, options_.camera_id), under_way_.bytes, options_.local_frames});
  ++counts_.published;
  PublishGroundTruth(index);
  under_way_.awaiting_done = options_.mode == PlaybackMode::kLockstep;
  under_way_.RepeatLater(context_.now_ns());
}

void PlayerNode::PublishGroundTruth(size_t index) {
  const int64_t stamp_ns = source_->StampNs(index);
  const auto at =
      std::lower_bound(ground_truth_.begin(), ground_truth_.end(), stamp_ns,
                       [](const StampedPose& pose, int64_t stamp) { return pose.stamp_ns < stamp; });
  if (at == ground_truth_.end() || at->stamp_ns - stamp_ns > 10'000'000) return;
  PublishLoose(context_.bus,
               GroundTruthPose{options_.session, source_->FrameIndex(index), at->stamp_ns, at->T_world_cam},
               false, options_.camera_id);
}

void PlayerNode::PublishEnd() {
  EndOfSequence end;
  end.utime = context_.wall_us();
  end.session = options_.session;
  end.frames_published = counts_.published;
  end.frames_listed = static_cast<int64_t>(source_->size() + source_->missing());
  end.frames_missing = static_cast<int64_t>(source_->missing() + counts_.unreadable);
  end.frames_blacked = static_cast<int64_t>(counts_.black);
  end.frames_jumped = static_cast<int64_t>(counts_.jumped);
  end.last_frame_index = static_cast<int32_t>(source_->FrameIndex(schedule_.last()));
  end.last_stamp_ns = source_->StampNs(schedule_.last());
  PublishLoose(context_.bus, end, false, options_.camera_id);
}

void PlayerNode::PublishStatus(PlayerStatus::State state) {
  PlayerStatus status;
  status.head.utime = context_.wall_us();
  status.head.session = options_.session;
  status.head.health = office_.Health();
  status.head.health.waiting_for =
      under_way_.awaiting_done ? roles::kFrontend : readiness_.Missing(options_.camera_id);
  status.state = under_way_.awaiting_done || held_back_ ? PlayerStatus::State::kWaiting : state;
  status.frames_published = counts_.published;
  status.frames_total = static_cast<int64_t>(schedule_.size());
  status.frames_missing = static_cast<int64_t>(source_->missing() + counts_.unreadable);
  status.repeats = counts_.repeats;
  if (counts_.published > 0) status.frame_index = static_cast<int32_t>(under_way_.frame.frame_index);
  status.late_ms = schedule_.late_ms();
  PublishLoose(context_.bus, status, false, options_.camera_id);
}

void PlayerNode::Advance() {
  const int64_t now = context_.now_ns();
  if (exit_code_ || !MayPlay()) return;
  if (now >= next_info_ns_) {
    next_info_ns_ = now + InfoAgainNs(infos_said_++);
    PublishLoose(context_.bus, MakeCameraInfo(), false, options_.camera_id);
  }
  if (now >= next_status_ns_) {
    next_status_ns_ = now + kStatusEveryNs;
    PublishStatus(schedule_.IsOver() ? PlayerStatus::State::kDone : PlayerStatus::State::kPlaying);
  }
  if (OthersAreReady(now) && !under_way_.awaiting_done && schedule_.IsDue(now)) PublishFrame();
  if (under_way_.IsRepeatDue(now)) {
    under_way_.RepeatLater(now);
    ++counts_.repeats;
    context_.bus->Publish(
        {ChannelOfCamera(channels::kFrame, options_.camera_id), under_way_.bytes, options_.local_frames});
  }
  if (!schedule_.IsOver() || under_way_.awaiting_done) return;
  if (end_.IsDue(now)) PublishEnd();
  if (const std::optional<int> code = end_.ExitCode(now, false)) exit_code_ = code;
  if (exit_code_ == kExitNoFrontend) problem_ = EndOfPlay::NobodyAnswered();
}

int64_t PlayerNode::deadline_ns() const {
  if (!playing_ || !office_.held()) return std::min(endpoint_.deadline_ns(), office_.deadline_ns());
  int64_t deadline = std::min({next_info_ns_, next_status_ns_, endpoint_.deadline_ns()});
  if (under_way_.awaiting_done) return std::min(deadline, under_way_.next_repeat_ns);
  if (held_back_) return deadline;  // statuses come, and infos go, twice a second
  if (!schedule_.IsOver()) return std::min(deadline, schedule_.due_ns());
  return std::min(deadline, end_.due_ns());
}

}  // namespace dmslam
