#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "dmslam/console/command_line.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/recording/frame_memory.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"
#include "run/log_replay.h"
#include "run/map_check.h"
#include "run/resume.h"
#include "run/run_plan.h"
#include "run/session_taken.h"
#include "run/source_check.h"
#include "run/supervisor.h"

namespace {

namespace fs = std::filesystem;
using dmslam::ChildEvent;

constexpr int64_t kFarewellNs = 2'000'000'000;  // once the results are there, the others end by themselves

void Say(const std::string& text) { std::fputs(("dmslam-run: " + text + "\n").c_str(), stderr); }

std::string OwnFolder() { return fs::read_symlink("/proc/self/exe").parent_path().string(); }

std::string Seconds(int64_t ns) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f s", static_cast<double>(ns) * 1e-9);
  return text;
}

/// A run from its first process to its results.
class Run {
 public:
  Run(const dmslam::RunArguments& arguments, const dmslam::RunPlace& place,
      dmslam::Supervisor::Options options)
      : place_(place),
        camera_(dmslam::IsCamera(arguments.source.sequence)),
        plan_(dmslam::MakeRunPlan(arguments, place)),
        supervisor_(options) {}

  int Play() {
    fs::remove(plan_.table);
    if (place_.resume) SayResume(*place_.resume, camera_);
    for (const auto* children : {&plan_.companions, &plan_.pipeline}) {
      for (const dmslam::ChildSpec& child : *children) Begin(child);
    }
    Watch();
    if (signal_ == 0 && code_ == 0) {
      StayOpen();
      std::error_code ignored;
      fs::remove_all(dmslam::FrameMemoryPath(place_.out),
                     ignored);  // of a frontend that was replaced elsewhere
    }
    supervisor_.StopAll();
    PrintTable();
    if (signal_ == 0 && code_ == 0)
      std::printf("results: %s (picture: %s/trajectory.png)\n", place_.out.c_str(), place_.out.c_str());
    return signal_ == 0 ? code_ : dmslam::kExitSignal + signal_;
  }

 private:
  static void SayResume(const dmslam::ResumePoint& point, bool camera) {
    if (!point.warning.empty()) Say(point.warning);
    std::string frame = point.last_frame ? " behind frame " + std::to_string(*point.last_frame) : "";
    if (!camera && point.play_behind && point.play_behind != point.last_frame)
      frame +=
          ", playing again from " + std::to_string(*point.play_behind + 1) + " on what is not in the map,";
    const std::string newest =
        point.newest_keyframe ? ", the newest of frame " + std::to_string(*point.newest_keyframe) : "";
    Say("goes on" + frame + " in a map of " + std::to_string(point.keyframes) + " keyframes" + newest);
  }

  void Begin(const dmslam::ChildSpec& child) {
    if (!place_.resume) RemoveLogs(child);
    supervisor_.Start(child);
  }

  static void RemoveLogs(const dmslam::ChildSpec& child) {
    if (child.errors != child.output && !child.errors_to_ours) fs::remove(child.errors);
    if (child.name != dmslam::roles::kCollector) fs::remove(child.output);
  }

  void OnReady(const ChildEvent& event) {
    if (event.name != dmslam::roles::kViewer) return;
    viewer_ready_ = true;
    Say(event.text);
    OpenBrowser(event.text.substr(std::min(event.text.find("http"), event.text.size())));
  }

  static void OpenBrowser(const std::string& address) {
    if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
    if (std::system(("xdg-open '" + address + "' </dev/null >/dev/null 2>&1 &").c_str()) != 0) return;
  }

  static bool IsCompanion(const std::string& name) {
    return name == dmslam::roles::kViewer || name == "logger";
  }

  bool PipelineAlive() const {
    const size_t companions =
        (supervisor_.Alive(dmslam::roles::kViewer) ? 1u : 0u) + (supervisor_.Alive("logger") ? 1u : 0u);
    return supervisor_.size() > companions;
  }

  /// The collector ends last. Whoever dies before it is started again; whoever fails ends the run.
  void Watch() {
    while (PipelineAlive() && code_ == 0 && signal_ == 0) {
      const ChildEvent event = supervisor_.Wait(std::min(farewell_ns_, replay_end_.due_ns()));
      if (event.kind != ChildEvent::Kind::kTime) {
        Handle(event);
      } else if (dmslam::Supervisor::now_ns() >= farewell_ns_) {
        return;
      } else {
        EndReplay();
      }
    }
  }

  void Handle(const ChildEvent& event) {
    if (event.kind == ChildEvent::Kind::kSignal) return Interrupt(event.code);
    if (event.kind == ChildEvent::Kind::kRestarted) return OnRestart(event);
    if (event.kind == ChildEvent::Kind::kReady) return OnReady(event);
    if (event.name == dmslam::roles::kViewer && !viewer_ready_)
      throw dmslam::InputError("the viewer did not start: " + LastWords(dmslam::roles::kViewer));
    if (IsCompanion(event.name) || (plan_.replay_end && event.name == plan_.replay_end->name)) return;
    if (event.yields) return Say(event.name + ": another one has taken its place, and goes on");
    if (event.code != 0) return Fail(event);
    OnSuccess(event.name);
  }

  void OnSuccess(const std::string& name) {
    const int64_t now = dmslam::Supervisor::now_ns();
    if (name == dmslam::roles::kPlayer && plan_.replay_end) replay_end_.Begin(now);
    if (name == dmslam::roles::kFrontend) replay_end_.Finish();
    if (name != dmslam::roles::kCollector) return;
    farewell_ns_ = now + kFarewellNs;
    supervisor_.StopRestarting();
  }

  void EndReplay() {
    const dmslam::ReplayEnd::Step step = replay_end_.Next(dmslam::Supervisor::now_ns());
    const pid_t frontend = supervisor_.PidOf(dmslam::roles::kFrontend);
    if (frontend == 0) return;
    if (step == dmslam::ReplayEnd::Step::kPlayAgain && !supervisor_.Alive(plan_.replay_end->name))
      supervisor_.Start(*plan_.replay_end);
    if (step != dmslam::ReplayEnd::Step::kStopFrontend) return;
    Say("the log has no end of the sequence; the frontend is told to finish");
    kill(frontend, SIGTERM);
  }

  void Interrupt(int signal) {
    signal_ = signal;
    supervisor_.StopAll();
    if (signal != SIGINT) return;
    const bool any = fs::exists(fs::path(place_.out) / "summary.json");
    Say(any ? "interrupted; what was tracked is in " + place_.out + ", and dmslam-run --resume " +
                  place_.out + " goes on with it"
            : "interrupted before there was anything to write");
  }

  static std::string HowItEnded(const ChildEvent& event) {
    if (event.hung) return "said nothing for too long and was killed";
    if (event.code > dmslam::kExitSignal)
      return "was ended by signal " + std::to_string(event.code - dmslam::kExitSignal);
    return "ended with code " + std::to_string(event.code);
  }

  void OnRestart(const ChildEvent& event) {
    if (event.name == dmslam::roles::kFrontend && replay_end_.begun())
      replay_end_.Begin(dmslam::Supervisor::now_ns());
    const std::string when = event.delay_ns > 0 ? " in " + Seconds(event.delay_ns) : "";
    Say(event.name + " " + HowItEnded(event) + "; started again" + when + " (" +
        std::to_string(event.restarts) + ")");
    const std::string words =
        event.code == dmslam::kExitNotYet && event.restarts == 1 ? LastWords(event.name) : "";
    if (!words.empty()) Say(words);  // what it waits for
  }

  void Fail(const ChildEvent& event) {
    code_ = event.code;
    if (event.name == dmslam::roles::kCollector && place_.terminal)
      return;  // it has spoken on the terminal itself
    const std::string log = "; its log is " + place_.LogOf(event.name);
    std::string words = event.code > dmslam::kExitSignal ? "" : LastWords(event.name);
    Say(words.empty() ? event.name + " " + HowItEnded(event) + log : words);
  }

  std::string LastWords(const std::string& name) const { return dmslam::LastWords(name, place_.LogOf(name)); }

  /// Who has a terminal can go on looking at what was made.
  void StayOpen() {
    if (!supervisor_.Alive(dmslam::roles::kViewer) || isatty(STDIN_FILENO) == 0 || !place_.terminal) return;
    PrintTable();
    Say("the results are in " + place_.out + "; the viewer stays until Ctrl-C");
    while (supervisor_.Alive(dmslam::roles::kViewer) &&
           supervisor_.Wait().kind != ChildEvent::Kind::kSignal) {
    }
  }

  void PrintTable() {
    std::ifstream table(plan_.table);
    if (table && table.peek() != std::ifstream::traits_type::eof()) std::cout << table.rdbuf() << std::flush;
    table.close();
    std::error_code ignored;
    fs::remove(plan_.table, ignored);
  }

  dmslam::RunPlace place_;
  bool camera_;
  dmslam::RunPlan plan_;
  dmslam::Supervisor supervisor_;
  dmslam::ReplayEnd replay_end_;
  int code_ = 0, signal_ = 0;
  bool viewer_ready_ = false;
  int64_t farewell_ns_ = INT64_MAX;  ///< until when the others may end, once there are results
};

std::string ProgramsOf(const dmslam::RunArguments& a) {
  return a.build_folder.empty() ? OwnFolder() : a.build_folder + "/bin";
}

void CheckPrograms(const dmslam::RunArguments& a) {
  const std::string programs = ProgramsOf(a);
  if (access((programs + "/dmslam-frontend").c_str(), X_OK) != 0)
    throw dmslam::InputError(programs + " has no dmslam-frontend; build first, or check --build-dir");
  if (a.output.WantsViewer() && access((programs + "/dmslam-viewer").c_str(), X_OK) != 0) {
    throw dmslam::InputError(programs +
                             " has no dmslam-viewer; install what it needs with scripts/setup.sh viewer and "
                             "build again");
  }
}

dmslam::RunPlace PlaceOf(const dmslam::RunArguments& a) {
  dmslam::RunPlace place;
  place.programs = ProgramsOf(a);
  place.out = a.output.folder;
  place.terminal = isatty(STDERR_FILENO) != 0;
  std::error_code error;
  fs::create_directories(a.output.folder + "/log", error);
  if (error)
    throw dmslam::InputError(a.output.folder + " cannot be made: " + error.message() + "; check --out");
  place.port = a.bus.port.empty() ? dmslam::FreePort() : std::atoi(a.bus.port.c_str());
  return place;
}

/// A map that lay among what was moved is read where it is now.
void KeepFormerRun(dmslam::RunArguments* arguments) {
  const std::string& out = arguments->output.folder;
  const std::optional<std::string> kept = dmslam::KeepUnfinishedRun(out);
  if (!kept) return;
  Say("a run in " + out + " has not ended; what it needs to go on is kept in " + *kept +
      ": dmslam-run --resume " + *kept);
  std::string& map = arguments->map.begin;
  if (!map.empty() && !fs::exists(map)) map = *kept + "/" + fs::path(map).filename().string();
}

/// On a port that others share, said where somebody writes the run's session there.
bool IsTaken(const dmslam::RunArguments::Bus& bus, int port, uint32_t session) {
  if (!bus.share_port) return false;
  const std::optional<std::string> who = dmslam::WhoWritesSession(bus, port, session);
  if (!who) return false;
  Say("session " + std::to_string(session) + ": " + *who +
      " writes this session already: stop it, or give another --prefix or --port");
  return true;
}

int Start(dmslam::RunArguments arguments, dmslam::RunIdentity identity,
          const std::optional<dmslam::ResumePoint>& resume) {
  dmslam::Supervisor::Options options;
  options.watchdog_ns = dmslam::ToNs(arguments.care.watchdog_s);
  options.wait_for_what_may_come = arguments.care.wait;
  dmslam::RunPlace place = PlaceOf(arguments);
  if (IsTaken(arguments.bus, place.port, identity.session)) return dmslam::kExitPresent;
  if (!resume) KeepFormerRun(&arguments);
  place.session = identity.session;
  place.resume = resume;
  identity.pid = getpid();
  Run run(arguments, place, options);
  identity.Write(place.out);
  return run.Play();
}

/// What is in the folder stays as it is, where something is refused.
void CheckAll(const dmslam::RunArguments& arguments) {
  dmslam::CheckRunArguments(arguments);
  dmslam::CheckTools(arguments);
  CheckPrograms(arguments);
  dmslam::CheckSources(arguments);
}

int Begin(const dmslam::RunArguments& arguments, int argc, char** argv) {
  CheckAll(arguments);
  if (const std::optional<std::string> notice = dmslam::CheckMap(arguments)) Say(*notice);
  std::error_code error;
  fs::create_directories(arguments.output.folder, error);
  const dmslam::RunLock lock(arguments.output.folder);
  dmslam::RunIdentity identity;
  identity.session = dmslam::ChooseSession(arguments.map);
  identity.folder = fs::current_path().string();
  identity.arguments.assign(argv + 1, argv + argc);
  return Start(arguments, identity, std::nullopt);
}

/// The same run again, from where it stood when all its processes died.
int Resume(const std::string& folder) {
  if (!fs::is_directory(folder)) throw dmslam::InputError(folder + ": no such folder; check --resume");
  const std::string out = fs::absolute(folder).lexically_normal().string();
  const dmslam::RunLock lock(out);
  dmslam::RunIdentity identity = dmslam::RunIdentity::Read(out);
  const dmslam::ResumePoint point = dmslam::FindResumePoint(out, identity);
  std::error_code gone;
  fs::current_path(identity.folder, gone);
  if (gone)
    throw dmslam::InputError(identity.folder + ": the run was begun there, and it is not there any more");
  dmslam::CommandLine line("", "dmslam-run");
  dmslam::RunArguments arguments;
  dmslam::DeclareRunArguments(line, arguments);
  std::vector<const char*> words = {"dmslam-run"};
  for (const std::string& word : identity.arguments) words.push_back(word.c_str());
  if (line.Parse(static_cast<int>(words.size()), words.data()))
    throw dmslam::InputError(out +
                             "/run.json: its arguments are not those of this dmslam-run; begin it anew");
  arguments.output.folder = out;
  CheckAll(arguments);
  ++identity.resumed;
  return Start(arguments, identity, point);
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::CommandLine line(
      "Plays a sequence through player, frontend, mapper and loop closer, four processes on a private LCM\n"
      "port, and writes into the --out folder: trajectory.txt (final, TUM format), trajectory_online.txt,\n"
      "poses_online.csv, keyframes.txt, map.ply, trajectory.png, summary.json, and the processes' logs. A\n"
      "process that dies or hangs is started again, and goes on where it was; where all died at once,\n"
      "--resume does so.",
      "dmslam-run");
  dmslam::RunArguments arguments;
  line.SetVersion(dmslam::BuildVersion());
  dmslam::DeclareRunArguments(line, arguments);
  if (const std::optional<int> code = line.Parse(argc, argv))
    return *code == 0 ? 0 : static_cast<int>(dmslam::kExitUsage);
  try {
    if (arguments.resume.empty()) return Begin(arguments, argc, argv);
    if (argc > 3)
      throw dmslam::InputError("--resume goes on with what the run was begun with: give no other option");
    return Resume(arguments.resume);
  } catch (const dmslam::MisfitError& error) {
    Say(error.what());
    return dmslam::kExitMisfit;
  } catch (const dmslam::InputError& error) {
    Say(error.what());
    return dmslam::kExitInput;
  } catch (const std::exception& error) {
    Say(std::string("stopped by an internal error: ") + error.what());
    return dmslam::kExitInternal;
  }
}
