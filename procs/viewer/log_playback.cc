#include "viewer/log_playback.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "dmslam/console/log.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/recording/log_version.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/former_types.h"

namespace dmslam {
namespace {

constexpr int64_t kStepNs = 25'000'000;
constexpr int64_t kHasteUs = 3'000'000;  // from so far on nobody wants to see what lies between

}  // namespace

void LogBus::Deliver(const LogEvent& event) {
  const std::string channel = WithoutPrefix(event.channel);
  if (handler_ && channels_.contains(channel)) handler_(channel, event.bytes);
}

LogPlayback::LogPlayback(const std::string& path, NodeOptions options, ViewerOptions viewer,
                         Exchange* exchange)
    : path_(path), options_(std::move(options)), viewer_(std::move(viewer)), exchange_(exchange) {
  EventLogReader reader(path);
  options_.of_a_log = true;
  if (options_.key && !reader.UseKey(*options_.key)) LogWarning("{}: {}", path, kNothingIsVerified);
  int64_t events = 0;
  while (const std::optional<LogEvent> event = reader.Next()) {
    if (WithoutPrefix(event->channel).empty()) continue;
    if (const auto protocol = OtherProtocol(*event))
      throw InputError(path + ": " + wire::ToldOfFormer(*protocol));
    AddCamera(SplitCamera(WithoutPrefix(event->channel)).camera);
    if (events++ == 0) begin_us_ = end_us_ = event->utime_us;
    end_us_ = std::max(end_us_, event->utime_us);
  }
  if (events == 0)
    throw InputError(path + ": holds no message of this project; record a run with scripts/run.sh --record");
  if (const std::string gaps = reader.DescribeGaps(); !gaps.empty()) LogWarning("{}", gaps);
  LogInfo("{}: {} messages, {:.1f} s", path, events, duration_s());
  BeginAnew();
}

/// It is in the log: the node listens to it, too.
void LogPlayback::AddCamera(CameraId camera) {
  const std::string frontend = OfCamera(roles::kFrontend, std::min(camera, kMaxCameras - 1));
  if (camera > 0 && !options_.HasPeer(frontend)) options_.peers.push_back(frontend);
}

void LogPlayback::BeginAnew() {
  node_.reset();
  bus_ = std::make_unique<LogBus>();
  reader_ = std::make_unique<EventLogReader>(path_);
  if (options_.key) reader_->UseKey(*options_.key);
  next_ = reader_->Next();
  at_us_ = begin_us_;
  NodeContext context;
  context.bus = bus_.get();
  context.now_ns = [this] { return at_us_ * 1000; };
  context.wall_us = [this] { return at_us_; };
  context.random_id = 1;
  context.name = "viewer of " + path_;
  node_ = std::make_unique<ViewerNode>(std::move(context), options_, viewer_, exchange_);
  exchange_->Change([](ViewerScene* scene, CameraSeries* series) {
    scene->Clear();
    series->Clear();
  });
}

void LogPlayback::PlayTo(int64_t utime_us, bool in_haste) {
  node_->SetInHaste(in_haste);
  while (next_ && next_->utime_us <= utime_us) {
    at_us_ = std::max(at_us_, next_->utime_us);
    bus_->Deliver(*next_);
    node_->Advance();
    next_ = reader_->Next();
  }
  at_us_ = std::clamp(utime_us, begin_us_, end_us_);
  node_->SetInHaste(false);
  if (!next_) node_->ShowAtOnce();  // what the last messages said would not come by itself any more
  node_->Advance();
}

void LogPlayback::Fulfil(const PlaybackWish& wish, int64_t now_ns) {
  if (wish.speed) speed_ = std::clamp(*wish.speed, 0.01, 100.0);
  if (wish.playing) playing_ = *wish.playing;
  if (wish.playing.value_or(false) && at_us_ >= end_us_ && !wish.position_s) BeginAnew();
  if (wish.position_s) {
    const int64_t to_us =
        begin_us_ + static_cast<int64_t>(1e6 * std::clamp(*wish.position_s, 0.0, duration_s()));
    const bool back = to_us < at_us_;
    if (back) BeginAnew();
    PlayTo(to_us, back || to_us - at_us_ > kHasteUs);
  }
  anchor_us_ = at_us_;
  next_ns_ = now_ns;
  anchor_ns_ = now_ns;
  Say();
}

void LogPlayback::Advance(int64_t now_ns) {
  if (!playing_ || now_ns < next_ns_) return;
  if (!anchor_ns_) {
    anchor_ns_ = now_ns;
    anchor_us_ = at_us_;
  }
  next_ns_ = now_ns + kStepNs;
  const int64_t to_us =
      anchor_us_ + static_cast<int64_t>(static_cast<double>(now_ns - *anchor_ns_) * 1e-3 * speed_);
  PlayTo(to_us, to_us - at_us_ > kHasteUs);
  if (to_us >= end_us_) playing_ = false;
  Say();
}

void LogPlayback::Say() const {
  const nlohmann::json json{{"position", position_s()},
                            {"duration", duration_s()},
                            {"playing", playing_},
                            {"speed", speed_},
                            {"name", std::filesystem::path(path_).filename().string()}};
  exchange_->hub().Send(EventKind::kPlayback, json.dump());
}

}  // namespace dmslam
