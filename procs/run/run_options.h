#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/console/command_line.h"

namespace dmslam {

/// What the command line of dmslam-run says. Numbers that are handed on stay text.
struct RunArguments {
  /// Where the frames come from (one of three), and which of them are played.
  struct Source {
    std::string sequence, log, replay;
    std::vector<std::string> others;         ///< sequences of further cameras...
    std::vector<std::string> other_cameras;  ///< ...and their camera files, where they are of other models
    std::string start, frames;
    std::vector<std::string> black_outs, jumps;
  };
  /// What took the frames, and how they travel.
  struct Camera {
    std::string file, encoding;
    double fps = 0;  ///< 0: as the camera file says
  };
  struct MapFiles {
    std::string begin, save;
    bool localize = false;
  };
  struct Pace {
    bool lockstep = false;
    double speed = 1;
  };
  struct Settings {
    std::string seed = "1", config, profile;
    std::string vocabulary;  ///< empty: the one that ships
    std::vector<std::string> sets;
    bool no_loop = false;
  };
  /// What the run leaves behind, and who may look on.
  struct Output {
    std::string folder, pictures = "0", http;
    bool viewer = false, record = false;
    bool WantsViewer() const { return viewer || !http.empty(); }
  };
  struct Bus {
    std::string port, prefix, key, receive_buffer = "4194304";
    bool share_port = false;
  };
  /// What is done for processes that die, hang or cannot begin yet.
  struct Care {
    bool no_restart = false, wait = false;
    double watchdog_s = 60;
  };
  Source source;
  Camera camera;
  MapFiles map;
  Pace pace;
  Settings settings;
  Output output;
  Bus bus;
  Care care;
  std::string resume;        ///< folder of a run whose processes all died: it is gone on with
  std::string build_folder;  ///< its bin has the programs; empty: they are beside this one
};

/// Declares the options on `line`; the arguments must outlive it.
void DeclareRunArguments(CommandLine& line, RunArguments& arguments);

/// Throws InputError that names what does not fit, with the cure.
void CheckRunArguments(const RunArguments& arguments);

/// Whether its frames come from a camera, and not from a recording.
bool IsCamera(const std::string& sequence);

/// Whether somebody on this host is bound to the UDP port. `proc_net`: the folder of the kernel's tables.
bool PortTaken(int port, const std::string& proc_net = "/proc/net");

}  // namespace dmslam
