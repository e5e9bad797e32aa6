#include "frontend/background_search.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "dmslam/util/thread_priority.h"

namespace dmslam {
namespace {

/// Lets a test hold the search at a frame.
class Gate {
 public:
  void Open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  void Pass() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return open_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
};

InitializerReport Found(const InitializerFrame& frame) {
  InitializerReport report;
  report.wait = WaitReason::kNone;
  report.result.emplace();
  report.result->frame1 = frame;
  return report;
}

/// Offers frames until the search has answered with a map.
InitializerReport OfferUntilFound(BackgroundSearch* background, uint32_t first) {
  for (uint32_t index = first;; ++index) {
    InitializerReport report = background->AddFrame({index, 0, nullptr});
    if (report.result) return report;
    std::this_thread::yield();
  }
}

TEST(BackgroundSearch, TellsLaterWhatItFound) {
  Gate begun;
  BackgroundSearch background([&begun](const InitializerFrame& frame) {
    begun.Open();
    return frame.index == 0 ? Found(frame) : InitializerReport();
  });
  EXPECT_FALSE(background.AddFrame({0, 0, nullptr}).result);
  begun.Pass();  // else those that are offered next push it out
  EXPECT_EQ(OfferUntilFound(&background, 1).result->frame1.index, 0u);
}

TEST(BackgroundSearch, BeginsAnewBehindAMap) {
  std::vector<uint32_t> seen;  // by one thread at a time: the search is asked under its lock's order
  Gate first, second;
  BackgroundSearch background([&](const InitializerFrame& frame) {
    seen.push_back(frame.index);
    (seen.size() == 1 ? first : second).Open();
    return frame.index % 100 == 0 ? Found(frame) : InitializerReport();
  });
  background.AddFrame({0, 0, nullptr});
  first.Pass();
  OfferUntilFound(&background, 1);
  EXPECT_EQ(seen, std::vector<uint32_t>{0});  // what waited meanwhile belongs to the map that was found
  background.AddFrame({100, 0, nullptr});
  second.Pass();
  EXPECT_EQ(OfferUntilFound(&background, 101).result->frame1.index, 100u);
  EXPECT_EQ(seen, (std::vector<uint32_t>{0, 100}));
}

TEST(BackgroundSearch, NobodyWaitsAndWhatIsASecondOldIsLeftOut) {
  Gate gate;
  BackgroundSearch background([&gate](const InitializerFrame& frame) {
    gate.Pass();
    return frame.index > 50 ? Found(frame) : InitializerReport();
  });
  for (uint32_t index = 0; index < 100; ++index)
    EXPECT_FALSE(background.AddFrame({index, index * int64_t{33'333'333}, nullptr}).result);
  gate.Open();
  EXPECT_EQ(OfferUntilFound(&background, 100).result->frame1.index, 69u) << "a second before the newest";
}

TEST(BackgroundSearch, ASearchThatDoesNotEndIsSeen) {
  Gate begun, gate;
  const auto sign = std::make_shared<WorkSign>();
  BackgroundSearch background(
      [&](const InitializerFrame& frame) {
        begun.Open();
        gate.Pass();
        return Found(frame);
      },
      sign);
  EXPECT_FALSE(sign->Hangs(INT64_MAX, 0)) << "there is nothing to search";
  background.AddFrame({0, 0, nullptr});
  begun.Pass();
  EXPECT_TRUE(sign->Hangs(INT64_MAX, 0));
  gate.Open();
  OfferUntilFound(&background, 1);
  EXPECT_FALSE(sign->Hangs(INT64_MAX, 0));
}

TEST(BackgroundSearch, LetsFramesGoFirst) {
  const auto niceness = [] { return getpriority(PRIO_PROCESS, 0); };
  Gate searched;
  int of_search = 0;
  BackgroundSearch background([&](const InitializerFrame&) {
    of_search = niceness();
    searched.Open();
    return InitializerReport();
  });
  background.AddFrame({0, 0, nullptr});
  searched.Pass();
  EXPECT_EQ(of_search, std::min(niceness() + kNicer, 19));
}

TEST(BackgroundSearch, PassesProblemsOn) {
  BackgroundSearch background(
      [](const InitializerFrame&) -> InitializerReport { throw std::runtime_error("no such thing"); });
  background.AddFrame({0, 0, nullptr});
  EXPECT_THROW(OfferUntilFound(&background, 1), std::runtime_error);
}

TEST(BackgroundSearch, EndsWithFramesWaiting) {
  Gate gate;
  std::optional<BackgroundSearch> background;
  background.emplace([&gate](const InitializerFrame&) {
    gate.Pass();
    return InitializerReport();
  });
  for (uint32_t index = 0; index < 10; ++index) background->AddFrame({index, 0, nullptr});
  gate.Open();
  background.reset();
}

}  // namespace
}  // namespace dmslam
