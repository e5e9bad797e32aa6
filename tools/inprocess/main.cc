#include <signal.h>
#include <unistd.h>

#include <filesystem>

#include "dmslam/console/command_line.h"
#include "dmslam/console/log.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/recording/recorded_frames.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/runtime/session_check.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "in_process.h"
#include "player/open_sequence.h"

namespace {

struct Arguments {
  std::string sequence, log, records, record, out, camera, config, vocabulary, profile, encoding = "jpeg";
  double fps = 0;
  uint32_t log_session = 0;
  std::vector<std::string> overrides, black_outs, jumps, others, other_cameras;
  size_t start = 0, frames = SIZE_MAX;
  uint64_t seed = 1;
  int pictures = 0;
  dmslam::MapperFiles map_files;
  uint32_t session = 0;
  bool no_loop = false, localize = false;
};

void Declare(dmslam::CommandLine& app, Arguments& a) {
  app.SetVersion(dmslam::BuildVersion());
  app.AddOption("--sequence,--video", a.sequence,
                "TUM RGB-D folder, EuRoC folder, numbered images, or a video");
  app.AddOption("--also", a.others,
                "sequence of another camera that goes at the same time by its stamps; may be repeated");
  app.AddOption("--also-camera", a.other_cameras,
                "camera file of an --also, one for each, where they are not of the model of --camera");
  app.AddOption("--fps", a.fps,
                "frames per second of numbered images and of videos that do not state it; default: as the "
                "camera file says")
      .InRange(0.01, 1000.0);
  app.AddOption("--encoding", a.encoding, "of frames that are neither JPEG nor PNG: jpeg, png, raw")
      .OneOf({"jpeg", "png", "raw"});
  app.AddOption("--log", a.log,
                "log of lcm-logger: its frames are played; without --also those of all its cameras");
  app.AddOption("--records", a.records,
                "such a log: its keyframes are entered, without images and without a frontend");
  app.AddOption("--log-session", a.log_session, "which of the log's sessions, where it holds several");
  app.AddOption("--record", a.record, "write all that is said into this log");
  app.AddOption("--out", a.out, "folder for the results").Required();
  app.AddOption("--camera", a.camera,
                "camera file (YAML); found by itself for rendered sequences, EuRoC and TUM freiburg1/2/3, "
                "and in a --log");
  app.AddOption("--config", a.config, "settings (YAML)");
  app.AddOption("--set", a.overrides, "one setting: key=value; may be repeated");
  app.AddOption("--profile", a.profile, "dm, baseline or paper").OneOf({"dm", "baseline", "paper"});
  app.AddOption("--seed", a.seed, "seed of everything random").ShowDefault();
  app.AddOption("--start", a.start, "first frame");
  app.AddOption("--frames", a.frames, "at most so many frames");
  app.AddOption("--black-out", a.black_outs,
                "FROM,SECONDS: black frames from frame FROM on; may be repeated");
  app.AddOption("--jump", a.jumps, "FROM,TO: after frame FROM goes on with frame TO; may be repeated");
  app.AddOption("--pictures", a.pictures, "draw every Nth frame");
  app.AddOption("--vocabulary", a.vocabulary, "bag-of-words vocabulary; default: the one that ships");
  app.AddOption("--map", a.map_files.load, "saved map or log: begin in this map");
  app.AddFlag("--localize", a.localize, "with --map: find the camera in the map, and leave the map as it is");
  app.AddOption("--save-map", a.map_files.save, "write the map into this file at the end");
  app.AddOption("--session", a.session, "of this run; default: 1, with --map one more than the map's");
  app.AddFlag("--no-loop", a.no_loop, "do not close loops");
}

using Log = std::shared_ptr<const dmslam::LogIndex>;

/// The log whose frames are played; null: there is none.
Log OpenLog(const Arguments& a) {
  if (a.log.empty()) return nullptr;
  auto log = std::make_shared<const dmslam::LogIndex>(a.log);
  if (!log->DescribeDamage().empty()) dmslam::LogWarning("{}", log->DescribeDamage());
  return log;
}

std::unique_ptr<dmslam::FrameSource> FramesOf(const Arguments& a, const Log& log, dmslam::CameraId camera,
                                              dmslam::PlayerOptions* player) {
  auto frames = std::make_unique<dmslam::RecordedFrames>(log, a.log_session, camera);
  player->sequence = frames->camera_info().sequence;
  player->camera = a.camera.empty() ? frames->camera_info().camera : dmslam::LoadCamera(a.camera);
  return frames;
}

std::unique_ptr<dmslam::FrameSource> Open(const Arguments& a, const Log& log, dmslam::PlayerOptions* player) {
  if (!a.records.empty()) return nullptr;
  if (a.sequence.empty() == a.log.empty())
    throw dmslam::InputError("give one of --sequence, --log and --records");
  if (log) return FramesOf(a, log, 0, player);
  player->sequence = a.sequence;
  return dmslam::OpenSequence(a.camera, a.fps, player);
}

/// Of a log all that it has but the first one.
std::vector<dmslam::AnotherCamera> OthersOf(const Arguments& a, const Log& log,
                                            const dmslam::PlayerOptions& player,
                                            std::vector<std::string>* ground_truth) {
  std::vector<dmslam::AnotherCamera> others;
  const std::vector<dmslam::CameraId> cameras = log->Session(a.log_session).CamerasWithFrames();
  for (size_t i = 1; i < cameras.size(); ++i) {
    dmslam::AnotherCamera& other = others.emplace_back();
    other.player = player;
    other.source = FramesOf(a, log, cameras[i], &other.player);
    ground_truth->emplace_back();
  }
  return others;
}

std::vector<dmslam::AnotherCamera> OpenOthers(const Arguments& a, dmslam::PlayerOptions player,
                                              std::vector<std::string>* ground_truth) {
  const std::string problem = dmslam::WhyNotTheseCameras(a.camera, a.others.size(), a.other_cameras.size());
  if (!problem.empty()) throw dmslam::InputError(problem);
  std::vector<dmslam::AnotherCamera> others;
  for (size_t i = 0; i < a.others.size(); ++i) {
    player.sequence = a.others[i];
    dmslam::AnotherCamera& other = others.emplace_back();
    other.player = player;
    const bool own = !a.other_cameras.empty();
    other.source = dmslam::OpenSequence(own ? a.other_cameras[i] : a.camera, a.fps, &other.player);
    if (own)
      other.source = dmslam::TellBy(dmslam::LoadCamera(a.camera), std::move(other.source), &other.player);
    ground_truth->push_back(other.source->GroundTruthPath().value_or(""));
  }
  return others;
}

/// SIGINT and SIGTERM wait until they are asked for: between two steps, so that results are complete.
void BlockStopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

/// The one that has come; 0: none.
int StopSignal() {
  sigset_t pending;
  sigpending(&pending);
  for (const int signal : {SIGINT, SIGTERM}) {
    if (sigismember(&pending, signal) == 1) return signal;
  }
  return 0;
}

/// How the frames, or the recorded keyframes, are told: camera and vocabulary. None: the log does not say.
std::optional<dmslam::SessionStart> WhoPlays(const Arguments& a, const dmslam::InProcessOptions& options) {
  if (!a.records.empty()) {
    const dmslam::LogIndex log(a.records);
    return dmslam::FindSessionStart(log, log.Session(a.log_session));
  }
  dmslam::SessionStart start;
  start.camera = options.player.camera;
  start.vocabulary_checksum = options.vocabulary->checksum();
  return start;
}

/// Throws where the map to begin in does not go with what is played. Chooses the session where none is given.
void CheckMap(const Arguments& a, dmslam::InProcessOptions* options) {
  const std::string& path = a.map_files.load;
  uint32_t* session = &options->player.session;
  if (path.empty()) {
    if (*session == 0) *session = 1;
    return;
  }
  const dmslam::RebuiltMap map = dmslam::LoadMap(path);
  if (*session == 0) *session = dmslam::NewestSession(map.map) + 1;
  dmslam::CheckSessionIsNew(path, map.map, *session);
  const std::optional<dmslam::SessionStart> plays = WhoPlays(a, *options);
  if (!plays) return;
  dmslam::CheckFits(path, map.session, plays->camera, options->node.settings.Read<dmslam::Pyramid>());
  dmslam::CheckVocabulary(path, map.session, plays->vocabulary_checksum);
}

int Run(const Arguments& a) {
  dmslam::InProcessOptions options;
  std::vector<std::string> overrides;
  if (!a.profile.empty()) overrides.push_back("profile=" + a.profile);
  overrides.push_back("seed=" + std::to_string(a.seed));
  if (!a.map_files.load.empty()) overrides.push_back("map.saved=on");
  if (a.localize) overrides.push_back("map.localize_only=on");
  if (a.no_loop) overrides.push_back("loop.enabled=off");
  overrides.insert(overrides.end(), a.overrides.begin(), a.overrides.end());
  options.node.settings = dmslam::LoadSettings(a.config, overrides);
  const Log log = OpenLog(a);
  auto source = Open(a, log, &options.player);
  options.record = a.record;
  options.map_files = a.map_files;
  options.player.session = a.session;
  options.player.encoding.encoding = dmslam::ParseFrameEncoding(a.encoding);
  options.player.start = a.start;
  options.player.frames = a.frames;
  for (const std::string& text : a.black_outs)
    options.player.black_outs.push_back(dmslam::ParseBlackOut(text));
  for (const std::string& text : a.jumps) options.player.jumps.push_back(dmslam::ParseJump(text));
  options.collector.out_dir = a.out;
  options.collector.ground_truth = {source ? source->GroundTruthPath().value_or("") : ""};
  if (!source && !a.others.empty())
    throw dmslam::InputError("--also goes with --sequence, not with --records");
  const bool all_of_log = log && a.others.empty();
  auto others = all_of_log ? OthersOf(a, log, options.player, &options.collector.ground_truth)
                           : OpenOthers(a, options.player, &options.collector.ground_truth);
  options.vocabulary = dmslam::LoadVocabulary(a.vocabulary);
  CheckMap(a, &options);
  options.picture_every = a.pictures;
  options.picture_dir = a.out + "/pictures";
  std::filesystem::create_directories(a.pictures > 0 ? options.picture_dir : a.out);
  for (const std::string& file : {a.map_files.save, a.record}) {
    if (!file.empty()) dmslam::CheckFolderOf(file);
  }
  BlockStopSignals();
  options.stop = [] { return StopSignal() != 0; };
  std::string problem;
  const int code =
      source ? dmslam::RunInProcess(std::move(options), std::move(source), &problem, std::move(others))
             : dmslam::RunRecordsInProcess(std::move(options),
                                           std::make_shared<const dmslam::LogIndex>(a.records), a.log_session,
                                           &problem);
  if (!problem.empty()) dmslam::LogError("{}", problem);
  return code == 0 && StopSignal() != 0 ? 128 + StopSignal() : code;
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::CommandLine app("Runs frontend, mapper, loop closer and player in one process, in lock-step.",
                          "dmslam-inprocess");
  Arguments arguments;
  Declare(app, arguments);
  if (const auto code = app.Parse(argc, argv)) return *code;
  dmslam::SetUpLog("dmslam-inprocess");
  try {
    return Run(arguments);
  } catch (const dmslam::MisfitError& error) {
    dmslam::LogError("{}", error.what());
    return dmslam::kExitMisfit;
  } catch (const dmslam::InputError& error) {
    dmslam::LogError("{}", error.what());
    return dmslam::kExitInput;
  }
}
