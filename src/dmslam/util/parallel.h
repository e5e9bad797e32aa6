#pragma once

#include <algorithm>
#include <cstddef>
#include <future>
#include <vector>

namespace dmslam {

/// Calls `work(i)` for each i below `count` on so many threads, the caller's among them, and waits for all.
/// Each thread takes a run of neighbours. What is done for one i must not depend on what is done for another:
/// then the results are the same whatever the number of threads. Throws what `work` has thrown.
template <typename Work>
void ForEachInParallel(size_t count, int threads, const Work& work) {
  const size_t runs = std::min(count, static_cast<size_t>(std::max(threads, 1)));
  const auto run = [&](size_t number) {
    for (size_t i = number * count / runs; i < (number + 1) * count / runs; ++i) work(i);
  };
  std::vector<std::future<void>> others;
  for (size_t number = 1; number < runs; ++number)
    others.push_back(std::async(std::launch::async, run, number));
  if (runs > 0) run(0);
  for (std::future<void>& other : others) other.get();
}

}  // namespace dmslam
