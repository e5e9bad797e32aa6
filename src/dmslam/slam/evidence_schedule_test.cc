#include "dmslam/slam/evidence_schedule.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
using Way = EvidenceSchedule::Way;

TEST(EvidenceSchedule, IsDueFromTimeToTime) {
  EvidenceSchedule schedule(300 * kMs);
  EXPECT_FALSE(schedule.IsDueAt(5000 * kMs, false, Way::kForward)) << "nothing was said before";
  EXPECT_FALSE(schedule.IsDueAt(5299 * kMs, false, Way::kForward));
  EXPECT_TRUE(schedule.IsDueAt(5310 * kMs, false, Way::kForward));
  EXPECT_FALSE(schedule.IsDueAt(5600 * kMs, false, Way::kForward));
  EXPECT_TRUE(schedule.IsDueAt(5610 * kMs, false, Way::kForward));
}

TEST(EvidenceSchedule, IsDueBeforeEachKeyframeAndTheTimeIsCountedFromThere) {
  EvidenceSchedule schedule(300 * kMs);
  EXPECT_TRUE(schedule.IsDueAt(5000 * kMs, true, Way::kForward));
  EXPECT_TRUE(schedule.IsDueAt(5200 * kMs, true, Way::kForward));
  EXPECT_FALSE(schedule.IsDueAt(5400 * kMs, false, Way::kForward));
  EXPECT_TRUE(schedule.IsDueAt(5500 * kMs, false, Way::kForward));
}

TEST(EvidenceSchedule, WhereTimeRunsBackwardsItIsCountedApart) {
  EvidenceSchedule schedule(300 * kMs);
  EXPECT_TRUE(schedule.IsDueAt(9000 * kMs, true, Way::kForward));
  EXPECT_FALSE(schedule.IsDueAt(5000 * kMs, false, Way::kBack));
  EXPECT_FALSE(schedule.IsDueAt(4800 * kMs, false, Way::kBack));
  EXPECT_TRUE(schedule.IsDueAt(4700 * kMs, false, Way::kBack));
  EXPECT_FALSE(schedule.IsDueAt(9200 * kMs, false, Way::kForward));
  EXPECT_FALSE(schedule.IsDueAt(4500 * kMs, false, Way::kBack));
}

}  // namespace
}  // namespace dmslam
