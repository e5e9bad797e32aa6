#include "dmslam/runtime/heard_sessions.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

SessionStart WithHash(uint64_t hash) {
  SessionStart start;
  start.session = 1;
  start.camera = TestCamera();
  start.configuration_hash = hash;
  return start;
}

/// Twice, a second apart, as its frontend does.
void HearTwice(HeardSessions* heard, CameraId camera, int64_t epoch, uint64_t hash) {
  heard->Hear(camera, epoch, WithHash(hash), 0);
  heard->Hear(camera, epoch, WithHash(hash), 1000 * kMs);
}

TEST(HeardSessions, WhatWasSaidOfTheStreamThatIsMappedCounts) {
  HeardSessions heard;
  HearTwice(&heard, 0, 100, 5);
  const auto start = heard.Mapped(0, 100);
  ASSERT_TRUE(start);
  EXPECT_EQ(start->configuration_hash, 5u);
  EXPECT_FALSE(heard.Mapped(0, 100)) << "once";
}

TEST(HeardSessions, OneOfAStreamThatNobodyWritesNeverCounts) {
  HeardSessions heard;
  HearTwice(&heard, 0, 100, 5);
  HearTwice(&heard, 0, 9000, 6);
  EXPECT_EQ(heard.Mapped(0, 100)->configuration_hash, 5u);
  EXPECT_FALSE(heard.Mapped(0, 200)) << "the stream that follows has said nothing";
}

TEST(HeardSessions, OneThatComesWhenTheStreamIsMappedAlreadyDoesNotCount) {
  HeardSessions heard;
  EXPECT_FALSE(heard.Mapped(0, 100));
  heard.Hear(0, 100, WithHash(6), 0);
  EXPECT_FALSE(heard.Mapped(0, 100));
}

TEST(HeardSessions, OneThatIsSaidOnceDoesNotCountNorDoItsCopies) {
  HeardSessions heard;
  heard.Hear(0, 100, WithHash(6), 0);
  heard.Hear(0, 100, WithHash(6), 60 * kMs);
  EXPECT_FALSE(heard.Mapped(0, 100));
  heard.Hear(0, 100, WithHash(6), 1000 * kMs);
  EXPECT_TRUE(heard.Mapped(0, 100)) << "it is said again: who comes late hears it, too";
  EXPECT_FALSE(heard.Mapped(0, 100)) << "once";
}

TEST(HeardSessions, OfTwoThatContradictEachOtherNeitherCounts) {
  HeardSessions heard;
  HearTwice(&heard, 0, 100, 5);
  HearTwice(&heard, 1, 100, 5);
  heard.Hear(1, 100, WithHash(6), 1000 * kMs);
  EXPECT_TRUE(heard.Mapped(0, 100));
  EXPECT_FALSE(heard.Mapped(1, 100));
}

TEST(HeardSessions, ManyThatAreForgedLeaveRoomForTheTrueOne) {
  HeardSessions heard;
  for (int64_t i = 0; i < 100; ++i) HearTwice(&heard, 0, 1000 + i, 6);
  HearTwice(&heard, 0, 100, 5);
  EXPECT_TRUE(heard.Mapped(0, 100));
}

}  // namespace
}  // namespace dmslam
