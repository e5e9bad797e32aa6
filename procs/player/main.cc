
#include <algorithm>
#include <charconv>

#include "dmslam/console/command_line.h"
#include "dmslam/console/log.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/recording/recorded_frames.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"
#include "player/asking_player.h"
#include "player/live_node.h"
#include "player/log_output.h"
#include "player/open_sequence.h"
#include "player/player_node.h"
#include "player/records_node.h"

namespace {

/// What the command line says.
struct Arguments {
  dmslam::PlayerOptions options;
  std::string camera_file, as_camera_file, encoding = "jpeg", channels = "camera", log, to_log;
  double fps = 0;
  uint32_t log_session = 0;
  bool lockstep = false, remote_frontend = false;
  std::string behind;
  std::vector<std::string> black_outs, jumps;
};

std::unique_ptr<dmslam::FrameSource> OpenLog(const Arguments& a, const dmslam::NodeOptions& node,
                                             dmslam::PlayerOptions* options) {
  auto log = std::make_shared<const dmslam::LogIndex>(a.log, node.key);
  if (!log->DescribeDamage().empty()) dmslam::LogWarning("{}", log->DescribeDamage());
  auto frames = std::make_unique<dmslam::RecordedFrames>(log, a.log_session, node.camera_id);
  options->sequence = frames->camera_info().sequence;
  options->camera = a.camera_file.empty() ? frames->camera_info().camera : dmslam::LoadCamera(a.camera_file);
  return frames;
}

uint32_t ParseFrame(const std::string& option, const std::string& text) {
  uint32_t frame = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), frame);
  if (error != std::errc() || end != text.data() + text.size())
    throw dmslam::InputError(option + " " + text + ": write the number of a frame");
  return frame;
}

/// How it is to be played, of all but the camera.
void SetOptions(const Arguments& a, const dmslam::NodeOptions& node, dmslam::PlayerOptions* options) {
  *options = a.options;
  options->mode = a.lockstep ? dmslam::PlaybackMode::kLockstep : dmslam::PlaybackMode::kRealtime;
  options->session = node.session == 0 ? 1 : node.session;  // a log's; AskingPlayer knows it of others
  options->camera_id = node.camera_id;
  options->take_over = node.take_over;
  options->local_frames = node.link == dmslam::Link::kLan && !a.remote_frontend;
  if (!a.behind.empty()) options->behind = ParseFrame("--behind", a.behind);
  options->encoding.encoding = dmslam::ParseFrameEncoding(a.encoding);
  for (const std::string& text : a.black_outs) options->black_outs.push_back(dmslam::ParseBlackOut(text));
  for (const std::string& text : a.jumps) options->jumps.push_back(dmslam::ParseJump(text));
  if (options->sequence.empty() == a.log.empty()) {
    throw dmslam::InputError("give either --sequence or --log: what shall be played?");
  }
}

/// The recording, and in `options` how it is to be played.
std::unique_ptr<dmslam::FrameSource> Open(const Arguments& a, const dmslam::NodeOptions& node,
                                          dmslam::PlayerOptions* options) {
  SetOptions(a, node, options);
  auto source =
      a.log.empty() ? dmslam::OpenSequence(a.camera_file, a.fps, options) : OpenLog(a, node, options);
  if (a.as_camera_file.empty()) return source;
  return dmslam::TellBy(dmslam::LoadCamera(a.as_camera_file), std::move(source), options);
}

/// Who was not told its session asks the bus for it. `Player`: PlayerNode or LiveNode.
template <typename Player, typename Source>
std::unique_ptr<dmslam::Node> MakePlayer(dmslam::NodeContext context, const dmslam::NodeOptions& node,
                                         dmslam::PlayerOptions options, std::unique_ptr<Source> source) {
  if (node.session != 0) return std::make_unique<Player>(std::move(context), options, std::move(source));
  const auto held = std::make_shared<std::unique_ptr<Source>>(std::move(source));
  const auto make = [context, options, held](uint32_t session) mutable {
    options.session = session;
    return std::make_unique<Player>(std::move(context), std::move(options), std::move(*held));
  };
  return std::make_unique<dmslam::AskingPlayer>(context, node.camera_id, node.NumCameras(), make);
}

std::unique_ptr<dmslam::Node> WatchCamera(const Arguments& a, dmslam::NodeContext context,
                                          const dmslam::NodeOptions& node) {
  dmslam::PlayerOptions options;
  SetOptions(a, node, &options);
  if (a.lockstep) {
    throw dmslam::InputError(options.sequence + ": a camera waits for nobody; leave --lockstep out");
  }
  if (!a.as_camera_file.empty())
    throw dmslam::InputError("--as-camera is for recordings; " + options.sequence + " is a camera");
  options.camera = dmslam::ChooseCamera(a.camera_file, options.sequence);
  if (a.fps > 0) options.camera.fps = a.fps;
  auto source = dmslam::OpenLive(options.sequence, options.camera);
  return MakePlayer<dmslam::LiveNode>(std::move(context), node, std::move(options), std::move(source));
}

/// Writes what the player would publish into a log, under the recording's own clock.
int WriteLog(const Arguments& a, const dmslam::NodeOptions& node_options, const std::string& prefix) {
  dmslam::PlayerOptions options;
  auto source = Open(a, node_options, &options);
  options.mode = dmslam::PlaybackMode::kRealtime;
  options.speed = 1.0;
  const int64_t lead_ns = dmslam::ToNs(options.lead_s);
  const int64_t first_ns = source->size() > options.start ? source->StampNs(options.start) : 0;
  dmslam::LogOutput output(a.to_log, prefix, std::max<int64_t>(0, first_ns - lead_ns));
  dmslam::NodeContext context;
  context.bus = &output;
  context.now_ns = [&output] { return output.now_ns(); };
  context.wall_us = [&output] { return output.now_ns() / 1000; };
  context.fresh_system = true;
  dmslam::PlayerNode node(std::move(context), options, std::move(source));
  while (!node.exit_code() && !output.ended()) {
    node.Advance();
    output.AdvanceTo(std::max(output.now_ns(), node.deadline_ns()));
  }
  output.Close();
  if (!node.problem().empty()) throw dmslam::InputError(node.problem());
  dmslam::LogInfo("{} frames written to {}", node.published(), a.to_log);
  return 0;
}

std::unique_ptr<dmslam::Node> EnterRecords(const Arguments& a, dmslam::NodeContext context,
                                           const dmslam::NodeOptions& node) {
  if (a.log.empty()) throw dmslam::InputError("--channels records needs a log: give it with --log");
  auto log = std::make_shared<const dmslam::LogIndex>(a.log, node.key);
  if (!log->DescribeDamage().empty()) dmslam::LogWarning("{}", log->DescribeDamage());
  return std::make_unique<dmslam::RecordsNode>(std::move(context), node, log, a.log_session);
}

/// Who listens and asks before it begins, among those who take part.
std::vector<std::string> ToBeReady(const dmslam::NodeOptions& node) {
  std::vector<std::string> awaited;
  for (const char* role : {dmslam::roles::kMapper, dmslam::roles::kFrontend}) {
    if (node.HasPeer(role)) awaited.emplace_back(role);
  }
  return awaited;
}

void Declare(dmslam::CommandLine& app, Arguments& a) {
  app.AddOption("--sequence,--video", a.options.sequence,
                "TUM RGB-D folder, EuRoC folder, numbered images, a video, or a camera: /dev/videoN or the "
                "address of a stream");
  app.AddOption("--fps", a.fps,
                "frames per second of numbered images and of videos that do not state it; asked of a "
                "camera; default: as the camera file says")
      .InRange(0.01, 1000.0);
  app.AddOption(
      "--log", a.log,
      "log of lcm-logger: its frames are played, with their indices, stamps and bytes; of several cameras "
      "those of --camera-id");
  app.AddOption("--log-session", a.log_session, "which of the log's sessions, where it holds several");
  app.AddOption("--channels", a.channels,
                "of a log: camera, or records: the frontend's keyframes are entered as a writer of a new "
                "session, without a frontend and without images")
      .OneOf({"camera", "records"});
  app.AddOption("--to-log", a.to_log, "write camera and frames into this log instead of publishing them");
  app.AddOption("--camera", a.camera_file,
                "camera file (YAML); found by itself for rendered sequences, EuRoC and TUM freiburg1/2/3, "
                "and in a --log");
  app.AddOption("--as-camera", a.as_camera_file,
                "another camera file: frames are published as that camera would have taken them, for a map "
                "that is of its model");
  app.AddFlag("--lockstep", a.lockstep, "wait for the frontend after each frame");
  app.AddOption("--speed", a.options.speed, "factor on the recorded rate; 0: as fast as possible")
      .NonNegative()
      .ShowDefault();
  app.AddOption("--start", a.options.start, "first frame");
  app.AddOption("--frames", a.options.frames, "at most so many frames");
  app.AddOption(
      "--behind", a.behind,
      "frames up to the one of this number were played before all processes died: they count, and are "
      "not played again");
  app.AddOption("--encoding", a.encoding, "of re-encoded frames: jpeg, png, raw")
      .OneOf({"jpeg", "png", "raw"});
  app.AddOption("--jpeg-quality", a.options.encoding.jpeg_quality).InRange(1, 100).ShowDefault();
  app.AddFlag("--reencode", a.options.encoding.reencode,
              "encode frames anew even where files hold JPEG or PNG");
  app.AddFlag("--remote-frontend", a.remote_frontend,
              "with --link lan: the frontend runs on another host, so frames leave this one");
  app.AddOption("--lead", a.options.lead_s, "seconds before the first frame").ShowDefault();
  app.AddOption("--black-out", a.black_outs,
                "FROM,SECONDS: black frames from frame FROM on; may be repeated");
  app.AddOption("--jump", a.jumps, "FROM,TO: after frame FROM goes on with frame TO; may be repeated");
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::ProcessMain process(dmslam::roles::kPlayer,
                              "Feeds the frames of a recording or of a camera to the bus.");
  Arguments arguments;
  Declare(process.app(), arguments);
  process.SetOffline([&](const dmslam::NodeOptions& node) {
    return arguments.to_log.empty() ? std::nullopt
                                    : std::optional(WriteLog(arguments, node, process.prefix()));
  });
  return process.Run(
      argc, argv,
      [&](dmslam::NodeContext context, const dmslam::NodeOptions& node) -> std::unique_ptr<dmslam::Node> {
        if (arguments.channels == "records") return EnterRecords(arguments, std::move(context), node);
        if (dmslam::IsLive(arguments.options.sequence))
          return WatchCamera(arguments, std::move(context), node);
        dmslam::PlayerOptions options;
        auto source = Open(arguments, node, &options);
        if (!context.fresh_system) options.awaited = ToBeReady(node);
        return MakePlayer<dmslam::PlayerNode>(std::move(context), node, std::move(options),
                                              std::move(source));
      });
}
