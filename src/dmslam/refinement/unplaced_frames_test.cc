#include "dmslam/refinement/unplaced_frames.h"

#include <gtest/gtest.h>

#include <vector>

namespace dmslam {
namespace {

WaitingFrame Frame(uint32_t index) { return {index, index * 1000, {}}; }

std::vector<uint32_t> TakeAll(UnplacedFrames& frames) {
  std::vector<uint32_t> indices;
  while (!frames.empty()) indices.push_back(frames.TakeNewest().index);
  return indices;
}

TEST(UnplacedFramesTest, TheNewestIsTakenFirst) {
  UnplacedFrames frames(10);
  for (const uint32_t index : {1, 2, 3}) frames.Keep(Frame(index));
  EXPECT_EQ(TakeAll(frames), (std::vector<uint32_t>{3, 2, 1}));
}

TEST(UnplacedFramesTest, OfTooManyTheOldestAreForgotten) {
  UnplacedFrames frames(3);
  for (const uint32_t index : {1, 2, 3, 4}) frames.Keep(Frame(index));
  EXPECT_EQ(frames.size(), 3U);
  frames.PutBack({Frame(0), Frame(5)});
  EXPECT_EQ(TakeAll(frames), (std::vector<uint32_t>{5, 4, 3}));
}

TEST(UnplacedFramesTest, OfARunOfHoursThoseOfTheLastTwoMinutesStay) {
  UnplacedFrames frames(100);
  constexpr int64_t kSecond = 1'000'000'000;
  for (uint32_t minute = 0; minute < 60; ++minute) frames.Keep({minute, 60 * kSecond * minute, {}});
  EXPECT_EQ(TakeAll(frames), (std::vector<uint32_t>{59, 58, 57}));
}

TEST(UnplacedFramesTest, FramesThatArePutBackComeInTheirOrder) {
  UnplacedFrames frames(10);
  for (const uint32_t index : {2, 6}) frames.Keep(Frame(index));
  frames.PutBack({Frame(5), Frame(1)});
  EXPECT_EQ(TakeAll(frames), (std::vector<uint32_t>{6, 5, 2, 1}));
}

TEST(UnplacedFramesTest, ThoseFromAFrameOnAreTakenTogether) {
  UnplacedFrames frames(10);
  for (const uint32_t index : {2, 4, 6, 8}) frames.Keep(Frame(index));
  std::vector<uint32_t> taken;
  for (const WaitingFrame& frame : frames.TakeFrom(5)) taken.push_back(frame.index);
  EXPECT_EQ(taken, (std::vector<uint32_t>{6, 8}));
  EXPECT_EQ(TakeAll(frames), (std::vector<uint32_t>{4, 2}));
}

TEST(UnplacedFramesTest, WhatIsSetAsideWaitsUntilItIsReturnedUnlessItIsFound) {
  UnplacedFrames frames(10);
  for (const uint32_t index : {1, 2, 3}) frames.Keep(Frame(index));
  while (!frames.empty()) frames.SetAside(frames.TakeNewest());
  frames.ForgetSetAside(2);
  EXPECT_TRUE(frames.empty());
  frames.ReturnSetAside();
  EXPECT_EQ(TakeAll(frames), (std::vector<uint32_t>{3, 1}));
  frames.ReturnSetAside();
  EXPECT_TRUE(frames.empty()) << "they are returned once";
}

}  // namespace
}  // namespace dmslam
