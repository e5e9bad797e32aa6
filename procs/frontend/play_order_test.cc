#include "frontend/play_order.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSecond = 1000 * kMs;

using Place = PlayOrder::Place;

/// A player at 30 Hz, and what a frontend takes of it.
struct Play {
  PlayOrder order;
  std::optional<Place> newest;
  int64_t now_ns = 0;

  bool Hear(uint32_t index, int64_t stamp_ns) {
    const Place place{index, stamp_ns};
    if (!order.Takes(place, newest, now_ns)) return false;
    newest = place;
    return true;
  }
  bool Next(uint32_t ahead = 1) {
    now_ns += 33 * kMs;
    return Hear((newest ? newest->index : 0) + ahead, (newest ? newest->stamp_ns : 0) + ahead * 33 * kMs);
  }
  void SayEnd() {
    EndOfSequence end;
    end.frames_published = newest->index + 1;
    end.last_frame_index = static_cast<int32_t>(newest->index);
    order.OnEnd(end, now_ns);
  }
};

TEST(PlayOrderTest, AFrameFarAheadDeafensNobody) {
  for (const Place forged : {Place{2'000'000'000, 300 * kMs}, Place{5, 3600 * kSecond}}) {
    Play play;
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(play.Next());
    for (int copy = 0; copy < 5; ++copy) {
      EXPECT_FALSE(play.Hear(forged.index + static_cast<uint32_t>(copy), forged.stamp_ns));
      EXPECT_TRUE(play.Next()) << "the player's own are taken";
    }
  }
}

/// In lock-step a slow frontend hears nothing else while it works.
TEST(PlayOrderTest, WhatIsSaidWhileThePlayerWaitsIsNoLeapInEarnest) {
  Play play;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(play.Next());
  for (uint32_t copy = 0; copy < 5; ++copy) {
    play.order.OnPlayerWaits();
    EXPECT_FALSE(play.Hear(5000 + copy, kSecond));
    play.now_ns += 200 * kMs;
  }
  EXPECT_TRUE(play.Next()) << "the player's own are taken";
}

TEST(PlayOrderTest, ALeapInEarnestIsBelieved) {
  Play play;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(play.Next());
  const Place far = {5000, 170 * kSecond};
  EXPECT_FALSE(play.Hear(far.index, far.stamp_ns));
  play.now_ns += 300 * kMs;  // lock-step: the player repeats it
  EXPECT_TRUE(play.Hear(far.index, far.stamp_ns));
  uint32_t heard = 0;
  for (; heard < 10 && play.newest->index < 9000; ++heard) {  // real time: others come
    play.now_ns += 33 * kMs;
    play.Hear(9000 + heard, 300 * kSecond + heard * 33 * kMs);
  }
  EXPECT_EQ(heard, 5u);
}

TEST(PlayOrderTest, AnEndThatIsSaidOnceEndsNothing) {
  Play play;
  for (int i = 0; i < 4; ++i) play.Next();
  for (int copy = 0; copy < 5; ++copy) {
    play.SayEnd();
    EXPECT_FALSE(play.order.IsOver(play.now_ns));
    play.now_ns += 200 * kMs;
    play.Next();
  }
  play.SayEnd();
  play.now_ns += 200 * kMs;
  play.order.OnRepeat();
  play.SayEnd();
  EXPECT_FALSE(play.order.IsOver(play.now_ns)) << "the player repeats a frame";
}

TEST(PlayOrderTest, ThePlayerSaysTheEndUntilItIsHeard) {
  Play play;
  play.Next();
  play.SayEnd();
  play.SayEnd();  // a copy, made by the network
  EXPECT_FALSE(play.order.IsOver(play.now_ns));
  play.now_ns += 200 * kMs;
  play.SayEnd();
  EXPECT_TRUE(play.order.IsOver(play.now_ns));
}

TEST(PlayOrderTest, AnEndIsBelievedWhereNobodyPlaysAnyMore) {
  Play play;
  play.Next();
  play.SayEnd();
  EXPECT_FALSE(play.order.IsOver(play.now_ns + kSecond));
  EXPECT_TRUE(play.order.IsOver(play.now_ns + 5 * kSecond));
}

}  // namespace
}  // namespace dmslam
