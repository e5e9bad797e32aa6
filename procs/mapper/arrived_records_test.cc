#include "mapper/arrived_records.h"

#include <gtest/gtest.h>

#include "dmslam/wire/channels.h"

namespace dmslam {
namespace {

class ArrivedRecordsTest : public testing::Test {
 protected:
  void Add(const char* channel, CameraId camera = 0, int64_t at_ns = 0) {
    Record record;
    record.channel = channel;
    records_.Add({camera, record, at_ns});
  }
  void AddPoses(size_t count) {
    for (size_t i = 0; i < count; ++i) Add(channels::kFramePose);
  }

  ArrivedRecords records_;
};

TEST_F(ArrivedRecordsTest, AreHandledInTheOrderInWhichTheyCameWhenTheCoreIsIdle) {
  Add(channels::kSession, 0, 10);
  Add(channels::kFramePose, 1, 20);
  EXPECT_TRUE(records_.NoneIsDue()) << "the core works";
  records_.MakeDue();
  Add(channels::kFrameEvidence, 0, 30);
  EXPECT_EQ(records_.size(), 3U);
  EXPECT_EQ(records_.TakeFirst().at_ns, 10);
  const ArrivedRecords::Arrived second = records_.TakeFirst();
  EXPECT_EQ(second.camera, 1U);
  EXPECT_EQ(second.at_ns, 20) << "when it came, not when it was due";
  EXPECT_EQ(second.record.channel, channels::kFramePose);
  EXPECT_TRUE(records_.NoneIsDue());
  EXPECT_EQ(records_.size(), 1U);
  Add(channels::kFrameEvidence, 0, 40);
  records_.MakeDue();
  Add(channels::kFrameEvidence, 0, 50);
  records_.MakeDue();
  for (const int64_t at_ns : {30, 40, 50}) EXPECT_EQ(records_.TakeFirst().at_ns, at_ns);
  EXPECT_EQ(records_.size(), 0U);
}

TEST_F(ArrivedRecordsTest, AKeyframeThatIsDueIsUrgent) {
  Add(channels::kFramePose);
  Add(channels::kKeyframe);
  EXPECT_FALSE(records_.AreUrgent(0)) << "it came while the core worked";
  records_.MakeDue();
  EXPECT_TRUE(records_.AreUrgent(0));
  records_.TakeFirst();
  EXPECT_TRUE(records_.AreUrgent(0));
  records_.TakeFirst();
  EXPECT_FALSE(records_.AreUrgent(0));
}

TEST_F(ArrivedRecordsTest, MoreThanSixtyThatHaveComeSinceAreUrgent) {
  AddPoses(100);
  records_.MakeDue();
  EXPECT_FALSE(records_.AreUrgent(60)) << "what is due is being handled";
  EXPECT_TRUE(records_.AreUrgent(61));
  AddPoses(20);
  EXPECT_FALSE(records_.AreUrgent(40)) << "wherever they wait";
  EXPECT_TRUE(records_.AreUrgent(41));
}

}  // namespace
}  // namespace dmslam
