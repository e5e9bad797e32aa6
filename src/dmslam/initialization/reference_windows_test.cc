#include "dmslam/initialization/reference_windows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace dmslam {
namespace {

InitializerFrame At(double seconds) {
  InitializerFrame frame;
  frame.index = static_cast<uint32_t>(seconds * 1000 + 0.5);
  frame.stamp_ns = int64_t{frame.index} * 1'000'000;
  return frame;
}

class ReferenceWindowsTest : public ::testing::Test {
 protected:
  /// Frames of 20 Hz ask whether a reference frame is due.
  void Ask(double from, double to) {
    for (double seconds = from; seconds < to - 1e-9; seconds += 0.05) windows_.BeginIfDue(At(seconds));
  }
  /// Everything that a reference frame showed is out of sight.
  void LoseFirst(double at) { windows_.Lose(windows_.all().begin(), At(at)); }
  std::vector<uint32_t> References() const {
    std::vector<uint32_t> references;
    for (const ReferenceWindow& window : windows_.all()) references.push_back(window.reference().index);
    return references;
  }
  long Brief() const { return std::ranges::count_if(windows_.all(), &ReferenceWindow::IsBrief); }

  ReferenceWindows windows_{{}, {}};
};

TEST_F(ReferenceWindowsTest, OneIsTakenEveryTenthOfASecond) {
  Ask(1.0, 1.3);
  EXPECT_EQ(References(), (std::vector<uint32_t>{1000, 1100, 1200}));
}

TEST_F(ReferenceWindowsTest, OfTooManyTheOldestGoesThatPromisesNothing) {
  Ask(1.0, 1.8);
  ASSERT_EQ(windows_.all().size(), 8U);
  windows_.all()[0].OnTried(WaitReason::kParallaxTooSmall);
  windows_.all()[1].OnContestWon(0, {}, 0.5);
  Ask(1.8, 1.85);
  EXPECT_EQ(References(), (std::vector<uint32_t>{1000, 1100, 1300, 1400, 1500, 1600, 1700, 1800}));
  for (ReferenceWindow& window : windows_.all()) window.OnTried(WaitReason::kParallaxTooSmall);
  Ask(1.9, 1.95);
  EXPECT_EQ(References().back(), 1800U) << "there is no room";
}

TEST_F(ReferenceWindowsTest, OldOnesAreGivenUpPromisingOnesLater) {
  windows_.Begin(At(1.0));
  windows_.Begin(At(1.1));
  windows_.all()[0].OnTried(WaitReason::kParallaxTooSmall);
  windows_.DropOld(At(3.05));
  EXPECT_EQ(References(), (std::vector<uint32_t>{1000, 1100}));
  windows_.DropOld(At(3.15));
  EXPECT_EQ(References(), std::vector<uint32_t>{1000});
  windows_.DropOld(At(5.05));
  EXPECT_TRUE(windows_.empty());
}

TEST_F(ReferenceWindowsTest, WhereOneIsLostSoonBriefOnesAreTakenBetween) {
  Ask(1.0, 1.25);
  EXPECT_EQ(Brief(), 0);
  LoseFirst(1.3);
  Ask(1.3, 1.5);
  EXPECT_EQ(References(), (std::vector<uint32_t>{1100, 1200, 1300, 1350, 1400, 1450}));
  EXPECT_EQ(Brief(), 2);
  windows_.DropOld(At(1.8));
  EXPECT_EQ(Brief(), 1) << "they are kept for less than the others";
  EXPECT_EQ(References().front(), 1100U);
}

TEST_F(ReferenceWindowsTest, WhereOneIsLostLateBriefOnesWouldNotHelp) {
  windows_.Begin(At(1.0));
  LoseFirst(1.5);
  EXPECT_FALSE(windows_.BriefOnesHelp(At(1.5)));
}

TEST_F(ReferenceWindowsTest, BriefOnesAreTakenForAWhileOnly) {
  windows_.Begin(At(1.0));
  LoseFirst(1.3);
  EXPECT_TRUE(windows_.BriefOnesHelp(At(3.25)));
  EXPECT_FALSE(windows_.BriefOnesHelp(At(3.35)));
}

TEST_F(ReferenceWindowsTest, FramesJustBeforeOneAreItsPast) {
  PastOptions options;
  options.seconds = 0.5;
  options.views = 5;
  ReferenceWindows windows({}, options);
  for (int k = 0; k <= 40; ++k) windows.KeepRecent(At(1.0 + 0.05 * k));
  windows.Begin(At(3.0));
  std::vector<uint32_t> past;
  windows.all().front().Past([&](const InitializerFrame& frame) {
    past.push_back(frame.index);
    return ReferenceView{};
  });
  EXPECT_EQ(past, (std::vector<uint32_t>{2500, 2600, 2700, 2800, 2900})) << "spread evenly";
}

TEST(ReferenceWindowTest, AMotionGoesOnWithItsLeadWhereItsFeaturesAreMuchTheSame) {
  ReferenceWindow window(At(1.0));
  EXPECT_EQ(window.OnContestWon(10, {1, 2, 3, 4}, 0.5), 10);
  EXPECT_EQ(window.OnContestWon(20, {3, 4, 5, 6}, 0.5), 10);
  EXPECT_EQ(window.OnContestWon(30, {6, 7, 8}, 0.5), 30) << "another motion";
  window.OnContestUndecided();
  EXPECT_EQ(window.OnContestWon(40, {6, 7, 8}, 0.5), 40) << "there was a break";
}

TEST(ReferenceWindowTest, ViewsThatDetermineNoMotionMakeItDoubtfulForGood) {
  ReferenceWindow window(At(1.0));
  window.OnFound({nullptr, Rigid3d()});
  window.OnTried(WaitReason::kNoReconstruction);
  EXPECT_FALSE(window.found());
  window.OnTried(WaitReason::kDisagreement);
  EXPECT_TRUE(window.IsDoubtful());
  EXPECT_FALSE(window.IsPromising());
}

}  // namespace
}  // namespace dmslam
