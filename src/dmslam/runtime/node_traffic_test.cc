#include "dmslam/runtime/node_traffic.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

TEST(NodeTraffic, KnowsWhatItListensTo) {
  NodeTraffic traffic;
  traffic.Listen("DMSLAM_A");
  traffic.Listen("DMSLAM_B");
  EXPECT_TRUE(traffic.IsListenedTo("DMSLAM_B"));
  EXPECT_FALSE(traffic.IsListenedTo("DMSLAM_"));
  EXPECT_EQ(traffic.channels(), (std::vector<std::string>{"DMSLAM_A", "DMSLAM_B"}));
}

TEST(NodeTraffic, CountsAllAndTellsTheFirstOfEachMatter) {
  NodeTraffic traffic;
  EXPECT_TRUE(traffic.DropMalformed("DMSLAM_A"));
  EXPECT_FALSE(traffic.DropMalformed("DMSLAM_A"));
  EXPECT_TRUE(traffic.DropMalformed("DMSLAM_B"));
  EXPECT_TRUE(traffic.DropForeign());
  EXPECT_FALSE(traffic.DropForeign());
  EXPECT_TRUE(traffic.IsFirst("lost"));
  EXPECT_FALSE(traffic.IsFirst("lost"));
  traffic.OnReceived(100);
  traffic.OnReceived(11);

  ProcessHealth health;
  health.received = 5;
  health.dropped_foreign = 1;
  traffic.AddTo(&health);
  EXPECT_EQ(health.received, 7);
  EXPECT_EQ(health.received_bytes, 111);
  EXPECT_EQ(health.dropped_foreign, 3);
  EXPECT_EQ(health.dropped_malformed, 3);
}

TEST(NodeTraffic, RemembersHowManyRecordsHaveWaitedAtMost) {
  NodeTraffic traffic;
  traffic.NoteQueue(3);
  traffic.NoteQueue(9);
  traffic.NoteQueue(0);
  ProcessHealth health;
  traffic.AddTo(&health);
  EXPECT_EQ(health.queue_peak, 9);
  health.queue_depth = 12;
  traffic.AddTo(&health);
  EXPECT_EQ(health.queue_peak, 12) << "what waits now counts, too";
}

}  // namespace
}  // namespace dmslam
