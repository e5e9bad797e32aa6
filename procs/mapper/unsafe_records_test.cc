#include "mapper/unsafe_records.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

TEST(UnsafeRecordsTest, AreAcceptedInOrderWhenTheMapRecordIsHeld) {
  UnsafeRecords records;
  int64_t held = 0;
  const auto take = [&] { return records.TakeSafe([&](int64_t map_seq) { return map_seq <= held; }); };
  EXPECT_FALSE(take());
  records.OnHandled({0, {1, 7}, 20});
  records.OnHandled({1, {1, 3}, 20});
  records.OnHandled({0, {1, 8}, 22});
  held = 19;
  EXPECT_FALSE(take());
  EXPECT_EQ(records.size(), 3U);
  held = 21;
  auto safe = take();
  ASSERT_TRUE(safe);
  EXPECT_EQ(safe->camera, 0U);
  EXPECT_EQ(safe->version, (Version{1, 7}));
  safe = take();
  ASSERT_TRUE(safe);
  EXPECT_EQ(safe->camera, 1U);
  EXPECT_EQ(safe->version, (Version{1, 3}));
  EXPECT_FALSE(take());
  EXPECT_EQ(records.size(), 1U);
}

}  // namespace
}  // namespace dmslam
