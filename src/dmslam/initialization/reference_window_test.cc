#include "dmslam/initialization/reference_window.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <vector>

namespace dmslam {
namespace {

constexpr int64_t kFrameNs = 33'333'333;

InitializerFrame Frame(uint32_t index) { return {index, int64_t{index} * kFrameNs, nullptr}; }
double SecondsAt(uint32_t index) { return SecondsFromTo(Frame(0), Frame(index)); }
/// A camera that turns so far in a frame.
Eigen::Quaterniond Turned(double frames, double per_frame_rad) {
  return ExpSo3({0.0, per_frame_rad * frames, 0.0});
}

void AddView(uint32_t index, bool moved, const Eigen::Quaterniond& R_k_0, ReferenceWindow* window) {
  ReferenceView view;
  view.frame = Frame(index);
  view.since_reference_s = SecondsAt(index);
  view.moved = moved;
  view.R_k_0 = R_k_0;
  window->AddView(std::move(view));
}

std::vector<uint32_t> FramesOf(const std::vector<const ReferenceView*>& views) {
  std::vector<uint32_t> frames;
  for (const ReferenceView* view : views) frames.push_back(view->frame.index);
  return frames;
}

/// Of frame 0, with views that moved.
ReferenceWindow Moved(std::initializer_list<uint32_t> frames) {
  ReferenceWindow window(Frame(0));
  for (const uint32_t frame : frames) AddView(frame, true, Eigen::Quaterniond::Identity(), &window);
  return window;
}

TEST(ReferenceWindow, PairsAreTheNewestAndOthersThatAreSpreadEvenly) {
  const ReferenceWindow window = Moved({1, 2, 3, 4, 5, 6, 7, 8, 9});
  EXPECT_EQ(FramesOf(window.PairsToAgree(3, 0)), (std::vector<uint32_t>{1, 5, 9}));
  EXPECT_EQ(FramesOf(window.PairsToAgree(2, 0)), (std::vector<uint32_t>{1, 9}));
  EXPECT_EQ(FramesOf(window.PairsToAgree(1, 0)), std::vector<uint32_t>{9});
  EXPECT_TRUE(window.PairsToAgree(10, 0).empty()) << "there are nine";
  EXPECT_TRUE(window.PairsToAgree(0, 0).empty());
}

TEST(ReferenceWindow, PairsThatAreTooNearToEachOtherAreNone) {
  const ReferenceWindow window = Moved({2, 4, 6});
  EXPECT_EQ(window.PairsToAgree(3, SecondsAt(2)).size(), 3u);
  EXPECT_TRUE(window.PairsToAgree(3, SecondsAt(2) + 1e-6).empty());
}

TEST(ReferenceWindow, WhatHardlyMovedIsInNoPair) {
  ReferenceWindow window = Moved({1, 2});
  AddView(3, false, Eigen::Quaterniond::Identity(), &window);
  EXPECT_EQ(FramesOf(window.PairsToAgree(2, 0)), (std::vector<uint32_t>{1, 2}));
  EXPECT_TRUE(window.PairsToAgree(3, 0).empty());
}

TEST(ReferenceWindow, TheTurnGoesOnAsAtTheNearestViews) {
  ReferenceWindow window(Frame(0));
  EXPECT_EQ(AngleBetween(window.TurnAt(0.1), Eigen::Quaterniond::Identity()), 0.0) << "no view";
  AddView(2, true, Turned(2, 0.01), &window);  // then it turns faster
  AddView(4, true, Turned(2, 0.01) * Turned(2, 0.03), &window);
  EXPECT_LT(AngleBetween(window.TurnAt(SecondsAt(4)), Turned(8, 0.01)), 1e-9) << "at the newest view";
  EXPECT_LT(AngleBetween(window.TurnAt(SecondsAt(6)), Turned(14, 0.01)), 1e-6) << "as between the last two";
}

TEST(ReferenceWindow, BeforeTheReferenceFrameItTurnedAsJustAfterIt) {
  ReferenceWindow window(Frame(0));
  AddView(2, true, Turned(2, 0.01), &window);
  AddView(4, true, Turned(8, 0.01), &window);
  EXPECT_LT(AngleBetween(window.TurnAt(-SecondsAt(3)), Turned(-3, 0.01)), 1e-6);
}

}  // namespace
}  // namespace dmslam
