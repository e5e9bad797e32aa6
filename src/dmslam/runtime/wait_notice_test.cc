#include "dmslam/runtime/wait_notice.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

TEST(WaitNotice, SaysItOnceAfterAWhile) {
  WaitNotice notice;
  EXPECT_FALSE(notice.Due("mapper", 10 * kSecond));
  EXPECT_FALSE(notice.Due("mapper", 11 * kSecond));
  EXPECT_EQ(notice.Due("mapper", 12 * kSecond), "waiting for mapper");
  EXPECT_FALSE(notice.Due("mapper", 13 * kSecond));
}

TEST(WaitNotice, SaysItAgainWhereOthersAreWaitedForOrTheSameAnew) {
  WaitNotice notice;
  EXPECT_FALSE(notice.Due("mapper, frontend", 0));
  EXPECT_TRUE(notice.Due("mapper, frontend", 2 * kSecond));
  EXPECT_FALSE(notice.Due("mapper", 3 * kSecond));
  EXPECT_EQ(notice.Due("mapper", 5 * kSecond), "waiting for mapper");
  EXPECT_FALSE(notice.Due("", 6 * kSecond));
  EXPECT_FALSE(notice.Due("mapper", 7 * kSecond));
  EXPECT_TRUE(notice.Due("mapper", 9 * kSecond));
}

TEST(WaitNotice, OfAMomentNothingIsSaid) {
  WaitNotice notice;
  for (int64_t s = 0; s < 10; s += 2) {
    EXPECT_FALSE(notice.Due("mapper", s * kSecond));
    EXPECT_FALSE(notice.Due("", (s + 1) * kSecond));
  }
}

}  // namespace
}  // namespace dmslam
