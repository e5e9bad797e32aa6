#include "dmslam/evaluation/run_verdict.h"

#include <gtest/gtest.h>

#include "dmslam/evaluation/evaluation_test_util.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kFrames = 300;  // 10 s
const Sim3d kMapFromWorld(ExpSo3({0.3, -0.2, 0.5}), {1, 2, 3}, 1 / 2.5);

std::vector<int64_t> Stamps(const std::vector<StampedPose>& path) {
  std::vector<int64_t> stamps_ns;
  for (const StampedPose& pose : path) stamps_ns.push_back(pose.stamp_ns);
  return stamps_ns;
}

/// A run that is right in everything, in the units of a map of its own; tests spoil it.
class RunVerdictTest : public ::testing::Test {
 protected:
  RunVerdict Judge(const VerdictLimits& limits = {}) const {
    return JudgeRun({truth_, final_, online_, keyframes_, stamps_ns_, covered_, loops_}, limits);
  }
  /// Moves poses [from, to) of a trajectory by a distance in metres.
  static void Shift(std::vector<StampedPose>* path, size_t from, size_t to, double distance_m) {
    for (size_t i = from; i < to; ++i)
      (*path)[i].T_world_cam.translation.x() += distance_m * kMapFromWorld.scale;
  }
  ClosedLoop Loop(size_t keyframe, size_t matched) const {
    return {stamps_ns_[keyframe], stamps_ns_[matched], std::nullopt};
  }

  std::vector<StampedPose> truth_ = CurvedPath(kFrames);
  std::vector<StampedPose> final_ = Transformed(truth_, kMapFromWorld);
  std::vector<StampedPose> online_ = final_;
  std::vector<StampedPose> keyframes_ = final_;
  std::vector<int64_t> stamps_ns_ = Stamps(truth_);
  std::vector<double> covered_ = std::vector<double>(kFrames, 0.25);
  std::vector<ClosedLoop> loops_;
};

TEST_F(RunVerdictTest, ARightRunIsASuccess) {
  loops_ = {Loop(250, 10)};
  const RunVerdict verdict = Judge();
  EXPECT_TRUE(verdict.success());
  EXPECT_NEAR(verdict.final_ate_m.value(), 0, 1e-9);
  EXPECT_NEAR(verdict.online_ate_m.value(), 0, 1e-9);
  EXPECT_EQ(verdict.tracked_share, 1);
  EXPECT_EQ(verdict.tracked_online_share, 1);
  EXPECT_EQ(verdict.first_map_s.value(), 0);
  EXPECT_EQ(verdict.wrong_poses_s, 0);
  EXPECT_EQ(verdict.loops, 1u);
  EXPECT_EQ(verdict.false_loops, 0u);
  EXPECT_EQ(verdict.unknown_loops, 0u);
  EXPECT_FALSE(verdict.wrong_first_map);
  EXPECT_NEAR(verdict.mean_covered_share, 0.25, 1e-9);
}

TEST_F(RunVerdictTest, EachLimitIsAsked) {
  final_ = WithNoise(final_, 0.02 * kMapFromWorld.scale, 1);
  EXPECT_EQ(Judge().shortfalls, std::vector{Shortfall::kFinalAte});
  EXPECT_TRUE(Judge(LimitsForPath(PathLength(truth_))).success());  // 0.5 % of more than 9 m
  final_ = Transformed(truth_, kMapFromWorld);
  online_ = WithNoise(online_, 0.04 * kMapFromWorld.scale, 1);
  EXPECT_EQ(Judge().shortfalls, std::vector{Shortfall::kOnlineAte});
  online_ = final_;
  final_.resize(260);
  EXPECT_EQ(Judge().shortfalls, std::vector{Shortfall::kTracked});
}

TEST_F(RunVerdictTest, FramesThatShowNoRoomNeedNoPose) {
  online_.erase(online_.begin() + 100, online_.begin() + 180);  // 220 of 300
  EXPECT_EQ(Judge().shortfalls, std::vector{Shortfall::kTrackedOnline});
  std::fill(covered_.begin() + 100, covered_.begin() + 180, 0.75);
  EXPECT_TRUE(Judge().success());
  EXPECT_EQ(Judge().tracked_online_share, 1);
  std::fill(covered_.begin() + 100, covered_.begin() + 180, 0.69);
  EXPECT_NEAR(Judge().tracked_online_share, 220.0 / 300, 1e-9);
  covered_.clear();
  EXPECT_NEAR(Judge().tracked_online_share, 220.0 / 300, 1e-9);
}

TEST_F(RunVerdictTest, AJumpMakesASecondOfWrongPoses) {
  Shift(&online_, 150, 151, 0.2);  // one pose alone: wrong towards before and towards after
  EXPECT_NEAR(Judge().wrong_poses_s, 2 / 30.0, 1e-6);
  online_ = final_;
  Shift(&online_, 290, kFrames, 0.3);  // to the end: ten poses
  EXPECT_NEAR(Judge().wrong_poses_s, 10 / 30.0, 1e-6);
  online_ = final_;
  for (size_t i = 200; i < 206; ++i)  // four degrees, and no metre
    online_[i].T_world_cam.rotation = online_[i].T_world_cam.rotation * ExpSo3({0, 0.07, 0});
  EXPECT_NEAR(Judge().wrong_poses_s, 12 / 30.0, 1e-6);
}

TEST_F(RunVerdictTest, NoMotionIsWrongWhereNothingWasPublished) {
  Shift(&online_, 150, 155, 0.1);
  online_.erase(online_.begin() + 100, online_.begin() + 150);  // nothing a second before
  online_.erase(online_.begin() + 105, online_.end());          // nor after
  EXPECT_EQ(Judge().wrong_poses_s, 0);
}

TEST_F(RunVerdictTest, LoopsAreJudgedByTheirRelativePose) {
  loops_ = {Loop(250, 10), Loop(280, 40)};
  Shift(&keyframes_, 250, 251, 0.06);
  EXPECT_EQ(Judge().false_loops, 1u);
  // What the loop closer measured goes before what became of it.
  loops_[0].T_matched_keyframe = final_[10].T_world_cam.Inverse() * final_[250].T_world_cam;
  EXPECT_EQ(Judge().false_loops, 0u);
  loops_[1].T_matched_keyframe =
      Rigid3d(ExpSo3({0, 0, 0.06}), {0, 0, 0}) * final_[40].T_world_cam.Inverse() * final_[280].T_world_cam;
  EXPECT_EQ(Judge().false_loops, 1u);
}

TEST_F(RunVerdictTest, LoopsOfUnknownKeyframesAreCounted) {
  loops_ = {Loop(250, 10)};
  keyframes_.erase(keyframes_.begin() + 240, keyframes_.begin() + 260);
  const RunVerdict verdict = Judge();
  EXPECT_EQ(verdict.loops, 1u);
  EXPECT_EQ(verdict.unknown_loops, 1u);
  EXPECT_EQ(verdict.false_loops, 0u);
}

TEST_F(RunVerdictTest, AFirstMapIsJudgedAtItsOwnScale) {
  // Half as large at first, as another map's unit: right all the same.
  for (size_t i = 0; i < 61; ++i) online_[i].T_world_cam.translation *= 0.5;
  EXPECT_FALSE(IsWrongFirstMap(truth_, online_, {}));
  // The camera seems to stand still, as before somebody who goes with it.
  for (size_t i = 0; i < 61; ++i) online_[i].T_world_cam.translation = online_[0].T_world_cam.translation;
  EXPECT_TRUE(IsWrongFirstMap(truth_, online_, {}));
  // An excursion is counted among the wrong poses; what is wrong later is no fault of the first map.
  online_ = final_;
  Shift(&online_, 30, 36, 0.2);
  EXPECT_FALSE(IsWrongFirstMap(truth_, online_, {}));
  online_ = final_;
  Shift(&online_, 70, 80, 0.5);
  EXPECT_FALSE(IsWrongFirstMap(truth_, online_, {}));
}

TEST_F(RunVerdictTest, NoTrajectoryIsNoSuccess) {
  final_.clear();
  online_.clear();
  keyframes_.clear();
  const RunVerdict verdict = Judge();
  EXPECT_EQ(verdict.shortfalls.size(), 4u);
  EXPECT_FALSE(verdict.final_ate_m);
  EXPECT_FALSE(verdict.first_map_s);
  EXPECT_EQ(verdict.wrong_poses_s, 0);
}

TEST_F(RunVerdictTest, CoverageOfAnotherSequenceIsRefused) {
  covered_.pop_back();
  EXPECT_THROW(Judge(), InputError);
}

}  // namespace
}  // namespace dmslam
