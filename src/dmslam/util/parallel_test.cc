#include "dmslam/util/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <numeric>
#include <stdexcept>

namespace dmslam {
namespace {

TEST(Parallel, EachIsDoneOnceWhateverTheNumberOfThreads) {
  for (const int threads : {-1, 0, 1, 2, 3, 8, 100}) {
    for (const size_t count : {0u, 1u, 2u, 7u, 64u}) {
      std::vector<int> done(count, 0);
      ForEachInParallel(count, threads, [&](size_t i) { ++done[i]; });
      EXPECT_EQ(done, std::vector<int>(count, 1)) << threads << " threads";
    }
  }
}

TEST(Parallel, ThreadsWorkAtTheSameTime) {
  std::barrier all_there(3);  // one after the other, the first would wait for ever
  ForEachInParallel(3, 3, [&](size_t) { all_there.arrive_and_wait(); });
}

TEST(Parallel, WhatIsThrownArrivesWhenAllHaveEnded) {
  for (const size_t bad : {0u, 9u}) {
    std::atomic<int> done = 0;
    const auto work = [&](size_t i) {
      if (i == bad) throw std::runtime_error("bad");
      ++done;
    };
    EXPECT_THROW(ForEachInParallel(10, 2, work), std::runtime_error);
    EXPECT_GE(done, 5) << "the other thread does its share";
  }
}

}  // namespace
}  // namespace dmslam
