#pragma once

#include <csignal>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace dmslam {

/// A process to be started, and started again.
struct ChildSpec {
  std::string name;                                ///< "mapper"
  std::vector<std::string> arguments;              ///< the program's path first
  std::vector<std::string> first;                  ///< only at its first start, behind the others
  std::map<std::string, std::string> environment;  ///< beside our own
  std::vector<std::string> after;                  ///< first started when these have said that they are ready
  std::string output, errors;   ///< files that standard output and standard error are appended to
  bool errors_to_ours = false;  ///< standard error is the supervisor's own
  std::string pid_file;         ///< holds its process id; empty: none
  bool restart = true;          ///< where that is worth it
  int stop_signal = SIGTERM;
  bool speaks = false;  ///< says that it is ready and then, again and again, that it is alive
};

/// What became of a child, or who spoke to the supervisor.
struct ChildEvent {
  enum class Kind : uint8_t {
    kReady,      ///< said so (sd_notify); `text` is the status it gave with it
    kEnded,      ///< and stays so
    kRestarted,  ///< died, and is started again after `delay_ns`
    kSignal,     ///< the supervisor itself was asked to stop; `code` is the signal
    kTime,       ///< nothing happened until the deadline
  };
  Kind kind = Kind::kTime;
  std::string name;
  std::string text;
  int code = 0;         ///< exit code, or 128 + signal
  int restarts = 0;     ///< of this child so far
  bool hung = false;    ///< it said nothing for too long, and was killed
  bool yields = false;  ///< another process has taken its place: no failure
  int64_t delay_ns = 0;
};

}  // namespace dmslam
