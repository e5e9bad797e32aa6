#include "frontend/held_records.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

struct Records {
  HeldRecords held;
  int64_t seq = 0;

  void Say(MapEvent event, bool in_snapshot = false, bool ends_snapshot = false) {
    MapDelta delta;
    delta.event = event;
    held.Add(std::move(delta), {1, ++seq}, in_snapshot, ends_snapshot);
  }
};

TEST(HeldRecordsTest, InLockStepNothingBehindASettledRecordIsApplied) {
  Records records;
  records.Say(MapEvent::kLandmarksCreated);
  EXPECT_EQ(records.held.NumReady(false), 0u);
  EXPECT_EQ(records.held.NumReady(true), 1u);
  records.Say(MapEvent::kSettled);
  records.Say(MapEvent::kFused);
  EXPECT_EQ(records.held.NumReady(false), 2u);
  EXPECT_EQ(records.held.NumReady(true), 3u);
}

TEST(HeldRecordsTest, TheEndOfTheMapIsAppliedThoughWhatIsAwaitedWasNeverSettled) {
  Records records;
  records.Say(MapEvent::kFused);
  records.Say(MapEvent::kEnded);
  EXPECT_EQ(records.held.NumReady(false), 2u);
}

TEST(HeldRecordsTest, ASnapshotIsAppliedWhenAllOfItIsHere) {
  Records records;
  records.Say(MapEvent::kSettled);
  records.held.BeginAnew();
  records.Say(MapEvent::kSettled, true);
  records.Say(MapEvent::kSettled, true);
  EXPECT_EQ(records.held.NumReady(true), 0u) << "and what was held before is void";
  records.Say(MapEvent::kSettled, true, true);
  ASSERT_EQ(records.held.NumReady(true), 3u);
  EXPECT_TRUE(records.held[0].begins_anew);
  EXPECT_FALSE(records.held[1].begins_anew);
}

TEST(HeldRecordsTest, WhatIsPromisedIsAppliedLater) {
  Records records;
  records.Say(MapEvent::kSettled);
  records.Say(MapEvent::kSettled);
  records.held.Promise(2);
  EXPECT_FALSE(records.held.IsUpToDate());
  EXPECT_EQ(records.held.PopApplied().version, (Version{1, 1}));
  EXPECT_FALSE(records.held.IsUpToDate());
  records.held.PopApplied();
  EXPECT_TRUE(records.held.IsUpToDate());
  records.Say(MapEvent::kSettled);
  records.held.Promise(1);
  records.held.BeginAnew();
  EXPECT_TRUE(records.held.IsUpToDate()) << "what was promised is void";
  EXPECT_EQ(records.held.applied(), (Version{1, 2}));
}

}  // namespace
}  // namespace dmslam
