#include "dmslam/refinement/lone_poses.h"

#include <gtest/gtest.h>

#include <numeric>

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

std::vector<FinalPose> PosesAt(std::vector<int64_t> stamps_ms, MapId map_id = 1) {
  std::vector<FinalPose> poses(stamps_ms.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    poses[i].pose.stamp_ns = stamps_ms[i] * kMs;
    poses[i].pose.map_id = map_id;
  }
  return poses;
}

std::vector<int64_t> Every33Ms(int64_t from_ms, int64_t to_ms) {
  std::vector<int64_t> stamps;
  for (int64_t at = from_ms; at < to_ms; at += 33) stamps.push_back(at);
  return stamps;
}

/// Of the first map.
std::vector<TrackedAt> TrackedAtMs(const std::vector<int64_t>& stamps_ms) {
  std::vector<TrackedAt> tracked;
  tracked.reserve(stamps_ms.size());
  for (const int64_t stamp_ms : stamps_ms) tracked.push_back({stamp_ms * kMs, 1});
  return tracked;
}

int NumAlone(const std::vector<uint8_t>& alone) { return std::accumulate(alone.begin(), alone.end(), 0); }

TEST(LonePoses, AShortRowFarFromTheTrackedFramesStandsAlone) {
  const std::vector<TrackedAt> tracked = TrackedAtMs({3000, 3033});
  EXPECT_EQ(NumAlone(StandAlone(PosesAt({100, 133, 166}), tracked)), 3);
  EXPECT_EQ(NumAlone(StandAlone(PosesAt({100, 133, 166}), {})), 3);
}

TEST(LonePoses, ARowThatReachesATrackedFrameDoesNot) {
  const std::vector<TrackedAt> tracked = TrackedAtMs({3000});
  EXPECT_EQ(NumAlone(StandAlone(PosesAt(Every33Ms(2100, 2900)), tracked)), 0);
  EXPECT_EQ(NumAlone(StandAlone(PosesAt({2600, 3200}), tracked)), 0);
}

TEST(LonePoses, ALongRowBetweenTrackedFramesVouchesForItself) {
  const std::vector<TrackedAt> tracked = TrackedAtMs({0, 9000});
  EXPECT_EQ(NumAlone(StandAlone(PosesAt(Every33Ms(3000, 4000)), tracked)), 0);
}

TEST(LonePoses, ALongRowBeforeOrAfterAllTrackedFramesDoesNot) {
  const std::vector<FinalPose> row = PosesAt(Every33Ms(3000, 4000));
  const int all = static_cast<int>(row.size());
  EXPECT_EQ(NumAlone(StandAlone(row, TrackedAtMs({9000, 9033}))), all);
  EXPECT_EQ(NumAlone(StandAlone(row, TrackedAtMs({0, 33}))), all);
}

TEST(LonePoses, ALongRowOfACameraThatTrackedNothingVouchesForItself) {
  EXPECT_EQ(NumAlone(StandAlone(PosesAt(Every33Ms(3000, 4000)), {})), 0);
}

TEST(LonePoses, AFewFarApartAreNoRow) {
  const std::vector<TrackedAt> tracked = TrackedAtMs({9000});
  EXPECT_EQ(NumAlone(StandAlone(PosesAt({166, 566, 666}), tracked)), 3) << "they only span half a second";
}

TEST(LonePoses, TrackedFramesOfAnotherMapVouchForNothing) {
  const std::vector<TrackedAt> tracked = TrackedAtMs({200});
  EXPECT_EQ(NumAlone(StandAlone(PosesAt({233, 266}, 1), tracked)), 0);
  EXPECT_EQ(NumAlone(StandAlone(PosesAt({233, 266}, 2), tracked)), 2);
}

TEST(LonePoses, RowsOfTwoMapsDoNotVouchForEachOther) {
  std::vector<FinalPose> poses = PosesAt({0, 33, 66});
  for (FinalPose& pose : PosesAt(Every33Ms(99, 1099), 2)) poses.push_back(pose);
  const std::vector<uint8_t> alone = StandAlone(poses, {});
  EXPECT_EQ(NumAlone(alone), 3);
  EXPECT_EQ(alone[0] + alone[1] + alone[2], 3);
}

}  // namespace
}  // namespace dmslam
