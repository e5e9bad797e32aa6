#include <filesystem>

#include "common/process_main.h"
#include "dmslam/util/check.h"
#include "player/player_node.h"

namespace {

/// What --black-out and --jump say: two numbers with a comma.
std::pair<double, double> ParsePair(const std::string& option, const std::string& text) {
  const size_t comma = text.find(',');
  try {
    if (comma == std::string::npos) throw std::invalid_argument(text);
    return {std::stod(text.substr(0, comma)), std::stod(text.substr(comma + 1))};
  } catch (const std::exception&) {
    throw dmslam::InputError(option + " " + text + ": write two numbers with a comma between them");
  }
}

dmslam::Camera ChooseCamera(const std::string& camera_file, const std::string& sequence) {
  if (!camera_file.empty()) return dmslam::LoadCamera(camera_file);
  const auto found = dmslam::FindCamera(sequence, dmslam::FindDataFolder("config"));
  if (found) return *found;
  throw dmslam::InputError(sequence + ": which camera took this is not known; name its file with --camera");
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::ProcessMain process("player", "Feeds the frames of a recording to the bus.");
  dmslam::PlayerOptions options;
  std::string camera_file, encoding = "jpeg";
  bool lockstep = false;
  std::vector<std::string> black_outs, jumps;
  CLI::App& app = process.app();
  app.add_option("--sequence", options.sequence, "TUM RGB-D folder, EuRoC folder, numbered images, or a video")->required();
  app.add_option("--camera", camera_file, "camera file (YAML); found by itself for TUM freiburg1/2/3");
  app.add_flag("--lockstep", lockstep, "wait for the frontend after each frame");
  app.add_option("--speed", options.speed, "factor on the recorded rate; 0: as fast as possible")->capture_default_str();
  app.add_option("--start", options.start, "first frame");
  app.add_option("--frames", options.frames, "at most so many frames");
  app.add_option("--encoding", encoding, "of re-encoded frames: jpeg, png, raw")->check(CLI::IsMember({"jpeg", "png", "raw"}));
  app.add_option("--jpeg-quality", options.jpeg_quality)->check(CLI::Range(1, 100))->capture_default_str();
  app.add_flag("--reencode", options.reencode, "encode frames anew even where files hold JPEG or PNG");
  app.add_option("--lead", options.lead_s, "seconds before the first frame")->capture_default_str();
  app.add_option("--black-out", black_outs, "FROM,SECONDS: black frames from frame FROM on; may be repeated");
  app.add_option("--jump", jumps, "FROM,TO: after frame FROM goes on with frame TO; may be repeated");
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions node) {
    options.mode = lockstep ? dmslam::PlaybackMode::kLockstep : dmslam::PlaybackMode::kRealtime;
    options.session = node.session == 0 ? 1 : node.session;
    options.encoding = encoding == "png"   ? dmslam::FrameEncoding::kPng
                       : encoding == "raw" ? dmslam::FrameEncoding::kGray8
                                           : dmslam::FrameEncoding::kJpeg;
    for (const std::string& text : black_outs) {
      const auto [from, seconds] = ParsePair("--black-out", text);
      options.black_outs.push_back({static_cast<size_t>(from), seconds});
    }
    for (const std::string& text : jumps) {
      const auto [from, to] = ParsePair("--jump", text);
      options.jumps.push_back({static_cast<size_t>(from), static_cast<size_t>(to)});
    }
    auto source = dmslam::OpenFrameSource(options.sequence);
    options.camera = ChooseCamera(camera_file, options.sequence);
    return std::make_unique<dmslam::PlayerNode>(std::move(context), options, std::move(source));
  });
}
