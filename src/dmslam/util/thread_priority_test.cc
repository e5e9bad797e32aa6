// Which threads wait where cores are short.
#include "dmslam/util/thread_priority.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <thread>

namespace dmslam {
namespace {

int Niceness() { return getpriority(PRIO_PROCESS, 0); }

TEST(ThreadPriority, AThreadAndThoseThatItStartsWaitForOthers) {
  const int before = Niceness();
  int of_thread = 0, of_started = 0;
  std::thread([&] {
    LetOthersGoFirst();
    of_thread = Niceness();
    std::thread([&] { of_started = Niceness(); }).join();
  }).join();
  EXPECT_EQ(of_thread, std::min(before + kNicer, 19)) << "19 is the lowest priority";
  EXPECT_EQ(of_started, of_thread);
  EXPECT_EQ(Niceness(), before) << "who started it does not";
}

}  // namespace
}  // namespace dmslam
