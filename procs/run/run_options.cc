#include "run/run_options.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "dmslam/messaging/bus_key.h"
#include "dmslam/util/check.h"

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

void CheckSource(const RunArguments& a) {
  const int sources = (a.sequence.empty() ? 0 : 1) + (a.log.empty() ? 0 : 1) + (a.replay.empty() ? 0 : 1);
  if (sources == 0) throw InputError("--sequence is missing (see --help)");
  if (sources > 1) throw InputError("give one of --sequence, --log and --replay");
  if (!a.sequence.empty() && !IsCamera(a.sequence) && !fs::exists(a.sequence))
    throw InputError(a.sequence + ": no such folder or file; check --sequence");
  CheckFile("--log", a.log);
  CheckFile("--replay", a.replay);
  if (a.lockstep && !a.replay.empty()) {
    throw InputError(
        "--replay plays in real time, since lcm-logplayer waits for nobody; in lock-step plays --log");
  }
}

void CheckKey(const RunArguments& a) {
  const bool keyed = BusKey::LoadIfWanted(a.key).has_value();
  if (keyed && !a.replay.empty()) {
    throw InputError(
        "--replay plays by lcm-logplayer, which has no key; --log plays the same frames by our player, at "
        "the "
        "same rate");
  }
}

void CheckPort(const RunArguments& a) {
  if (a.port.empty()) return;
  const int port = IsWholeNumber(a.port) && a.port.size() < 6 ? std::atoi(a.port.c_str()) : 0;
  if (port < 1024 || port > 65535)
    throw InputError("--port " + a.port + ": write a port between 1024 and 65535");
  if (!a.share_port && PortTaken(port)) {
    throw InputError("UDP port " + a.port +
                     " is taken; choose another with --port, leave it out, or give --share-port");
  }
}

}  // namespace

void DeclareRunArguments(CommandLine& line, RunArguments& a) {
  line.AddOption("--sequence,--video", a.sequence,
                 "TUM RGB-D folder, EuRoC folder, numbered images, a video, a camera (/dev/videoN), or the "
                 "address of a camera's stream");
  line.AddOption("--log", a.log,
                 "instead of --sequence: the frames of a log of lcm-logger, by our player (any mode)");
  line.AddOption("--replay", a.replay,
                 "instead of --sequence: the camera channels of such a log, by the real lcm-logplayer, in "
                 "real time (--start, --frames, --black-out, --jump, --camera, --prefix: of a copy of them)");
  line.AddOption("--out", a.out, "folder for the results");
  line.AddOption(
      "--resume", a.resume,
      "instead of all else: go on with the run of this --out folder, whose processes all died (power, "
      "memory), from its last checkpoint");
  line.AddOption("--fps", a.fps,
                 "rate of numbered images, of videos that state none, and asked of a camera; default: as the "
                 "camera file says");
  line.AddOption("--encoding", a.encoding,
                 "how frames of videos and cameras travel: jpeg (default), png or raw, both without loss");
  line.AddOption("--map", a.map, "begin in a saved map (or the map of a log), and go on with it");
  line.AddFlag("--localize", a.localize, "with --map: find the camera in it, and leave the map as it is");
  line.AddOption("--save-map", a.save_map, "save the map at the end");
  line.AddOption("--camera", a.camera, "camera file (YAML); found by itself for TUM freiburg1/2/3");
  line.AddFlag("--lockstep", a.lockstep, "wait for every frame: the same input and seed give the same bytes");
  line.AddOption("--speed", a.speed, "real time at so many times the recorded rate").ShowDefault();
  line.AddOption("--seed", a.seed, "seed of everything random").ShowDefault();
  line.AddOption("--start", a.start, "first frame");
  line.AddOption("--frames", a.frames, "at most so many frames");
  line.AddOption("--config", a.config, "settings (YAML)");
  line.AddOption("--set", a.sets, "KEY=VALUE: one setting; may be repeated (docs/configuration.md)");
  line.AddOption("--profile", a.profile,
                 "dm (default) or baseline: plain RANSAC start, no mutual exclusion, no motion belief");
  line.AddFlag("--no-loop", a.no_loop, "do not close loops");
  line.AddOption("--pictures", a.pictures, "draw the features of every Nth frame into OUT/pictures");
  line.AddFlag("--viewer", a.viewer,
               "show it live in a browser; the address is printed, and opened where there is a desktop");
  line.AddOption("--http", a.http,
                 "HOST:PORT where the viewer serves; default: 127.0.0.1:8080, or any port that is free");
  line.AddFlag("--record", a.record, "record everything with lcm-logger into OUT/run.lcmlog");
  line.AddOption("--black-out", a.black_outs, "FRAME,SECONDS: black frames from a frame on; may be repeated");
  line.AddOption("--jump", a.jumps, "FROM,TO: after frame FROM go on with frame TO; may be repeated");
  line.AddOption("--port", a.port, "UDP port; default: a free one");
  line.AddFlag("--share-port", a.share_port,
               "others may be on that port already: lcm-spy, a logger, a system with another --prefix");
  line.AddOption("--prefix", a.prefix, "put before every channel: separates systems on one port");
  line.AddOption(
      "--key", a.key,
      "file with a key (mode 0600): every message carries a tag made with it, and only such ones are "
      "heard; default: what DMSLAM_KEY_FILE names");
  line.AddOption("--receive-buffer", a.receive_buffer,
                 "bytes that the kernel is asked to hold for each process")
      .ShowDefault();
  line.AddFlag("--no-restart", a.no_restart,
               "a process that dies ends the run; default: it is started again, and goes on where it was");
  line.AddOption("--watchdog", a.watchdog_s,
                 "a process that says nothing for so many seconds hangs, and is started again; 0: nobody "
                 "watches")
      .NonNegative()
      .ShowDefault();
  line.AddFlag("--wait", a.wait,
               "where there is no multicast route or no camera yet, try again until there is one");
  line.AddOption("--build-dir", a.programs,
                 "folder whose bin has the programs; default: those beside this one");
}

void CheckRunArguments(const RunArguments& a) {
  CheckSource(a);
  if (a.out.empty()) throw InputError("--out is missing (see --help)");
  CheckNumber("--seed", a.seed);
  CheckNumber("--pictures", a.pictures);
  CheckNumber("--receive-buffer", a.receive_buffer);
  CheckFile("--map", a.map);
  if (a.localize && a.map.empty()) throw InputError("--localize needs a map: give it with --map");
  if (!a.profile.empty() && a.profile != "dm" && a.profile != "baseline")
    throw InputError("--profile " + a.profile + ": write dm or baseline");
  CheckKey(a);
  CheckPort(a);
}

bool IsCamera(const std::string& sequence) {
  return sequence.find("://") != std::string::npos || sequence.rfind("/dev/", 0) == 0;
}

int SocketsOn(int port, const std::string& proc_net) {
  char wanted[8];
  std::snprintf(wanted, sizeof(wanted), ":%04X", static_cast<unsigned>(port));
  int sockets = 0;
  for (const char* table : {"udp", "udp6"}) {
    std::ifstream lines(proc_net + "/" + table);
    for (std::string line, slot, local; std::getline(lines, line);) {
      const size_t colon = line.find(':');  // behind the slot's number
      const size_t address = colon == std::string::npos ? colon : line.find(':', colon + 1);
      if (address != std::string::npos && line.compare(address, 5, wanted) == 0) ++sockets;
    }
  }
  return sockets;
}

bool PortTaken(int port, const std::string& proc_net) { return SocketsOn(port, proc_net) > 0; }

}  // namespace dmslam
