#include "collector/collector_place.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>

namespace dmslam {
namespace {

constexpr int64_t kSession = 7;
constexpr int64_t kOwn = 10, kLarger = 11, kSmaller = 9;
constexpr int64_t kSecondNs = 1'000'000'000;
using How = CollectorPlace::Yield::How;

class CollectorPlaceTest : public testing::Test {
 protected:
  void Make(bool takes_over, bool others_may_be = true) {
    place_.emplace(CollectorPlace::Setup{kOwn, others_may_be, takes_over}, 0);
  }
  /// Another collector speaks for a second, ten times.
  void Speak(int64_t id, int64_t from_ns) {
    for (int i = 0; i <= 10; ++i) {
      now_ns_ = from_ns + i * kSecondNs / 10;
      place_->Hear({id, "its name", kSession, now_ns_ / 1000}, now_ns_);
    }
  }
  std::optional<CollectorPlace::Yield> Yields() { return place_->TakeYield(kSession, now_ns_); }

  std::optional<CollectorPlace> place_;
  int64_t now_ns_ = 0;
};

TEST_F(CollectorPlaceTest, BeginsWhenNobodyWasHeardForAWhile) {
  Make(false);
  EXPECT_FALSE(place_->MayBegin(kSession, 0));
  EXPECT_EQ(place_->deadline_ns(0), OtherReaders::kListenNs);
  EXPECT_TRUE(place_->MayBegin(kSession, OtherReaders::kListenNs));
  EXPECT_EQ(place_->deadline_ns(OtherReaders::kListenNs), INT64_MAX);
}

TEST_F(CollectorPlaceTest, InASystemThatBeginsWithItNobodyElseIsThere) {
  Make(false, false);
  Speak(kSmaller, 0);
  EXPECT_TRUE(place_->MayBegin(kSession, 0));
  EXPECT_FALSE(Yields());
}

TEST_F(CollectorPlaceTest, WhoGoesOnBeginsAtOnceUnlessItTakesOver) {
  Make(false);
  place_->GoOn();
  EXPECT_TRUE(place_->MayBegin(kSession, 0));
  Make(true);
  place_->GoOn();
  EXPECT_FALSE(place_->MayBegin(kSession, 0));
}

TEST_F(CollectorPlaceTest, WhoComesLaterLeavesOrWaitsWhereItTakesOver) {
  Make(false);
  Speak(kLarger, 0);
  EXPECT_FALSE(place_->MayBegin(kSession, OtherReaders::kListenNs));
  ASSERT_TRUE(Yields());
  EXPECT_EQ(Yields()->how, How::kLeave);
  EXPECT_EQ(Yields()->other, "its name");
  EXPECT_FALSE(place_->TakeYield(kSession + 1, now_ns_)) << "of another session";
  Make(true);
  Speak(kLarger, 0);
  const auto yield = Yields();
  ASSERT_TRUE(yield);
  EXPECT_EQ(yield->how, How::kWait);
  EXPECT_FALSE(Yields()) << "it was told";
  EXPECT_FALSE(place_->MayBegin(kSession, now_ns_ + kSecondNs));
  EXPECT_TRUE(place_->MayBegin(kSession, now_ns_ + 4 * kSecondNs)) << "it has ended";
}

TEST_F(CollectorPlaceTest, OfTwoThatBeganTogetherTheLargerIdLeaves) {
  for (const int64_t other : {kLarger, kSmaller}) {
    Make(false);
    place_->OnBegun(0);
    Speak(other, 0);
    EXPECT_EQ(Yields().has_value(), other == kSmaller);
  }
}

TEST_F(CollectorPlaceTest, WhoBelievedToGoOnAfterTheOtherLeaves) {
  Make(false);
  place_->GoOn();
  place_->OnBegun(0);
  Speak(kLarger, 0);
  ASSERT_TRUE(Yields());
  EXPECT_EQ(Yields()->how, How::kLeave);
}

TEST_F(CollectorPlaceTest, WhoHasBeenAtWorkForAWhileStays) {
  Make(true);
  place_->OnBegun(0);
  EXPECT_EQ(place_->AtWorkNs(4 * kSecondNs), 4 * kSecondNs);
  Speak(kSmaller, 4 * kSecondNs);
  EXPECT_FALSE(Yields());
}

}  // namespace
}  // namespace dmslam
