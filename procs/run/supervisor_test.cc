#include "run/supervisor.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include "dmslam/runtime/exit_codes.h"

namespace dmslam {
namespace {

using Kind = ChildEvent::Kind;

constexpr int64_t kSecondNs = 1'000'000'000;

ChildSpec Program(const std::string& name, std::vector<std::string> arguments) {
  ChildSpec child;
  child.name = name;
  child.arguments = std::move(arguments);
  return child;
}
ChildSpec Sleeper(const std::string& name) { return Program(name, {"sleep", "1000"}); }
ChildSpec Shell(const std::string& name, const std::string& script) {
  return Program(name, {"sh", "-c", script});
}

Supervisor::Options Eager() {
  Supervisor::Options options;
  options.first_delay_ns = options.longest_delay_ns = 1'000'000;
  options.most_short_lives = 1'000'000;
  options.stop_ns = kSecondNs;
  return options;
}

/// Takes events until all of `names` are alive, or ten seconds are over.
bool AllAlive(Supervisor& supervisor, const std::vector<std::string>& names, int* deaths) {
  const int64_t deadline = Supervisor::now_ns() + 10 * kSecondNs;
  while (Supervisor::now_ns() < deadline) {
    const ChildEvent event = supervisor.Wait(Supervisor::now_ns() + 20'000'000);
    if (event.kind == Kind::kRestarted) ++*deaths;
    const bool all = std::all_of(names.begin(), names.end(),
                                 [&](const std::string& name) { return supervisor.Alive(name); });
    if (all && event.kind == Kind::kTime) return true;
  }
  return false;
}

/// Kills these at once, and waits until they have been started again: other processes than before.
void KillTogether(Supervisor& supervisor, const std::vector<std::string>& names) {
  std::map<std::string, pid_t> former;
  for (const std::string& name : names) former[name] = supervisor.PidOf(name);
  for (const auto& [name, pid] : former) ASSERT_EQ(kill(pid, SIGKILL), 0) << name;
  size_t restarted = 0;
  const int64_t deadline = Supervisor::now_ns() + 10 * kSecondNs;
  while (restarted < names.size() && Supervisor::now_ns() < deadline) {
    const ChildEvent event = supervisor.Wait(deadline);
    if (event.kind != Kind::kRestarted) continue;
    EXPECT_EQ(event.code, kExitSignal + SIGKILL);
    ++restarted;
  }
  ASSERT_EQ(restarted, names.size()) << "a death was missed";
  int none = 0;
  ASSERT_TRUE(AllAlive(supervisor, names, &none));
  EXPECT_EQ(none, 0);
  for (const auto& [name, pid] : former) EXPECT_NE(supervisor.PidOf(name), pid);
}

TEST(SupervisorTest, NoDeathIsMissedHoweverManyDieTogether) {
  Supervisor supervisor(Eager());
  const std::vector<std::string> names = {"mapper", "loopcloser", "frontend", "collector", "player"};
  for (const std::string& name : names) supervisor.Start(Sleeper(name));
  KillTogether(supervisor, {"player", "collector"});
  KillTogether(supervisor, names);
  std::mt19937 random(7);
  for (int i = 0; i < 200; ++i) {
    std::vector<std::string> pair = names;
    std::shuffle(pair.begin(), pair.end(), random);
    pair.resize(2);
    KillTogether(supervisor, pair);
    if (HasFatalFailure()) return;
  }
  supervisor.StopAll();
  EXPECT_EQ(supervisor.size(), 0u);
}

TEST(SupervisorTest, StartsAgainWhatIsWorthIt) {
  for (const int code : {4, 8, 70}) {
    Supervisor supervisor(Eager());
    supervisor.Start(Shell("child", "exit " + std::to_string(code)));
    const ChildEvent event = supervisor.Wait();
    EXPECT_EQ(event.kind, Kind::kRestarted) << code;
    EXPECT_EQ(event.code, code);
    EXPECT_EQ(event.restarts, 1);
  }
  for (const int code : {0, 1, 2, 3, 5, 6, 7, 64}) {
    Supervisor supervisor(Eager());
    supervisor.Start(Shell("child", "exit " + std::to_string(code)));
    const ChildEvent event = supervisor.Wait();
    EXPECT_EQ(event.kind, Kind::kEnded) << code;
    EXPECT_EQ(event.code, code);
    EXPECT_EQ(supervisor.size(), 0u);
  }
}

TEST(SupervisorTest, WaitsForTheBusWhereItIsToldTo) {
  Supervisor::Options options = Eager();
  options.wait_for_what_may_come = true;
  Supervisor supervisor(options);
  supervisor.Start(Shell("child", "exit 7"));
  for (int i = 0; i < 20; ++i) EXPECT_EQ(supervisor.Wait().kind, Kind::kRestarted);
}

TEST(SupervisorTest, WhoHasLivedIsWorthPatienceWithTheBus) {
  Supervisor::Options options = Eager();
  options.short_life_ns = 50'000'000;
  options.patience_ns = 300'000'000;
  Supervisor supervisor(options);
  const std::string first = testing::TempDir() + "/dmslam_lived_" + std::to_string(getpid());
  supervisor.Start(Shell("child", "[ -e " + first + " ] && exit 7; touch " + first + "; sleep 0.1; exit 7"));
  const int64_t began = Supervisor::now_ns();
  ChildEvent event;
  while ((event = supervisor.Wait()).kind == Kind::kRestarted) {
  }
  EXPECT_EQ(event.kind, Kind::kEnded);
  EXPECT_GT(Supervisor::now_ns() - began, 300'000'000);
  std::filesystem::remove(first);
}

TEST(SupervisorTest, GivesUpOnWhoDiesAsSoonAsItLives) {
  Supervisor::Options options = Eager();
  options.most_short_lives = 3;
  options.first_delay_ns = 20'000'000;
  options.longest_delay_ns = 40'000'000;
  Supervisor supervisor(options);
  supervisor.Start(Shell("child", "exit 70"));
  std::vector<int64_t> delays;
  ChildEvent event;
  while ((event = supervisor.Wait()).kind == Kind::kRestarted) delays.push_back(event.delay_ns);
  EXPECT_EQ(event.kind, Kind::kEnded);
  EXPECT_EQ(delays, (std::vector<int64_t>{0, 20'000'000, 40'000'000}));
}

TEST(SupervisorTest, WhoWasSupersededAndThenFindsAnotherYields) {
  Supervisor supervisor(Eager());
  const std::string first = testing::TempDir() + "/dmslam_yields_" + std::to_string(getpid());
  supervisor.Start(Shell("mapper", "[ -e " + first + " ] && exit 3; touch " + first + "; exit 4"));
  EXPECT_EQ(supervisor.Wait().kind, Kind::kRestarted);
  const ChildEvent event = supervisor.Wait();
  EXPECT_EQ(event.kind, Kind::kEnded);
  EXPECT_EQ(event.code, kExitPresent);
  EXPECT_TRUE(event.yields);
  std::filesystem::remove(first);
}

TEST(SupervisorTest, KillsWhoHangsAndStartsItAgain) {
  Supervisor::Options options = Eager();
  options.watchdog_ns = 200'000'000;
  Supervisor supervisor(options);
  supervisor.Start(Sleeper("silent"));  // has never spoken: nobody expects it to
  // Says that it is alive once, and then hangs.
  supervisor.Start(Program("hangs", {"python3", "-c",
                                     "import os, socket, time\n"
                                     "s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)\n"
                                     "s.sendto(b'WATCHDOG=1', '\\0' + os.environ['NOTIFY_SOCKET'][1:])\n"
                                     "time.sleep(1000)"}));
  const ChildEvent event = supervisor.Wait(Supervisor::now_ns() + 20 * kSecondNs);
  EXPECT_EQ(event.kind, Kind::kRestarted);
  EXPECT_EQ(event.name, "hangs");
  EXPECT_TRUE(event.hung);
  EXPECT_TRUE(supervisor.Alive("silent"));
}

TEST(SupervisorTest, StopsAllAndKillsWhoDoesNotListen) {
  Supervisor::Options options = Eager();
  options.stop_ns = 300'000'000;
  Supervisor supervisor(options);
  supervisor.Start(Sleeper("willing"));
  supervisor.Start(Shell("deaf", "trap '' TERM; while :; do sleep 0.05; done"));
  supervisor.Start(Sleeper("stopped"));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  kill(supervisor.PidOf("stopped"), SIGSTOP);
  const int64_t began = Supervisor::now_ns();
  supervisor.StopAll();
  EXPECT_EQ(supervisor.size(), 0u);
  EXPECT_LT(Supervisor::now_ns() - began, 5 * kSecondNs);
}

TEST(SupervisorTest, ReportsWhoAsksItToStop) {
  Supervisor supervisor(Eager());
  supervisor.Start(Sleeper("child"));
  kill(getpid(), SIGTERM);
  const ChildEvent event = supervisor.Wait();
  EXPECT_EQ(event.kind, Kind::kSignal);
  EXPECT_EQ(event.code, SIGTERM);
}

TEST(SupervisorTest, ItsChildrenEndWithIt) {
  const std::string file = testing::TempDir() + "/dmslam_orphan_" + std::to_string(getpid());
  const pid_t runner = fork();
  if (runner == 0) {
    Supervisor supervisor(Eager());
    ChildSpec child = Sleeper("child");
    child.pid_file = file;
    supervisor.Start(child);
    std::ofstream(file + ".ready") << "yes";
    supervisor.Wait();
    _exit(0);
  }
  while (!std::filesystem::exists(file + ".ready")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  pid_t child = 0;
  std::ifstream(file) >> child;
  ASSERT_GT(child, 0);
  kill(runner, SIGKILL);
  waitpid(runner, nullptr, 0);
  const auto gone = [&] {
    std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
    std::string id, name, state;
    return !(stat >> id >> name >> state) || state == "Z";
  };
  for (int i = 0; i < 400 && !gone(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(gone());
  std::filesystem::remove(file);
  std::filesystem::remove(file + ".ready");
}

TEST(SupervisorTest, AFolderThatWasRemovedIsMadeAgain) {
  const std::string folder = testing::TempDir() + "/dmslam_logs_" + std::to_string(getpid());
  Supervisor supervisor(Eager());
  ChildSpec child = Shell("child", "echo here; exit 0");
  child.output = folder + "/log/child.log";
  supervisor.Start(child);
  EXPECT_EQ(supervisor.Wait().code, 0);
  std::string said;
  std::ifstream(child.output) >> said;
  EXPECT_EQ(said, "here");
  std::filesystem::remove_all(folder);
}

/// The units start again what dmslam-run starts again.
TEST(ExitCodesTest, TheUnitsAgree) {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  if (source == nullptr) GTEST_SKIP() << "set DMSLAM_SOURCE_DIR";
  std::string expected = "RestartPreventExitStatus=";
  for (int code = 1; code < kExitSignal; ++code) {
    const bool known = code <= kExitNewerMap || code == kExitUsage || code == kExitInternal;
    if (known && !WorthRestarting(code)) expected += std::to_string(code) + " ";
  }
  expected.pop_back();
  for (const char* process : {"player", "frontend", "mapper", "loopcloser", "collector"}) {
    std::ifstream unit(std::string(source) + "/config/systemd/dmslam-" + process + "@.service");
    bool found = false;
    for (std::string line; std::getline(unit, line);) found = found || line == expected;
    EXPECT_TRUE(found) << process << " has no line " << expected;
  }
}

}  // namespace
}  // namespace dmslam
