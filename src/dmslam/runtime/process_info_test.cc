#include "dmslam/runtime/process_info.h"

#include <gtest/gtest.h>

#include "dmslam/messaging/event_loop.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

TEST(ProcessorShareTest, IsOfOneCoreSinceItWasLastAsked) {
  ProcessorShare share;
  EXPECT_EQ(share.Percent(7000 * kMs, 1000 * kMs), 0) << "what was before is not known";
  EXPECT_EQ(share.Percent(7250 * kMs, 2000 * kMs), 25);
  EXPECT_EQ(share.Percent(7251 * kMs, 2001 * kMs), 25) << "asked again at once";
  EXPECT_EQ(share.Percent(9250 * kMs, 3000 * kMs), 200) << "two threads";
}

TEST(MeasureProcessTest, SaysWhatThisProcessUses) {
  MeasureProcess();
  volatile uint64_t work = 0;
  for (const int64_t end_ns = EventLoop::now_ns() + 600 * kMs; EventLoop::now_ns() < end_ns;) work = work + 1;
  const ProcessHealth health = MeasureProcess();
  EXPECT_GT(health.cpu_percent, 1) << "it did nothing else";
  EXPECT_GT(health.rss_mb, 1);
}

}  // namespace
}  // namespace dmslam
