#include "dmslam/runtime/core_thread.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "dmslam/messaging/event_loop.h"
#include "dmslam/util/thread_priority.h"

namespace dmslam {
namespace {

using Mode = CoreThread::Mode;

/// Posts three jobs that report twice each, and gives back what was said in which order.
std::string Conversation(Mode mode) {
  CoreThread core(mode);
  std::string said;
  for (const char name : {'a', 'b', 'c'}) {
    while (!core.HasRoom()) core.Deliver();
    core.Post([&core, &said, name] {
      for (const char number : {'1', '2'}) core.Report([&said, name, number] { said += {name, number}; });
    });
  }
  core.Finish();
  return said;
}

void AwaitAtLeast(int value, const std::atomic<int>& counter) {
  for (int now = counter; now < value; now = counter) counter.wait(now);
}

TEST(CoreThread, SaysTheSameInBothModes) {
  EXPECT_EQ(Conversation(Mode::kAtOnce), "a1a2b1b2c1c2");
  EXPECT_EQ(Conversation(Mode::kOwnThread), "a1a2b1b2c1c2");
}

TEST(CoreThread, IsNotIdleWhileAReportIsStillDue) {
  CoreThread core(Mode::kOwnThread);
  std::vector<bool> idle;
  core.Post([&] {
    core.Report([&] { idle.push_back(core.Idle()); });
    core.Report([&] { idle.push_back(core.Idle()); });
  });
  while (!core.HasRoom()) std::this_thread::yield();  // both are there to be delivered
  core.Deliver();
  EXPECT_EQ(idle, (std::vector<bool>{false, false}));
  EXPECT_TRUE(core.Idle());
}

TEST(CoreThread, LetsOthersGoFirstWhereItIsToldTo) {
  const auto niceness = [] { return getpriority(PRIO_PROCESS, 0); };
  const auto of_job = [&](const CoreThread::Options& options) {
    CoreThread core(Mode::kOwnThread, options);
    int found = 0;
    core.Post([&] { found = niceness(); });
    core.Finish();
    return found;
  };
  EXPECT_EQ(of_job({}), niceness());
  EXPECT_EQ(of_job({.lets_others_go_first = true}), std::min(niceness() + kNicer, 19));
}

TEST(CoreThread, AtOnceAJobIsDoneWhenItIsPosted) {
  CoreThread core(Mode::kAtOnce);
  const std::thread::id here = std::this_thread::get_id();
  std::thread::id there;
  core.Post([&] { core.Report([&] { there = std::this_thread::get_id(); }); });
  EXPECT_EQ(there, here);
  EXPECT_TRUE(core.Idle());
  EXPECT_TRUE(core.HasRoom());
  EXPECT_EQ(core.fd(), -1);
}

TEST(CoreThread, ThePosterGoesOnWhileAJobIsInWork) {
  CoreThread core(Mode::kOwnThread);
  std::atomic<bool> go_on = false;
  std::thread::id worker, reporter;
  core.Post([&] {
    while (!go_on) std::this_thread::yield();  // an adjustment that looks at its flag
    worker = std::this_thread::get_id();
    core.Report([&] { reporter = std::this_thread::get_id(); });
  });
  EXPECT_FALSE(core.HasRoom());
  EXPECT_FALSE(core.Idle());
  core.Deliver();
  go_on = true;
  core.Finish();
  EXPECT_NE(worker, std::this_thread::get_id());
  EXPECT_EQ(reporter, std::this_thread::get_id());
}

TEST(CoreThread, ItsDescriptorWakesThePoster) {
  CoreThread core(Mode::kOwnThread);
  pollfd readable{core.fd(), POLLIN, 0};
  EXPECT_EQ(poll(&readable, 1, 0), 0) << "nothing was said yet";
  bool heard = false;
  core.Post([&] { core.Report([&] { heard = true; }); });
  while (!heard) {
    ASSERT_EQ(poll(&readable, 1, 10000), 1);
    core.Deliver();
  }
  core.Finish();
  EXPECT_EQ(poll(&readable, 1, 0), 0);
}

TEST(CoreThread, AJobWaitsWhereTooMuchWasNotDelivered) {
  CoreThread core(Mode::kOwnThread, {1, 4});
  std::atomic<int> made = 0;
  int heard = 0;
  core.Post([&] {
    for (int i = 0; i < 100; ++i) {
      core.Report([&] { ++heard; });
      ++made;
      made.notify_one();
    }
  });
  for (int delivered = 0; delivered < 100; delivered += 4) {
    AwaitAtLeast(delivered + 4, made);
    EXPECT_LE(made, delivered + 4);
    core.Deliver();
    EXPECT_EQ(heard, delivered + 4);
  }
  core.Finish();
  EXPECT_EQ(heard, 100);
}

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kLongest = 10'000 * kMs;

/// Runs a job that says `beat` when it has begun, and again when it is let go on; then it waits to end.
struct WatchedJob {
  explicit WatchedJob(Mode mode = Mode::kOwnThread) : core(mode) {
    core.Post([this] {
      begun = 1;
      begun.notify_one();
      go_on.wait(0);
      core.Beat();
      beaten = 1;
      beaten.notify_one();
      end.wait(0);
    });
    AwaitAtLeast(1, begun);
  }
  ~WatchedJob() { LetEnd(); }
  void LetBeat() {
    go_on = 1;
    go_on.notify_one();
    AwaitAtLeast(1, beaten);
  }
  void LetEnd() {
    go_on = end = 1;
    go_on.notify_one();
    end.notify_one();
    core.Finish();
  }
  std::atomic<int> begun = 0, go_on = 0, beaten = 0, end = 0;
  CoreThread core;
};

TEST(CoreThread, AJobThatGivesNoSignHangs) {
  WatchedJob job;
  const int64_t begun_ns = EventLoop::now_ns();
  EXPECT_FALSE(job.core.Hangs(begun_ns, kLongest)) << "it has just begun";
  EXPECT_TRUE(job.core.Hangs(begun_ns + kLongest + kMs, kLongest));
  const int64_t later_ns = EventLoop::now_ns() + kLongest;
  EXPECT_TRUE(job.core.Hangs(later_ns, kLongest));
  job.LetBeat();
  EXPECT_FALSE(job.core.Hangs(later_ns, kLongest)) << "it goes on";
  EXPECT_TRUE(job.core.Hangs(EventLoop::now_ns() + kLongest + kMs, kLongest)) << "that was the last of it";
  job.LetEnd();
  EXPECT_FALSE(job.core.Hangs(INT64_MAX, kLongest)) << "there is nothing to do";
  job.core.Beat();
  EXPECT_FALSE(job.core.Hangs(INT64_MAX, kLongest)) << "said by nobody who works";
}

TEST(CoreThread, WhoWaitsForItsReportsToBeHeardDoesNotHang) {
  CoreThread core(Mode::kOwnThread, {1, 1});
  std::atomic<int> made = 0;
  core.Post([&] {
    for (int i = 0; i < 2; ++i) {
      core.Report([] {});
      ++made;
      made.notify_one();
    }
  });
  AwaitAtLeast(1, made);
  while (core.Hangs(INT64_MAX, 0)) std::this_thread::yield();  // until it waits with the second one
  EXPECT_EQ(made, 1);
  core.Finish();
  EXPECT_EQ(made, 2);
}

TEST(CoreThread, WhatRunsAtOnceIsWatchedByNobody) {
  CoreThread core(Mode::kAtOnce);
  bool hangs = true;
  core.Post([&] {
    core.Beat();
    core.Report([] {});
    hangs = core.Hangs(INT64_MAX, 0);
  });
  EXPECT_FALSE(hangs);
}

TEST(CoreThread, AnExceptionIsThrownAfterWhatWasSaidBeforeIt) {
  for (const Mode mode : {Mode::kAtOnce, Mode::kOwnThread}) {
    CoreThread core(mode);
    bool heard = false;
    const auto run = [&] {
      core.Post([&] {
        core.Report([&] { heard = true; });
        throw std::runtime_error("broken");
      });
      core.Finish();
    };
    EXPECT_THROW(run(), std::runtime_error);
    EXPECT_TRUE(heard);
    EXPECT_TRUE(core.Idle());
  }
}

TEST(CoreThread, EndsWhileAJobWaitsForItsReportsToBeHeard) {
  CoreThread core(Mode::kOwnThread, {1, 1});
  core.Post([&] {
    for (int i = 0; i < 10; ++i) core.Report([] { FAIL() << "nobody listens any more"; });
  });
  pollfd readable{core.fd(), POLLIN, 0};
  EXPECT_EQ(poll(&readable, 1, 10000), 1) << "the first report takes all the room there is";
}

}  // namespace
}  // namespace dmslam
