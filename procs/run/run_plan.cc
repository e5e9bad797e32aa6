#include "run/run_plan.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <sstream>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/recording/checkpoint.h"
#include "dmslam/recording/frame_memory.h"
#include "dmslam/recording/log_index.h"
#include "dmslam/util/check.h"
#include "run/log_replay.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

void Append(Words* words, const Words& more) { words->insert(words->end(), more.begin(), more.end()); }
void AppendOption(Words* words, const std::string& option, const std::string& value) {
  if (!value.empty()) Append(words, {option, value});
}

uint32_t RandomBelow(uint32_t end) {
  std::random_device device;
  return std::uniform_int_distribution<uint32_t>(0, end - 1)(device);
}

bool InPath(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "/usr/bin" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    folder.append("/").append(program);
    if (access(folder.c_str(), X_OK) == 0) return true;
  }
  return false;
}

void NeedTool(const std::string& program) {
  if (!InPath(program)) throw InputError(program + " is missing; install liblcm-bin (scripts/setup.sh core)");
}

std::string Url(const RunArguments::Bus& bus, const RunPlace& place) { return BusUrl(bus, place.port); }

/// What all processes are told.
Words CommonArguments(const RunArguments& a, const RunPlace& place) {
  Words common;
  if (!a.settings.profile.empty()) Append(&common, {"--set", "profile=" + a.settings.profile});
  AppendOption(&common, "--config", a.settings.config);
  for (const std::string& set : a.settings.sets) Append(&common, {"--set", set});
  if (a.settings.no_loop) Append(&common, {"--set", "loop.enabled=off"});
  AppendOption(&common, "--prefix", a.bus.prefix);
  AppendOption(&common, "--key", a.bus.key);
  if (!a.map.begin.empty()) Append(&common, {"--set", "map.saved=on"});
  if (a.map.localize) Append(&common, {"--set", "map.localize_only=on"});
  Append(&common, {"--set", "seed=" + a.settings.seed, "--lcm-url", Url(a.bus, place), "--session",
                   std::to_string(place.session == 0 ? ChooseSession(a.map) : place.session), "--peers",
                   "frontend,mapper,loopcloser,collector"});
  if (!a.source.others.empty()) Append(&common, {"--cameras", std::to_string(a.source.others.size() + 1)});
  if (!a.source.replay.empty()) common.push_back("--accept-recorded");
  return common;
}

/// How frames are changed: also of a copy of a log that is to be replayed.
Words FrameArguments(const RunArguments& a) {
  Words words;
  AppendOption(&words, "--start", a.source.start);
  AppendOption(&words, "--frames", a.source.frames);
  for (const std::string& text : a.source.black_outs) Append(&words, {"--black-out", text});
  for (const std::string& text : a.source.jumps) Append(&words, {"--jump", text});
  AppendOption(&words, "--camera", a.camera.file);
  return words;
}

Words PlayerArguments(const RunArguments& a) {
  Words words = FrameArguments(a);
  AppendOption(&words, "--encoding", a.camera.encoding);
  if (a.camera.fps > 0) Append(&words, {"--fps", std::to_string(a.camera.fps)});
  Append(&words, {"--speed", std::to_string(a.pace.speed)});
  if (a.pace.lockstep) words.push_back("--lockstep");
  return words;
}

/// One word of a shell.
std::string Quoted(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted += "'";
}

/// lcm-logplayer plays whole logs, as they are: for anything else it gets a copy.
std::string LogToReplay(const RunArguments& a, const RunPlace& place) {
  const Words changes = FrameArguments(a);
  if (changes.empty() && PrefixOfCamera(a.source.replay) == a.bus.prefix) return a.source.replay;
  std::string copy = place.out + "/log/replayed.lcmlog";
  std::string command = Quoted(place.programs + "/dmslam-player");
  Words words = changes;
  Append(&words, {"--prefix", a.bus.prefix, "--log", a.source.replay, "--to-log", copy});
  for (const std::string& word : words) command += " " + Quoted(word);
  command += " 2>" + Quoted(place.LogOf(roles::kPlayer));
  if (std::system(command.c_str()) != 0)
    throw InputError(LastWords(roles::kPlayer, place.LogOf(roles::kPlayer)));
  return copy;
}

ChildSpec MakeChild(const std::string& program, const RunArguments& a, const RunPlace& place, Words arguments,
                    CameraId camera = 0) {
  const std::string name = OfCamera(program, camera);
  if (camera != 0) Append(&arguments, {"--camera-id", std::to_string(camera)});
  ChildSpec child;
  child.name = name;
  child.arguments = std::move(arguments);
  child.arguments.insert(child.arguments.begin(), place.programs + "/dmslam-" + program);
  child.first = {"--fresh-system"};  // only at the beginning nobody else can be writing
  if (place.resume) child.first.emplace_back("--resumed");
  child.output = child.errors = place.LogOf(name);
  child.pid_file = place.out + "/log/" + name + ".pid";
  child.restart = !a.care.no_restart;
  child.speaks = true;
  return child;
}

/// What was played before all processes died, and is in the map, is not played again; the first frame waits
/// for the map.
void GoOnBehind(const ResumePoint& point, bool camera, ChildSpec* player) {
  const std::optional<uint32_t> behind = camera ? point.last_frame : point.play_behind;
  if (behind) Append(&player->arguments, {"--behind", std::to_string(*behind)});
  Append(&player->first, {"--lead", std::to_string(point.lead_s)});
}

/// What is said of the first camera, of the i-th other one.
RunArguments OfOther(RunArguments a, size_t i) {
  if (!a.source.other_cameras.empty()) a.camera.file = a.source.other_cameras[i];
  return a;
}

/// Of those who know places by their words.
Words WithVocabulary(const RunArguments& a, Words words) {
  AppendOption(&words, "--vocabulary", a.settings.vocabulary);
  return words;
}

/// Player and frontend of each further camera.
std::vector<ChildSpec> MakeOtherCameras(const RunArguments& a, const RunPlace& place, const Words& common) {
  if (place.resume && !a.source.others.empty())
    throw InputError("a run of several cameras cannot be resumed; begin it anew");
  std::vector<ChildSpec> children;
  for (size_t i = 0; i < a.source.others.size(); ++i) {
    const CameraId camera = static_cast<CameraId>(i + 1);
    children.push_back(MakeChild(roles::kFrontend, a, place, WithVocabulary(a, common), camera));
    Words words = common;
    Append(&words, PlayerArguments(OfOther(a, i)));
    if (!a.source.other_cameras.empty()) Append(&words, {"--as-camera", a.camera.file});
    Append(&words, {"--sequence", a.source.others[i]});
    children.push_back(MakeChild(roles::kPlayer, a, place, std::move(words), camera));
  }
  return children;
}

ChildSpec MakePlayer(const RunArguments& a, const RunPlace& place, Words words) {
  Append(&words, PlayerArguments(a));
  Append(&words,
         a.source.log.empty() ? Words{"--sequence", a.source.sequence} : Words{"--log", a.source.log});
  ChildSpec player = MakeChild(roles::kPlayer, a, place, std::move(words));
  if (place.resume) GoOnBehind(*place.resume, IsCamera(a.source.sequence), &player);
  return player;
}

/// A child that runs a program of somebody else's.
ChildSpec MakeForeign(const std::string& name, const RunArguments& a, const RunPlace& place, Words command) {
  ChildSpec child = MakeChild(name, a, place, {});
  child.arguments = std::move(command);
  child.first.clear();
  child.speaks = false;
  return child;
}

ChildSpec MakeCompanion(ChildSpec child) {
  child.first.clear();
  child.pid_file.clear();
  child.restart = false;
  return child;
}

/// lcm-logplayer in the player's place: nobody would repeat what was played before the others listen.
void PlanReplay(const RunArguments& a, const RunPlace& place, RunPlan* plan) {
  if (place.resume) {
    throw InputError(
        "--replay: lcm-logplayer cannot begin in the middle; begin the run anew, with --log it could "
        "have been resumed");
  }
  LogReplay replay;
  replay.log = LogToReplay(a, place);
  replay.lcm_url = Url(a.bus, place);
  replay.speed = a.pace.speed;
  ChildSpec player = MakeForeign(roles::kPlayer, a, place, PlayCamera(replay));
  for (const ChildSpec& listener : plan->pipeline) player.after.push_back(listener.name);
  plan->pipeline.push_back(std::move(player));
  plan->replay_end = MakeCompanion(MakeForeign("end of the sequence", a, place, PlayEnd(replay)));
  plan->replay_end->output = plan->replay_end->errors = place.LogOf(roles::kPlayer);
}

Words GroundTruthArguments(const RunArguments::Source& source) {
  const std::string file = source.sequence + "/groundtruth.txt";
  return !source.sequence.empty() && fs::is_regular_file(file) ? Words{"--ground-truth", file} : Words{};
}

/// Of every camera: a dash stands for none.
Words GroundTruthArgumentsOfAll(const RunArguments::Source& source) {
  if (source.others.empty()) return GroundTruthArguments(source);
  Words words;
  std::vector<std::string> sequences = source.others;
  sequences.insert(sequences.begin(), source.sequence);
  for (const std::string& sequence : sequences) {
    const std::string file = sequence + "/groundtruth.txt";
    words.push_back("--ground-truth=" + (fs::is_regular_file(file) ? file : "-"));
  }
  return words;
}

ChildSpec MakeCollector(const RunArguments& a, const RunPlace& place, const Words& common) {
  Words words = common;
  if (place.terminal) words.push_back("--quiet");
  Append(&words, {"--out", a.output.folder});
  Append(&words, GroundTruthArgumentsOfAll(a.source));
  ChildSpec child = MakeChild(roles::kCollector, a, place, words);
  child.output = place.out + "/log/table.txt";
  child.errors_to_ours = place.terminal;
  return child;
}

ChildSpec MakeFrontend(const RunArguments& a, const RunPlace& place, const Words& common) {
  Words words = WithVocabulary(a, common);
  // In real time no frame is to wait for a disk.
  if (a.pace.lockstep) Append(&words, {"--frame-memory", FrameMemoryPath(place.out)});
  if (a.output.pictures != "0") {
    fs::create_directories(place.out + "/pictures");
    Append(&words, {"--picture-dir", place.out + "/pictures", "--picture-every", a.output.pictures});
  }
  return MakeChild(roles::kFrontend, a, place, words);
}

ChildSpec MakeMapper(const RunArguments& a, const RunPlace& place, Words words) {
  AppendOption(&words, "--map", a.map.begin);
  AppendOption(&words, "--save-map", a.map.save);
  ChildSpec mapper = MakeChild(roles::kMapper, a, place, std::move(words));
  mapper.environment["DMSLAM_CHECKPOINT"] = CheckpointPath(place.out);  // a mapper of one's own need not know
  return mapper;
}

ChildSpec MakeLogger(const RunArguments& a, const RunPlace& place) {
  std::string log = place.out + "/run.lcmlog";
  if (!place.resume) fs::remove(log);
  for (int i = 2; fs::exists(log); ++i) log = place.out + "/run." + std::to_string(i) + ".lcmlog";
  ChildSpec child = MakeCompanion(
      MakeForeign("logger", a, place, {"lcm-logger", "--quiet", "--lcm-url=" + Url(a.bus, place), log}));
  child.stop_signal = SIGINT;
  return child;
}

ChildSpec MakeViewer(const RunArguments& a, const RunPlace& place, const Words& common) {
  Words words = common;
  AppendOption(&words, "--http", a.output.http);
  Append(&words, GroundTruthArguments(a.source));
  return MakeCompanion(MakeChild(roles::kViewer, a, place, words));
}

/// A line of a log behind the time it begins with; none where it begins with none.
std::optional<std::string> BehindTime(const std::string& line) {
  const size_t end = line.find_first_not_of("0123456789:.");
  if (end == 0 || end == std::string::npos || line[end] != ' ') return std::nullopt;
  return line.substr(end + 1);
}

/// "mapper error: why" as "mapper: why"; none where the line is of no error.
std::optional<std::string> ErrorIn(const std::string& line) {
  for (const std::string level : {" error: ", " critical: "}) {
    const size_t at = line.find(level);
    if (at != std::string::npos) {
      const std::string head = line.substr(0, at);
      return BehindTime(head).value_or(head) + ": " + line.substr(at + level.size());
    }
  }
  return std::nullopt;
}

}  // namespace

uint32_t ChooseSession(const RunArguments::MapFiles& map) {
  // Behind that of the map that is gone on with, so that its keyframes come first.
  const uint32_t before = map.begin.empty() ? 0 : LogIndex(map.begin).Session().id;
  return before + 1 + RandomBelow(map.begin.empty() ? 1u << 30 : 1u << 20);
}

std::string BusUrl(const RunArguments::Bus& bus, int port) {
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0&recv_buf_size=" + bus.receive_buffer;
}

int FreePort() {
  int port = 0;
  for (int i = 0; i < 50; ++i) {
    port = 20000 + static_cast<int>(RandomBelow(30000));
    if (!PortTaken(port)) break;
  }
  return port;
}

void CheckTools(const RunArguments& a) {
  if (!a.source.replay.empty()) NeedTool("lcm-logplayer");
  if (a.output.record) NeedTool("lcm-logger");
}

RunPlan MakeRunPlan(const RunArguments& a, const RunPlace& place) {
  const Words common = CommonArguments(a, place);
  RunPlan plan;
  plan.table = place.out + "/log/table.txt";
  plan.pipeline = {MakeMapper(a, place, common),
                   MakeChild(roles::kLoopCloser, a, place, WithVocabulary(a, common)),
                   MakeFrontend(a, place, common), MakeCollector(a, place, common)};
  if (a.source.replay.empty()) {
    plan.pipeline.push_back(MakePlayer(a, place, common));
  } else {
    PlanReplay(a, place, &plan);
  }
  for (ChildSpec& child : MakeOtherCameras(a, place, common)) plan.pipeline.push_back(std::move(child));
  if (a.output.record) plan.companions.push_back(MakeLogger(a, place));
  if (a.output.WantsViewer()) {
    plan.companions.push_back(MakeViewer(a, place, common));
    for (ChildSpec& child : plan.pipeline)
      child.after.push_back(roles::kViewer);  // it shows the run from its beginning
  }
  return plan;
}

std::string LastWords(const std::string& name, const std::string& log) {
  std::ifstream lines(log);
  std::optional<std::string> error, bare;
  std::string last;
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_not_of(' ') == std::string::npos) continue;
    const std::optional<std::string> event = BehindTime(line);
    if (const auto found = ErrorIn(line)) error = found;
    if (!bare && !event) bare = line;
    last = event.value_or(line);
  }
  if (error) return *error;
  return bare ? name + ": " + *bare : last;
}

}  // namespace dmslam
