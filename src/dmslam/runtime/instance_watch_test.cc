#include "dmslam/runtime/instance_watch.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

ProcessHealth Health(int32_t pid, double uptime_s) {
  ProcessHealth health;
  health.pid = pid;
  health.uptime_s = uptime_s;
  return health;
}
constexpr int64_t Seconds(double s) { return static_cast<int64_t>(s * 1e9); }

TEST(InstanceWatch, AnotherIdIsAnotherProcess) {
  InstanceWatch watch;
  EXPECT_TRUE(watch.IsNew(Health(10, 1), Seconds(1)));
  EXPECT_FALSE(watch.IsNew(Health(10, 2), Seconds(2)));
  EXPECT_TRUE(watch.IsNew(Health(11, 0.2), Seconds(3)));
  EXPECT_FALSE(watch.IsNew(Health(10, 2), Seconds(3.1))) << "a late word of the one before";
}

TEST(InstanceWatch, InContainersAllHaveTheSameId) {
  InstanceWatch watch;
  EXPECT_TRUE(watch.IsNew(Health(1, 30), Seconds(100)));
  EXPECT_FALSE(watch.IsNew(Health(1, 31), Seconds(101)));
  EXPECT_TRUE(watch.IsNew(Health(1, 0.5), Seconds(103)));
  EXPECT_FALSE(watch.IsNew(Health(1, 1.5), Seconds(104)));
  EXPECT_TRUE(watch.IsNew(Health(1, 0.1), Seconds(105)));
}

TEST(InstanceWatch, AStatusThatComesLateIsNoOtherProcess) {
  InstanceWatch watch;
  watch.IsNew(Health(1, 30), Seconds(100));
  watch.IsNew(Health(1, 31), Seconds(101));
  EXPECT_FALSE(watch.IsNew(Health(1, 30.5), Seconds(101.1)));
}

TEST(InstanceWatch, WhoIsKnownFromBeforeIsNotNew) {
  InstanceWatch watch;
  watch.Know(7, 0, {});
  EXPECT_FALSE(watch.IsNew(Health(7, 12), Seconds(1)));
}

TEST(InstanceWatch, WhoCameWhileNobodyListenedIsToldByWhatWasNoted) {
  const auto is_new = [](const InstanceWatch::Noted& noted, double uptime_s, int64_t epoch) {
    InstanceWatch watch;
    watch.Know(1, Seconds(100), noted);
    ProcessHealth health = Health(1, uptime_s);
    health.epoch = epoch;
    const bool counted = watch.IsNew(health, Seconds(101));
    health.uptime_s += 1;
    EXPECT_FALSE(watch.IsNew(health, Seconds(102))) << "it is counted once";
    return counted;
  };
  EXPECT_FALSE(is_new({30, 5}, 40, 5));
  EXPECT_TRUE(is_new({30, 5}, 40, 6)) << "it writes in another term";
  EXPECT_TRUE(is_new({30, 5}, 20, 0)) << "it has run for less, though for long";
  EXPECT_FALSE(is_new({30, 5}, 40, 0)) << "its term is not known yet";
  EXPECT_FALSE(is_new({30, {}}, 40, 6)) << "it had none when it was noted";
}

TEST(InstanceWatch, ItsMemoryIsBoundedAndKeepsTheNewest) {
  InstanceWatch watch;
  for (int32_t pid = 1; pid <= 1000; ++pid) EXPECT_TRUE(watch.IsNew(Health(pid, 1), Seconds(pid)));
  EXPECT_FALSE(watch.IsNew(Health(1000, 2), Seconds(1001)));
  EXPECT_TRUE(watch.IsNew(Health(1, 2), Seconds(1002))) << "forgotten";
}

}  // namespace
}  // namespace dmslam
