#include "dmslam/runtime/other_readers.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

class OtherReadersTest : public testing::Test {
 protected:
  /// `reader` says it at `ms`, by its own clock and by that of who hears it.
  void Hear(int64_t reader, int64_t ms, int64_t session = 1) { HearSaid(reader, ms, ms, session); }
  void HearSaid(int64_t reader, int64_t said_ms, int64_t ms, int64_t session = 1) {
    others_.Hear({reader, "reader " + std::to_string(reader), session, said_ms * 1000}, ms * kMs);
  }
  std::string Found(int64_t ms, int64_t session = 1) const {
    const auto found = others_.Find(session, ms * kMs);
    return found ? found->name : "";
  }

  OtherReaders others_{7};
};

TEST_F(OtherReadersTest, WhoSpeaksOnceASecondIsThereUntilItIsSilent) {
  Hear(8, 0);
  EXPECT_EQ(Found(900), "") << "once is not enough";
  Hear(8, 1010);
  EXPECT_EQ(Found(1010), "reader 8");
  EXPECT_EQ(Found(2900), "reader 8");
  EXPECT_EQ(Found(3100), "") << "it is gone";
}

TEST_F(OtherReadersTest, ItselfAndThoseOfOtherSessionsDoNotCount) {
  for (const int64_t ms : {0, 500, 1000}) {
    Hear(7, ms);
    Hear(8, ms, 2);
  }
  EXPECT_EQ(Found(1000), "");
  EXPECT_EQ(Found(1000, 2), "reader 8");
}

TEST_F(OtherReadersTest, EchoesOfADeadOneAndCopiesDoNotCount) {
  for (int64_t ms = 0; ms <= 100; ms += 10) Hear(8, ms);
  EXPECT_EQ(Found(200), "");
  for (int64_t ms = 200; ms <= 1000; ms += 100) HearSaid(8, 50, ms);
  EXPECT_EQ(Found(1000), "") << "the same word again and again";
}

TEST_F(OtherReadersTest, WhoComesBackIsThereWhenItHasSpokenForAWhileAgain) {
  Hear(8, 0);
  Hear(8, 5000);
  EXPECT_EQ(Found(5000), "");
  Hear(8, 5600);
  EXPECT_EQ(Found(5600), "reader 8");
}

TEST_F(OtherReadersTest, NoiseDoesNotHideWhoIsThere) {
  for (int64_t ms = 0; ms <= 1000; ms += 100) {
    Hear(8, ms);
    for (int64_t id = 0; id < 10; ++id) Hear(1000 + ms + id, ms);
  }
  EXPECT_EQ(Found(1000), "reader 8");
}

}  // namespace
}  // namespace dmslam
