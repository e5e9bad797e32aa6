#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/console/command_line.h"

namespace dmslam {

/// What the command line of dmslam-run says.
struct RunArguments {
  std::string resume;  ///< folder of a run whose processes all died: it is gone on with
  std::string sequence, log, replay, map, save_map, out, camera, seed = "1", config, profile, pictures = "0",
                                                                 http, port, prefix, key, programs;
  std::string receive_buffer = "4194304", encoding, start, frames;
  std::vector<std::string> sets, black_outs, jumps;
  double speed = 1, fps = 0, watchdog_s = 60;
  bool localize = false, lockstep = false, no_loop = false, viewer = false, record = false,
       share_port = false, no_restart = false, wait = false;
};

/// Declares the options on `line`; the arguments must outlive it.
void DeclareRunArguments(CommandLine& line, RunArguments& arguments);

/// Throws InputError that names what does not fit, with the cure.
void CheckRunArguments(const RunArguments& arguments);

/// Whether its frames come from a camera, and not from a recording.
bool IsCamera(const std::string& sequence);

/// Whether somebody on this host is bound to the UDP port. `proc_net`: the folder of the kernel's tables.
bool PortTaken(int port, const std::string& proc_net = "/proc/net");
/// The number of sockets bound to it.
int SocketsOn(int port, const std::string& proc_net = "/proc/net");

}  // namespace dmslam
