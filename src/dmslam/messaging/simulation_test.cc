#include "dmslam/messaging/simulation.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace dmslam {
namespace {

// DMSLAM_SCHEDULES sets how many (the nightly run: 10,000), DMSLAM_FIRST_SCHEDULE where to begin.
int64_t FromEnvironment(const char* name, int64_t otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atoll(value);
}

TEST(Simulation, EverySchedulesPromisesAreKept) {
  const int64_t first = FromEnvironment("DMSLAM_FIRST_SCHEDULE", 1);
  const int64_t count = FromEnvironment("DMSLAM_SCHEDULES", 200);
  SimulationReport sum;
  for (int64_t seed = first; seed < first + count; ++seed) {
    const SimulationReport report = SimulateSchedule(static_cast<uint64_t>(seed));
    ASSERT_TRUE(report.failure.empty())
        << "schedule " << seed << " (" << report.conditions << "): " << report.failure;
    sum.published += report.published;
    sum.delivered += report.delivered;
    sum.confirmed += report.confirmed;
    sum.datagrams += report.datagrams;
    sum.parts_repaired += report.parts_repaired;
    sum.snapshots += report.snapshots;
    sum.hand_overs += report.hand_overs;
    sum.faults += report.faults;
    sum.forgeries += report.forgeries;
  }
  std::printf(
      "%ld schedules: %ld records, %ld delivered, %ld confirmed, %ld datagrams, %ld parts repaired, "
      "%ld snapshots, %ld hand-overs, %ld faults, %ld forgeries\n",
      static_cast<long>(count), static_cast<long>(sum.published), static_cast<long>(sum.delivered),
      static_cast<long>(sum.confirmed), static_cast<long>(sum.datagrams),
      static_cast<long>(sum.parts_repaired), static_cast<long>(sum.snapshots),
      static_cast<long>(sum.hand_overs), static_cast<long>(sum.faults), static_cast<long>(sum.forgeries));
  EXPECT_GT(sum.confirmed, 0);
  if (count >= 100) {  // the schedules really try what they are for
    EXPECT_GT(sum.parts_repaired, 1000);
    EXPECT_GT(sum.snapshots, 20);
    EXPECT_GT(sum.hand_overs, 20);
    EXPECT_GT(sum.forgeries, 100);
  }
}

TEST(Simulation, TheSameSeedGivesTheSameSchedule) {
  const SimulationReport a = SimulateSchedule(5), b = SimulateSchedule(5);
  EXPECT_EQ(a.datagrams, b.datagrams);
  EXPECT_EQ(a.delivered, b.delivered);
}

}  // namespace
}  // namespace dmslam
