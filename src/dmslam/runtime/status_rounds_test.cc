#include "dmslam/runtime/status_rounds.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

TEST(StatusRounds, AStatusIsDueAtOnceAndThenOnceASecond) {
  StatusRounds rounds;
  EXPECT_EQ(rounds.next_status_ns(), 0);
  EXPECT_TRUE(rounds.TakeStatus(100 * kSecond));
  EXPECT_FALSE(rounds.TakeStatus(100 * kSecond));
  EXPECT_EQ(rounds.next_status_ns(), 100 * kSecond + kStatusEveryNs);
  EXPECT_FALSE(rounds.TakeStatus(100 * kSecond + kStatusEveryNs - 1));
  EXPECT_TRUE(rounds.TakeStatus(100 * kSecond + kStatusEveryNs));
}

TEST(StatusRounds, TheMemoryIsTidiedOnceAMinuteAndNotAtTheBeginning) {
  StatusRounds rounds;
  int tidied = 0;
  for (int64_t s = 100; s < 100 + 59; ++s) tidied += rounds.TakeTidying(s * kSecond) ? 1 : 0;
  EXPECT_EQ(tidied, 0);
  for (int64_t s = 100 + 59; s < 100 + 180; ++s) tidied += rounds.TakeTidying(s * kSecond) ? 1 : 0;
  EXPECT_EQ(tidied, 2);
}

}  // namespace
}  // namespace dmslam
