#include "run/run_options.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "dmslam/messaging/bus_key.h"
#include "dmslam/runtime/session_check.h"
#include "dmslam/util/check.h"
#include "dmslam/util/http_address.h"
#include "dmslam/util/ids.h"
#include "dmslam/util/output_file.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

bool IsWholeNumber(const std::string& text) {
  return !text.empty() && text.size() < 20 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

void CheckNumber(const std::string& option, const std::string& text) {
  if (!IsWholeNumber(text)) throw InputError(option + " " + text + ": write a whole number");
}

void CheckFile(const std::string& option, const std::string& path) {
  if (!path.empty() && !fs::is_regular_file(path)) throw InputError(path + ": no such file; check " + option);
}

void CheckSource(const RunArguments::Source& source, const RunArguments::Pace& pace) {
  const int sources =
      (source.sequence.empty() ? 0 : 1) + (source.log.empty() ? 0 : 1) + (source.replay.empty() ? 0 : 1);
  if (sources == 0) throw InputError("--sequence is missing (see --help)");
  if (sources > 1) throw InputError("give one of --sequence, --log and --replay");
  if (!source.sequence.empty() && !IsCamera(source.sequence) && !fs::exists(source.sequence))
    throw InputError(source.sequence + ": no such folder or file; check --sequence");
  for (const std::string& other : source.others) {
    if (!IsCamera(other) && !fs::exists(other))
      throw InputError(other + ": no such folder or file; check --also");
  }
  if (!source.others.empty() && source.sequence.empty())
    throw InputError("--also goes with --sequence, not with a log");
  if (source.others.size() >= kMaxCameras)
    throw InputError("--also: at most " + std::to_string(kMaxCameras) + " cameras work on one map");
  CheckFile("--log", source.log);
  CheckFile("--replay", source.replay);
  if (pace.lockstep && !source.replay.empty()) {
    throw InputError(
        "--replay plays in real time, since lcm-logplayer waits for nobody; in lock-step plays --log");
  }
}

void CheckOtherCameras(const RunArguments& a) {
  const std::string problem =
      WhyNotTheseCameras(a.camera.file, a.source.others.size(), a.source.other_cameras.size());
  if (!problem.empty()) throw InputError(problem);
  for (const std::string& file : a.source.other_cameras) CheckFile("--also-camera", file);
}

/// The folder of the results is made by the run itself.
void CheckSaveMap(const std::string& path, const std::string& out) {
  if (path.empty()) return;
  const fs::path file = fs::absolute(path).lexically_normal();
  const fs::path results = fs::absolute(out + "/").lexically_normal().parent_path();
  if (file == results) throw InputError("--save-map: " + path + ": is a folder; give the name of a file");
  try {
    if (file.parent_path() == results) return CheckNoFolder(path);
    CheckFolderOf(path);
  } catch (const InputError& error) {
    throw InputError(std::string("--save-map: ") + error.what());
  }
}

/// Below a thousandth it would be handed on as 0.
void CheckSpeed(double speed) {
  if (speed >= 0.001 && std::isfinite(speed)) return;
  char text[32];
  std::snprintf(text, sizeof(text), "%g", speed);
  throw InputError(std::string("--speed ") + text +
                   ": must be above zero, 0.001 or more; --lockstep plays as fast as it can");
}

void CheckKey(const RunArguments::Bus& bus, const RunArguments::Source& source) {
  const bool keyed = BusKey::LoadIfWanted(bus.key).has_value();
  if (keyed && !source.replay.empty()) {
    throw InputError(
        "--replay plays by lcm-logplayer, which has no key; --log plays the same frames by our player, at "
        "the same rate");
  }
}

void CheckPort(const RunArguments::Bus& bus) {
  if (bus.port.empty()) return;
  const int port = IsWholeNumber(bus.port) && bus.port.size() < 6 ? std::atoi(bus.port.c_str()) : 0;
  if (port < 1024 || port > 65535)
    throw InputError("--port " + bus.port + ": write a port between 1024 and 65535");
  if (!bus.share_port && PortTaken(port)) {
    throw InputError("UDP port " + bus.port +
                     " is taken; choose another with --port, leave it out, or give --share-port");
  }
}

void DeclareSource(CommandLine& line, RunArguments::Source& source) {
  line.AddOption("--sequence,--video", source.sequence,
                 "TUM RGB-D folder, EuRoC folder, numbered images, a video, a camera (/dev/videoN), or the "
                 "address of a camera's stream");
  line.AddOption("--also", source.others,
                 "sequence of another camera that goes at the same time and works on the same map; may be "
                 "repeated (docs/many-cameras.md)");
  line.AddOption("--also-camera", source.other_cameras,
                 "camera file of an --also, one for each, where they are not of the model of --camera");
  line.AddOption("--log", source.log,
                 "instead of --sequence: the frames of a log of lcm-logger, by our player (any mode)");
  line.AddOption("--replay", source.replay,
                 "instead of --sequence: the camera channels of such a log, by the real lcm-logplayer, in "
                 "real time (--start, --frames, --black-out, --jump, --camera, --prefix: of a copy of them)");
  line.AddOption("--start", source.start, "first frame");
  line.AddOption("--frames", source.frames, "at most so many frames");
  line.AddOption("--black-out", source.black_outs,
                 "FRAME,SECONDS: black frames from a frame on; may be repeated");
  line.AddOption("--jump", source.jumps, "FROM,TO: after frame FROM go on with frame TO; may be repeated");
}

void DeclareCamera(CommandLine& line, RunArguments::Camera& camera) {
  line.AddOption("--fps", camera.fps,
                 "rate of numbered images, of videos that state none, and asked of a camera; default: as the "
                 "camera file says")
      .InRange(0.01, 1000.0);
  line.AddOption("--encoding", camera.encoding,
                 "how frames of videos and cameras travel: jpeg (default), png or raw, both without loss")
      .OneOf({"jpeg", "png", "raw"});
  line.AddOption("--camera", camera.file,
                 "camera file (YAML); found by itself for rendered sequences, EuRoC and TUM freiburg1/2/3, "
                 "and in a --log");
}

void DeclareMap(CommandLine& line, RunArguments::MapFiles& map) {
  line.AddOption("--map", map.begin, "begin in a saved map (or the map of a log), and go on with it");
  line.AddFlag("--localize", map.localize, "with --map: find the camera in it, and leave the map as it is");
  line.AddOption("--save-map", map.save, "save the map at the end");
}

void DeclarePace(CommandLine& line, RunArguments::Pace& pace) {
  line.AddFlag("--lockstep", pace.lockstep,
               "wait for every frame: the same input and seed give the same bytes");
  line.AddOption("--speed", pace.speed,
                 "in real time: play at so many times the recorded rate, from 0.001 on; 0.5 is half of it. "
                 "Frames that come too fast for the frontend are skipped; --lockstep goes as fast as it can, "
                 "and has no use for this")
      .ShowDefault();
}

void DeclareSettings(CommandLine& line, RunArguments::Settings& settings) {
  line.AddOption("--seed", settings.seed, "seed of everything random").ShowDefault();
  line.AddOption("--config", settings.config, "settings (YAML)");
  line.AddOption("--set", settings.sets, "KEY=VALUE: one setting; may be repeated (docs/configuration.md)");
  line.AddOption(
      "--profile", settings.profile,
      "dm (default), baseline (plain RANSAC start, no mutual exclusion, no motion belief) or paper (the "
      "DM-SLAM paper alone)");
  line.AddFlag("--no-loop", settings.no_loop, "do not close loops");
  line.AddOption("--vocabulary", settings.vocabulary, "bag-of-words vocabulary; default: the one that ships");
}

void DeclareOutput(CommandLine& line, RunArguments::Output& output) {
  line.AddOption("--out", output.folder, "folder for the results");
  line.AddOption("--pictures", output.pictures, "draw the features of every Nth frame into OUT/pictures");
  line.AddFlag("--viewer", output.viewer,
               "show it live in a browser; the address is printed, and opened where there is a desktop");
  line.AddOption("--http", output.http,
                 "HOST:PORT where the viewer serves; default: 127.0.0.1:8080, or any port that is free");
  line.AddFlag("--record", output.record, "record everything with lcm-logger into OUT/run.lcmlog");
}

void DeclareBus(CommandLine& line, RunArguments::Bus& bus) {
  line.AddOption("--port", bus.port, "UDP port; default: a free one");
  line.AddFlag("--share-port", bus.share_port,
               "others may be on that port already: lcm-spy, a logger, a system with another --prefix");
  line.AddOption("--prefix", bus.prefix, "put before every channel: separates systems on one port");
  line.AddOption(
      "--key", bus.key,
      "file with a key (mode 0600): every message carries a tag made with it, and only such ones are "
      "heard; default: what DMSLAM_KEY_FILE names");
  line.AddOption("--receive-buffer", bus.receive_buffer,
                 "bytes that the kernel is asked to hold for each process")
      .ShowDefault();
}

void DeclareCare(CommandLine& line, RunArguments::Care& care) {
  line.AddFlag("--no-restart", care.no_restart,
               "a process that dies ends the run; default: it is started again, and goes on where it was");
  line.AddOption("--watchdog", care.watchdog_s,
                 "a process that says nothing for so many seconds hangs, and is started again; 0: nobody "
                 "watches")
      .NonNegative()
      .ShowDefault();
  line.AddFlag("--wait", care.wait,
               "where there is no multicast route or no camera yet, try again until there is one");
}

}  // namespace

void DeclareRunArguments(CommandLine& line, RunArguments& a) {
  DeclareSource(line, a.source);
  DeclareCamera(line, a.camera);
  DeclareMap(line, a.map);
  DeclarePace(line, a.pace);
  DeclareSettings(line, a.settings);
  DeclareOutput(line, a.output);
  DeclareBus(line, a.bus);
  DeclareCare(line, a.care);
  line.AddOption(
      "--resume", a.resume,
      "instead of all else: go on with the run of this --out folder, whose processes all died (power, "
      "memory), from its last checkpoint");
  line.AddOption("--build-dir", a.build_folder,
                 "folder whose bin has the programs; default: those beside this one");
}

void CheckRunArguments(const RunArguments& a) {
  CheckSource(a.source, a.pace);
  CheckOtherCameras(a);
  if (a.output.folder.empty()) throw InputError("--out is missing (see --help)");
  if (!a.source.start.empty()) CheckNumber("--start", a.source.start);
  if (!a.source.frames.empty()) CheckNumber("--frames", a.source.frames);
  CheckNumber("--seed", a.settings.seed);
  CheckNumber("--pictures", a.output.pictures);
  CheckNumber("--receive-buffer", a.bus.receive_buffer);
  CheckFile("--vocabulary", a.settings.vocabulary);
  CheckFile("--map", a.map.begin);
  CheckSaveMap(a.map.save, a.output.folder);
  CheckSpeed(a.pace.speed);
  if (a.map.localize && a.map.begin.empty()) throw InputError("--localize needs a map: give it with --map");
  if (!a.settings.profile.empty() && a.settings.profile != "dm" && a.settings.profile != "baseline" &&
      a.settings.profile != "paper")
    throw InputError("--profile " + a.settings.profile + ": write dm, baseline or paper");
  if (!a.output.http.empty()) ParseHttpAddress(a.output.http);
  CheckKey(a.bus, a.source);
  CheckPort(a.bus);
}

bool IsCamera(const std::string& sequence) {
  return sequence.find("://") != std::string::npos || sequence.rfind("/dev/", 0) == 0;
}

bool PortTaken(int port, const std::string& proc_net) {
  char wanted[8];
  std::snprintf(wanted, sizeof(wanted), ":%04X", static_cast<unsigned>(port));
  for (const char* table : {"udp", "udp6"}) {
    std::ifstream lines(proc_net + "/" + table);
    for (std::string line; std::getline(lines, line);) {
      const size_t colon = line.find(':');  // behind the slot's number
      const size_t address = colon == std::string::npos ? colon : line.find(':', colon + 1);
      if (address != std::string::npos && line.compare(address, 5, wanted) == 0) return true;
    }
  }
  return false;
}

}  // namespace dmslam
