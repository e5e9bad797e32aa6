#include "run/log_replay.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string_view>
#include <thread>

#include "dmslam/messaging/event_log.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/channels.h"
#include "run/run_options.h"

namespace dmslam {
namespace {

constexpr int kListeners = 4;  // frontend, mapper, loop closer, collector

void Sleep(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

int RunLogplayer(const LogReplay& replay, double speed, const std::string& channels) {
  const std::string rate = std::to_string(speed);
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    execlp("lcm-logplayer", "lcm-logplayer", "-s", rate.c_str(), "-l", replay.lcm_url.c_str(), "-e",
           channels.c_str(), replay.log.c_str(), nullptr);
    std::perror("lcm-logplayer cannot be started");
    _exit(kExitNoProgram);
  }
  int status = 0;
  if (pid < 0 || waitpid(pid, &status, 0) != pid) return kExitInternal;
  return WIFEXITED(status) ? WEXITSTATUS(status) : kExitSignal + WTERMSIG(status);
}

std::optional<pid_t> LivingFrontend(const std::string& pid_file) {
  pid_t pid = 0;
  std::ifstream(pid_file) >> pid;
  return pid > 0 && kill(pid, 0) == 0 ? std::optional(pid) : std::nullopt;
}

}  // namespace

std::string PrefixOfCamera(const std::string& log) {
  EventLogReader reader(log);
  const std::string_view frame = channels::kFrame;
  while (const auto event = reader.Next()) {
    if (event->channel.ends_with(frame))
      return event->channel.substr(0, event->channel.size() - frame.size());
  }
  throw InputError(log + ": holds no frames of a camera; was the player recorded too?");
}

int PlayLog(const LogReplay& replay) {
  for (int i = 0; i < 200 && SocketsOn(replay.port) < kListeners; ++i) Sleep(0.05);
  Sleep(0.5);
  const std::string owner = ".*DMSLAM_PLAYER_";
  const int code =
      RunLogplayer(replay, replay.speed, owner + "(CAMERA_INFO|FRAME|GROUND_TRUTH|END_OF_SEQUENCE)$");
  if (code != 0) return code;
  for (int i = 0; i < 60; ++i) {
    if (!LivingFrontend(replay.frontend_pid_file)) return 0;
    if (i % 4 == 3) RunLogplayer(replay, 1000, owner + "END_OF_SEQUENCE$");
    Sleep(0.25);
  }
  std::fprintf(stderr, "the log has no end of the sequence; the frontend is told to finish\n");
  if (const auto frontend = LivingFrontend(replay.frontend_pid_file)) kill(*frontend, SIGTERM);
  return 0;
}

}  // namespace dmslam
