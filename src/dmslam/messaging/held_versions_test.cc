#include "dmslam/messaging/held_versions.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int32_t kWholeSnapshot =
    int32_t{RecordHeader::FLAG_SNAPSHOT} | int32_t{RecordHeader::FLAG_SNAPSHOT_LAST};

Record MakeRecord(int64_t epoch, int64_t seq, int32_t flags = 0, int64_t parent_seq = 0) {
  Record record;
  record.header.epoch = epoch;
  record.header.seq = seq;
  record.header.flags = flags;
  record.header.parent_seq = parent_seq;
  return record;
}

TEST(HeldVersions, WhatIsTakenIsHeldAndWhatIsHeldMayBeAccepted) {
  HeldVersions versions({3, 7});
  EXPECT_EQ(versions.held(), (Version{3, 7}));
  EXPECT_EQ(versions.accepted(), (Version{3, 7}));
  versions.Take(MakeRecord(3, 8));
  EXPECT_EQ(versions.held(), (Version{3, 8}));
  EXPECT_EQ(versions.taken(), (Version{3, 8}));
  EXPECT_EQ(versions.accepted(), (Version{3, 7}));
  versions.Accept({3, 9}, 3);
  EXPECT_EQ(versions.AcceptedOf(3), 7) << "nobody holds it";
  versions.Accept({3, 8}, 3);
  EXPECT_EQ(versions.AcceptedOf(3), 8);
  versions.Accept({3, 7}, 3);
  EXPECT_EQ(versions.AcceptedOf(3), 8) << "what is safe stays safe";
  EXPECT_EQ(versions.AcceptedOf(4), 0);
}

TEST(HeldVersions, WhatIsAcceptedCountsForTheEpochThatIsFollowed) {
  HeldVersions versions({5, 7});
  versions.Take(MakeRecord(6, 1));
  versions.Accept({5, 7}, 6);
  EXPECT_EQ(versions.accepted(), (Version{5, 7}));
  EXPECT_EQ(versions.AcceptedOf(6), 0);
  versions.Accept({6, 1}, 6);
  EXPECT_EQ(versions.accepted(), (Version{6, 1}));
  // All died, and began again on a clock that is behind.
  versions.Take(MakeRecord(4, 1, RecordHeader::FLAG_FRESH));
  versions.Accept({4, 1}, 4);
  EXPECT_EQ(versions.accepted(), (Version{4, 1}));
}

TEST(HeldVersions, APartIsTakenButNotHeld) {
  HeldVersions versions({3, 7});
  versions.Take(MakeRecord(3, 8));
  versions.KeepHeld();
  versions.Take(MakeRecord(3, 9));
  versions.KeepHeld();
  EXPECT_EQ(versions.held(), (Version{3, 7}));
  EXPECT_EQ(versions.taken(), (Version{3, 9}));
  versions.Take(MakeRecord(3, 10));
  EXPECT_EQ(versions.held(), (Version{3, 10}));
}

TEST(HeldVersions, APartThatBeginsAnewLeavesNothingHeld) {
  HeldVersions versions({3, 7});
  versions.Take(MakeRecord(4, 1, RecordHeader::FLAG_FRESH));
  versions.KeepHeld();
  EXPECT_TRUE(versions.held().empty());
}

TEST(HeldVersions, ADoubtedRecordWasNotTaken) {
  HeldVersions versions({3, 7});
  versions.Take(MakeRecord(4, 1, RecordHeader::FLAG_FRESH));
  versions.PutBack();
  EXPECT_EQ(versions.held(), (Version{3, 7})) << "also where it began anew";
  EXPECT_EQ(versions.taken(), (Version{3, 7}));
  versions.Take(MakeRecord(3, 8));
  versions.KeepHeld();
  versions.Take(MakeRecord(3, 9));
  versions.PutBack();
  EXPECT_EQ(versions.held(), (Version{3, 7}));
  EXPECT_EQ(versions.taken(), (Version{3, 8}));
}

TEST(HeldVersions, InsideASnapshotNothingIsHeld) {
  HeldVersions versions({3, 7});
  versions.Take(MakeRecord(4, 1, RecordHeader::FLAG_SNAPSHOT, 50));
  versions.Unaccept();
  EXPECT_TRUE(versions.held().empty());
  EXPECT_TRUE(versions.accepted().empty());
  versions.Take(MakeRecord(4, 2, kWholeSnapshot, 50));
  EXPECT_EQ(versions.held(), (Version{4, 50}));
  versions.Forget();
  EXPECT_TRUE(versions.held().empty());
  EXPECT_TRUE(versions.taken().empty());
}

}  // namespace
}  // namespace dmslam
