#include "run/supervisor.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "dmslam/runtime/exit_codes.h"
#include "dmslam/util/check.h"

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
/// A program that can talk to who started it: notify("READY=1").
ChildSpec Python(const std::string& name, const std::string& script) {
  return Program(name, {"python3", "-c",
                        "import os, signal, socket\n"
                        "def notify(text):\n"
                        "  s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)\n"
                        "  s.sendto(text.encode(), '\\0' + os.environ['NOTIFY_SOCKET'][1:])\n" +
                            script});
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

/// As where somebody forges who asks for its place again and again.
TEST(SupervisorTest, GivesUpOnWhoIsSupersededAgainAndAgain) {
  Supervisor::Options options = Eager();
  options.most_short_lives = 3;
  options.short_life_ns = 1;
  Supervisor supervisor(options);
  supervisor.Start(Shell("child", "exit 4"));
  int restarts = 0;
  ChildEvent event;
  while ((event = supervisor.Wait()).kind == Kind::kRestarted && restarts < 10) ++restarts;
  EXPECT_EQ(restarts, 3);
  EXPECT_EQ(event.kind, Kind::kEnded);
  EXPECT_EQ(event.code, kExitSuperseded);
  EXPECT_FALSE(event.yields);
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
  supervisor.Start(Python("hangs", "notify('WATCHDOG=1')\nsignal.pause()\n"));
  const ChildEvent event = supervisor.Wait(Supervisor::now_ns() + 20 * kSecondNs);
  EXPECT_EQ(event.kind, Kind::kRestarted);
  EXPECT_EQ(event.name, "hangs");
  EXPECT_TRUE(event.hung);
  EXPECT_TRUE(supervisor.Alive("silent"));
}

TEST(SupervisorTest, KillsWhoHangsBeforeItsFirstWord) {
  Supervisor::Options options = Eager();
  options.watchdog_ns = 100'000'000;
  options.first_word_ns = 400'000'000;
  Supervisor supervisor(options);
  ChildSpec ours = Sleeper("ours");
  ours.speaks = true;
  supervisor.Start(Sleeper("foreign"));
  const int64_t begun_ns = Supervisor::now_ns();
  supervisor.Start(ours);
  const ChildEvent event = supervisor.Wait(begun_ns + 20 * kSecondNs);
  EXPECT_EQ(event.kind, Kind::kRestarted);
  EXPECT_EQ(event.name, "ours");
  EXPECT_TRUE(event.hung);
  EXPECT_GE(Supervisor::now_ns() - begun_ns, options.first_word_ns) << "it has longer to begin";
  EXPECT_TRUE(supervisor.Alive("foreign"));
}

TEST(SupervisorTest, StopsAllAndKillsWhoDoesNotListen) {
  Supervisor::Options options = Eager();
  options.stop_ns = 300'000'000;
  Supervisor supervisor(options);
  supervisor.Start(Sleeper("willing"));
  supervisor.Start(Python("deaf",
                          "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
                          "notify('READY=1\\nSTATUS=hears nothing')\n"
                          "while True: signal.pause()\n"));
  supervisor.Start(Sleeper("stopped"));
  const ChildEvent ready = supervisor.Wait(Supervisor::now_ns() + 20 * kSecondNs);
  ASSERT_EQ(ready.kind, Kind::kReady);
  EXPECT_EQ(ready.name, "deaf");
  EXPECT_EQ(ready.text, "hears nothing");
  kill(supervisor.PidOf("stopped"), SIGSTOP);
  const int64_t began = Supervisor::now_ns();
  supervisor.StopAll();
  EXPECT_EQ(supervisor.size(), 0u);
  EXPECT_LT(Supervisor::now_ns() - began, 5 * kSecondNs);
}

TEST(SupervisorTest, WhoIsAtItsLastWorkHasTimeForIt) {
  Supervisor::Options options = Eager();
  options.stop_ns = options.watchdog_ns = 300'000'000;
  Supervisor supervisor(options);
  const std::string done = ::testing::TempDir() + "last_work_" + std::to_string(getpid());
  supervisor.Start(Python("collector",
                          "import time\n"
                          "def work(*_):\n"
                          "  notify('STOPPING=1')\n"
                          "  time.sleep(1.5)\n"
                          "  open('" +
                              done +
                              "', 'w').close()\n"
                              "  os._exit(0)\n"
                              "signal.signal(signal.SIGTERM, work)\n"
                              "notify('READY=1')\n"
                              "while True:\n"
                              "  notify('WATCHDOG=1')\n"
                              "  time.sleep(0.02)\n"));
  ASSERT_EQ(supervisor.Wait(Supervisor::now_ns() + 20 * kSecondNs).kind, Kind::kReady);
  supervisor.StopAll();
  EXPECT_TRUE(std::filesystem::remove(done)) << "it was killed";
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
  int channel[2];
  ASSERT_EQ(pipe2(channel, O_CLOEXEC), 0);
  const pid_t runner = fork();
  if (runner == 0) {
    Supervisor supervisor(Eager());
    supervisor.Start(Sleeper("child"));
    const pid_t child = supervisor.PidOf("child");
    (void)!write(channel[1], &child, sizeof(child));
    supervisor.Wait();
    _exit(0);
  }
  pid_t child = 0;
  ASSERT_EQ(read(channel[0], &child, sizeof(child)), static_cast<ssize_t>(sizeof(child)));
  const int child_fd = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  ASSERT_GE(child_fd, 0);
  kill(runner, SIGKILL);
  waitpid(runner, nullptr, 0);
  pollfd end{child_fd, POLLIN, 0};
  EXPECT_EQ(poll(&end, 1, 10'000), 1) << "it lives on";
  for (const int fd : {child_fd, channel[0], channel[1]}) close(fd);
}

TEST(SupervisorTest, StartsWhoComesAfterOthersWhenAllAreReady) {
  Supervisor supervisor(Eager());
  supervisor.Start(Python("mapper", "notify('READY=1')\nsignal.pause()\n"));
  ChildSpec player = Sleeper("player");
  player.after = {"mapper", "frontend"};
  supervisor.Start(player);
  EXPECT_EQ(supervisor.Wait(Supervisor::now_ns() + 20 * kSecondNs).kind, Kind::kReady);
  EXPECT_FALSE(supervisor.Alive("player")) << "there is no frontend yet";
  EXPECT_EQ(supervisor.size(), 2u);
  supervisor.Start(Python("frontend", "notify('READY=1')\nsignal.pause()\n"));
  EXPECT_EQ(supervisor.Wait(Supervisor::now_ns() + 20 * kSecondNs).name, "frontend");
  EXPECT_TRUE(supervisor.Alive("player"));
}

TEST(SupervisorTest, WhoStillWaitsForOthersIsNotStartedWhenAllAreStopped) {
  Supervisor supervisor(Eager());
  ChildSpec player = Sleeper("player");
  player.after = {"mapper"};
  supervisor.Start(player);
  EXPECT_EQ(supervisor.size(), 1u);
  supervisor.StopAll();
  EXPECT_EQ(supervisor.size(), 0u);
}

TEST(SupervisorTest, ANameCanBeGivenAgainAfterItsEnd) {
  Supervisor supervisor(Eager());
  supervisor.Start(Shell("child", "exit 0"));
  EXPECT_EQ(supervisor.Wait().kind, Kind::kEnded);
  supervisor.Start(Sleeper("child"));
  EXPECT_TRUE(supervisor.Alive("child"));
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

TEST(SupervisorTest, ABrokenPipeEndsNobodyButAChildThatAskedForNothingElse) {
  std::signal(SIGPIPE, SIG_DFL);
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  close(ends[0]);
  Supervisor supervisor(Eager());
  EXPECT_EQ(write(ends[1], "text", 4), -1) << "and we are alive to see it";
  close(ends[1]);
  ChildSpec child = Shell("a", "kill -PIPE $$; exit 0");
  child.restart = false;
  supervisor.Start(child);
  EXPECT_EQ(supervisor.Wait(Supervisor::now_ns() + 10 * kSecondNs).code, kExitSignal + SIGPIPE)
      << "children are as they would be without it";
}

/// A machine without room for another process, for a while.
int forks_left = 0;
pid_t ForkWhileThereIsRoom() {
  if (forks_left-- > 0) return fork();
  if (forks_left < -3) forks_left = 1;
  errno = EAGAIN;
  return -1;
}

TEST(SupervisorTest, WhoCannotBeStartedAgainNowIsTriedAgain) {
  Supervisor::Options options = Eager();
  options.fork = ForkWhileThereIsRoom;
  Supervisor supervisor(options);
  forks_left = 0;
  EXPECT_THROW(supervisor.Start(Sleeper("never")), InputError);
  forks_left = 1;
  supervisor.Start(Sleeper("a"));
  KillTogether(supervisor, {"a"});
  int deaths = 0;
  EXPECT_TRUE(AllAlive(supervisor, {"a"}, &deaths));
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
