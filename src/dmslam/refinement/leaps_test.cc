#include "dmslam/refinement/leaps.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace dmslam {
namespace {

constexpr int64_t kFrameNs = 33'000'000;

/// A camera that goes along x, at 0.3 depths per second.
std::vector<SeenFrom> Walk(int count) {
  std::vector<SeenFrom> frames;
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d center(0.02 * k, 0, 0);
    frames.push_back({k * kFrameNs, Rigid3d(Eigen::Quaterniond::Identity(), center).Inverse(), 2.0, 0.002});
  }
  return frames;
}

void Shift(SeenFrom* frame, double by) {
  frame->T_cam_world =
      Rigid3d(Eigen::Quaterniond::Identity(), frame->T_cam_world.Center() + Eigen::Vector3d(0, by, 0))
          .Inverse();
}

std::vector<int> LeapsIn(const std::vector<SeenFrom>& frames) {
  const std::vector<uint8_t> leaps = FindLeaps(frames, {});
  std::vector<int> found;
  for (size_t k = 0; k < leaps.size(); ++k) {
    if (leaps[k] != 0) found.push_back(static_cast<int>(k));
  }
  return found;
}

TEST(Leaps, ACameraThatWalksHasNone) { EXPECT_TRUE(LeapsIn(Walk(20)).empty()); }

TEST(Leaps, ACameraThatIsPutElsewhereLeaps) {
  std::vector<SeenFrom> frames = Walk(20);
  for (size_t k = 12; k < 20; ++k) Shift(&frames[k], 1.0);
  EXPECT_EQ(LeapsIn(frames), std::vector<int>{12});
}

TEST(Leaps, AShortOneIsSeenWherePosesAreKnownWell) {
  std::vector<SeenFrom> frames = Walk(20);
  for (size_t k = 12; k < 20; ++k) Shift(&frames[k], 0.25);
  EXPECT_EQ(LeapsIn(frames), std::vector<int>{12});
  for (SeenFrom& frame : frames) frame.spread = 0.03;
  EXPECT_TRUE(LeapsIn(frames).empty());
}

TEST(Leaps, ATurnThatNoHandMakesIsOne) {
  std::vector<SeenFrom> frames = Walk(20);
  for (size_t k = 7; k < 20; ++k)
    frames[k].T_cam_world = Rigid3d(ExpSo3({0, 0.8, 0}), Eigen::Vector3d::Zero()) * frames[k].T_cam_world;
  EXPECT_EQ(LeapsIn(frames), std::vector<int>{7});
}

TEST(Leaps, WithTimeACameraGetsAnywhere) {
  std::vector<SeenFrom> frames = Walk(20);
  for (size_t k = 12; k < 20; ++k) {
    Shift(&frames[k], 1.0);
    frames[k].stamp_ns += 1'000'000'000;
  }
  EXPECT_TRUE(LeapsIn(frames).empty());
}

TEST(Leaps, OneFrameInAWrongPlaceIsNone) {
  std::vector<SeenFrom> frames = Walk(20);
  Shift(&frames[9], 1.0);
  EXPECT_TRUE(LeapsIn(frames).empty());
  Shift(&frames[14], -1.0);
  EXPECT_TRUE(LeapsIn(frames).empty());
}

TEST(Leaps, FramesOfWhichNothingIsKnownBelongToTheNearerSide) {
  std::vector<SeenFrom> frames = Walk(20);
  for (size_t k = 12; k < 20; ++k) Shift(&frames[k], 2.0);
  for (size_t k = 10; k < 14; ++k) frames[k].spread.reset();
  EXPECT_EQ(LeapsIn(frames), std::vector<int>{12});
}

}  // namespace
}  // namespace dmslam
