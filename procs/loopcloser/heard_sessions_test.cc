#include "loopcloser/heard_sessions.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

SessionStart WithHash(uint64_t hash) {
  SessionStart start;
  start.session = 1;
  start.camera = TestCamera();
  start.configuration_hash = hash;
  return start;
}

TEST(HeardSessions, WhatWasSaidOfTheStreamThatIsMappedCounts) {
  HeardSessions heard;
  heard.Hear(0, 100, WithHash(5));
  const auto start = heard.Mapped(0, 100);
  ASSERT_TRUE(start);
  EXPECT_EQ(start->configuration_hash, 5u);
  EXPECT_FALSE(heard.Mapped(0, 100)) << "once";
}

TEST(HeardSessions, OneOfAStreamThatNobodyWritesNeverCounts) {
  HeardSessions heard;
  heard.Hear(0, 100, WithHash(5));
  heard.Hear(0, 9000, WithHash(6));
  EXPECT_EQ(heard.Mapped(0, 100)->configuration_hash, 5u);
  EXPECT_FALSE(heard.Mapped(0, 200)) << "the stream that follows has said nothing";
}

TEST(HeardSessions, OneThatComesWhenTheStreamIsMappedAlreadyDoesNotCount) {
  HeardSessions heard;
  EXPECT_FALSE(heard.Mapped(0, 100));
  heard.Hear(0, 100, WithHash(6));
  EXPECT_FALSE(heard.Mapped(0, 100));
}

TEST(HeardSessions, OfTwoThatContradictEachOtherNeitherCounts) {
  HeardSessions heard;
  heard.Hear(0, 100, WithHash(5));
  heard.Hear(0, 100, WithHash(5));  // a repair
  heard.Hear(1, 100, WithHash(5));
  heard.Hear(1, 100, WithHash(6));
  EXPECT_TRUE(heard.Mapped(0, 100));
  EXPECT_FALSE(heard.Mapped(1, 100));
}

TEST(HeardSessions, ManyThatAreForgedLeaveRoomForTheTrueOne) {
  HeardSessions heard;
  for (int64_t i = 0; i < 100; ++i) heard.Hear(0, 1000 + i, WithHash(6));
  heard.Hear(0, 100, WithHash(5));
  EXPECT_TRUE(heard.Mapped(0, 100));
}

}  // namespace
}  // namespace dmslam
