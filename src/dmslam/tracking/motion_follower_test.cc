// A camera from frame to frame: each mechanism fails its test when it is taken out.
#include "dmslam/tracking/motion_follower.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr int64_t kStartNs = 10'000'000'000;
constexpr double kStep = 0.01;  // of the camera, per frame [map units]
constexpr const char* kNotSeen = "too few features match the last frame";

/// A camera that goes to the right before a wall; somebody before it may have gone since he was mapped.
class MotionFollowerTest : public ::testing::Test {
 protected:
  void AddRoom(int count = 150) {
    scene_.AddCloud(count, {0, 0, 4}, {2, 1.6, 0.2}, kStartNs);
    room_ = scene_.size();
  }
  void AddSomebody(int count) { scene_.AddCloud(count, {0, 0, 2}, {0.2, 0.3, 0.1}, kStartNs); }
  void Begin() {
    scene_.MapAll(4, 0.05, 0, kStartNs);
    follower_.BeginAt(Keyframe0(), Time(0));
  }
  const Keyframe& Keyframe0() const {
    return *scene_.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, 0));
  }
  static FrameTime Time(uint32_t frame) { return {frame, kStartNs + frame * kFrameNs}; }

  bool IsOfRoom(size_t point) const { return point < room_; }
  bool IsOfRoom(LandmarkId id) const { return IsOfRoom(id.number() - 1); }
  using Chosen = std::function<bool(size_t)>;

  /// What a camera at `x` sees; somebody has gone by `gone`.
  TrackedFrame Sharp(uint32_t index, double x, const Chosen& shown = {}, double gone = 0) const {
    return scene_.See(index, Time(index).stamp_ns, MapScene::PoseAt(x), [&](size_t i) {
      const Eigen::Vector3d offset(IsOfRoom(i) ? 0.0 : gone, 0, 0);
      return shown && !shown(i) ? std::nullopt : std::optional<Eigen::Vector3d>(scene_.point(i) + offset);
    });
  }
  /// The same, but so blurred that nothing is told by its descriptor alone.
  TrackedFrame Blurred(uint32_t index, double x, const Chosen& shown = {}, double gone = 0) const {
    const TrackedFrame sharp = Sharp(index, x, shown, gone);
    FeatureSet set = sharp.features->set;
    for (Descriptor& d : set.descriptors) {
      for (size_t bit = 0; bit < 55; ++bit) d.words[bit % 4] ^= uint64_t{1} << (bit / 4);
    }
    return TrackedFrame(index, sharp.stamp_ns,
                        MakeFrameFeatures(std::move(set), scene_.map().camera(), scene_.map().pyramid()));
  }
  /// Each point that `so` names is up to `px` beside its place.
  TrackedFrame Scattered(uint32_t index, double x, double px, const Chosen& shown, const Chosen& so) const {
    Random random(8);
    return scene_.See(index, Time(index).stamp_ns, MapScene::PoseAt(x), [&](size_t i) {
      const double right_px = random.Uniform(-px, px), down_px = random.Uniform(-px, px);
      Eigen::Vector3d p_world = scene_.point(i);
      if (so(i)) p_world += p_world.z() / 500 * Eigen::Vector3d(right_px, down_px, 0);
      return shown(i) ? std::optional(p_world) : std::nullopt;
    });
  }
  static bool All(size_t) { return true; }

  MotionFollower::Attempt Follow(TrackedFrame* frame, bool careful = false) {
    return follower_.Follow(scene_.map(), {frame->index, frame->stamp_ns}, careful, 1, &search_, frame);
  }
  void OnTracked(const TrackedFrame& frame, bool jumped = false) {
    follower_.OnTracked(scene_.map(), PlacedPose::Of(Keyframe0(), frame.T_cam_world), {frame.T_cam_world},
                        {frame.index, frame.stamp_ns}, frame, jumped);
  }
  /// Frames 1 and 2, so that its motion is known.
  void TrackTwo() {
    for (const uint32_t index : {1U, 2U}) {
      TrackedFrame frame = Sharp(index, index * kStep);
      ASSERT_TRUE(Follow(&frame).report.HasPose()) << index;
      OnTracked(frame);
    }
    ASSERT_TRUE(Prediction(3).prior);
  }
  /// What was tracked last saw only so much.
  void LetLastHaveSeen(const Chosen& saw) {
    TrackedFrame last = follower_.last();
    for (LandmarkId& id : last.landmarks) {
      if (id.valid() && !saw(id.number() - 1)) id = {};
    }
    follower_.SetLast(std::move(last));
  }
  MotionModel::Prediction Prediction(uint32_t frame) const {
    return follower_.motion().Predict(scene_.map(), Time(frame));
  }
  static double ErrorAt(const Rigid3d& T_cam_world, double x) {
    return (T_cam_world.Center() - Eigen::Vector3d(x, 0, 0)).norm();
  }

  MapScene scene_;
  size_t room_ = 0;
  PoseSearch search_{{}, TestCamera()};
  MotionFollower follower_{{}};
};

TEST_F(MotionFollowerTest, GoesOnFromAKeyframeAndThenFromFrameToFrame) {
  AddRoom();
  Begin();
  EXPECT_EQ(follower_.last().index, 0U);
  for (uint32_t index = 1; index <= 6; ++index) {
    TrackedFrame frame = Blurred(index, index * kStep);
    const MotionFollower::Attempt attempt = Follow(&frame);
    ASSERT_TRUE(attempt.report.HasPose()) << attempt.report.reason;
    EXPECT_LT(ErrorAt(frame.T_cam_world, index * kStep), 2e-3);
    EXPECT_FALSE(attempt.begins_anew);
    EXPECT_TRUE(attempt.weak_pose);
    OnTracked(frame);
    EXPECT_EQ(follower_.last().index, index);
    EXPECT_EQ(follower_.last().landmarks, frame.landmarks);
  }
  EXPECT_LT(ErrorAt(*Prediction(7).T_cam_world, 7 * kStep), 2e-3) << "its motion is known";
}

TEST_F(MotionFollowerTest, WhoIsNowhereIsNotFollowed) {
  AddRoom();
  Begin();
  follower_.BeginLost();
  EXPECT_FALSE(follower_.motion().last()) << "who is nowhere has no place to be near to";
  EXPECT_FALSE(follower_.motion().last_stamp_ns());
  TrackedFrame frame = Sharp(1, kStep);
  const MotionFollower::Attempt attempt = Follow(&frame);
  EXPECT_FALSE(attempt.report.HasPose());
  EXPECT_STREQ(attempt.report.reason, kNotSeen);
  EXPECT_FALSE(attempt.weak_pose);
}

TEST_F(MotionFollowerTest, WhoWasSeenLongAgoIsNotFollowed) {
  AddRoom();
  Begin();
  TrackedFrame frame = Sharp(14, kStep);
  EXPECT_TRUE(Follow(&frame).report.HasPose());
  frame = Sharp(16, kStep);
  const MotionFollower::Attempt attempt = Follow(&frame);
  EXPECT_FALSE(attempt.report.HasPose()) << "half a second";
  EXPECT_STREQ(attempt.report.reason, kNotSeen);
}

TEST_F(MotionFollowerTest, WhereTheLastFrameSawLittleAllThatLiesAroundIsLookedForIfTheMotionIsKnown) {
  AddRoom();
  Begin();
  TrackTwo();
  LetLastHaveSeen([](size_t i) { return i < 5; });
  TrackedFrame frame = Blurred(3, 3 * kStep);
  EXPECT_TRUE(Follow(&frame).report.HasPose());
  EXPECT_LT(ErrorAt(frame.T_cam_world, 3 * kStep), 2e-3);
  follower_.Stop();
  EXPECT_FALSE(Prediction(3).prior);
  frame = Blurred(3, 3 * kStep);
  EXPECT_FALSE(Follow(&frame).report.HasPose());
}

TEST_F(MotionFollowerTest, AndWhereItIsNotByTheKeyframeThatItWasSeenFrom) {
  AddRoom();
  Begin();
  LetLastHaveSeen([](size_t i) { return i < 5; });
  TrackedFrame frame = Sharp(1, 0.15);
  EXPECT_TRUE(Follow(&frame).report.HasPose());
  EXPECT_LT(ErrorAt(frame.T_cam_world, 0.15), 2e-3);
}

TEST_F(MotionFollowerTest, FewThatAreWhereTheyArePredictedLeadOnButAreNotTold) {
  AddRoom();
  Begin();
  TrackTwo();
  LetLastHaveSeen([](size_t i) { return i < 5; });
  TrackedFrame frame = Blurred(3, 3 * kStep, [](size_t i) { return i < 14; });
  MotionFollower::Attempt attempt = Follow(&frame);
  EXPECT_FALSE(attempt.report.HasPose());
  EXPECT_STREQ(attempt.report.reason, kNotSeen);
  EXPECT_NE(attempt.report.outcome, TrackingReport::Outcome::kContradicted);
  ASSERT_TRUE(attempt.weak_pose);
  EXPECT_LT(ErrorAt(attempt.weak_pose->T_cam_world, 3 * kStep), 5e-3);
  follower_.Coast(scene_.map(), *attempt.weak_pose, Time(3));
  EXPECT_TRUE(follower_.motion().IsCoasting());
  EXPECT_EQ(follower_.last().index, 2U) << "it is not placed";
  EXPECT_LT(ErrorAt(*Prediction(4).T_cam_world, 4 * kStep), 1e-2);

  frame = Blurred(4, 4 * kStep, [](size_t i) { return i < 7; });
  attempt = Follow(&frame);
  EXPECT_FALSE(attempt.weak_pose) << "too few for that";
}

TEST_F(MotionFollowerTest, AWeakPoseIsNoMoreThanWhatTheMapAroundLeavesOfIt) {
  AddRoom();
  Begin();
  const auto shown = [](size_t i) { return i < 24; };
  TrackedFrame frame = Scattered(1, kStep, 9, shown, [](size_t i) { return i % 2 == 0; });
  MotionFollower::Attempt attempt = Follow(&frame);
  EXPECT_FALSE(attempt.report.HasPose());
  EXPECT_STREQ(attempt.report.reason, "too few static features match the map");
  ASSERT_TRUE(attempt.weak_pose);
  EXPECT_LT(ErrorAt(attempt.weak_pose->T_cam_world, kStep), 1e-2);
  EXPECT_GE(attempt.report.num_static, 12);
  TrackingOptions options;
  options.min_coasting_inliers = attempt.report.num_static + 1;
  follower_ = MotionFollower(options);
  follower_.BeginAt(Keyframe0(), Time(0));
  frame = Scattered(1, kStep, 9, shown, [](size_t i) { return i % 2 == 0; });
  attempt = Follow(&frame);
  EXPECT_FALSE(attempt.weak_pose);
}

TEST_F(MotionFollowerTest, WhatIsNearTheLastPlacesButNotInThemContradicts) {
  AddRoom(40);
  Begin();
  TrackedFrame frame = Scattered(1, kStep, 9, All, All);
  const MotionFollower::Attempt attempt = Follow(&frame);
  EXPECT_FALSE(attempt.report.HasPose());
  EXPECT_EQ(attempt.report.outcome, TrackingReport::Outcome::kContradicted);
}

TEST_F(MotionFollowerTest, MoreIsAskedWhereItIsCareful) {
  AddRoom();
  Begin();
  const auto shown = [](size_t i) { return i < 25; };
  TrackedFrame frame = Sharp(1, kStep, shown);
  EXPECT_TRUE(Follow(&frame).report.HasPose());
  frame = Sharp(1, kStep, shown);
  EXPECT_FALSE(Follow(&frame, true).report.HasPose());
}

TEST_F(MotionFollowerTest, AJoltThatNoHandMakesIsNotFollowed) {
  AddRoom();
  Begin();
  TrackTwo();
  TrackedFrame frame = Sharp(3, 3 * kStep + 0.22);
  const MotionFollower::Attempt attempt = Follow(&frame);
  ASSERT_GT(frame.T_cam_world.Center().x(), 3 * kStep + 0.165) << "it is found there";
  EXPECT_FALSE(attempt.report.HasPose());
  EXPECT_STREQ(attempt.report.reason, "the pose contradicts the camera's motion");
  EXPECT_EQ(attempt.report.outcome, TrackingReport::Outcome::kContradicted);
  EXPECT_FALSE(attempt.weak_pose);
}

TEST_F(MotionFollowerTest, AJumpIsNoMotion) {
  AddRoom();
  Begin();
  TrackTwo();
  TrackedFrame frame = Sharp(3, 3 * kStep);
  ASSERT_TRUE(Follow(&frame).report.HasPose());
  OnTracked(frame, true);
  EXPECT_FALSE(Prediction(4).prior);
}

// The frames before may have followed the room or somebody, who stays where the camera would be without him.
TEST_F(MotionFollowerTest, WhereTheFramesBeforeFollowedSomebodyHisMotionIsForgotten) {
  AddRoom(80);
  AddSomebody(110);
  Begin();
  TrackTwo();
  const double there = 3 * kStep + 0.1;
  TrackedFrame frame = Sharp(3, there, All, 0.1);
  MotionFollower::Attempt attempt = Follow(&frame);
  EXPECT_TRUE(attempt.report.HasPose()) << attempt.report.reason;
  EXPECT_TRUE(attempt.begins_anew);
  EXPECT_LT(ErrorAt(frame.T_cam_world, there), 5e-4) << "what was expected of him has no say";
  EXPECT_FALSE(Prediction(4).prior);

  frame = Blurred(3, 2 * kStep + 0.1, All, 0.1);  // neither the motion nor the keyframe helps
  attempt = Follow(&frame);
  EXPECT_TRUE(attempt.report.HasPose()) << attempt.report.reason;
  EXPECT_TRUE(attempt.begins_anew);
}

TEST_F(MotionFollowerTest, HoweverFarTheRoomIsFromWhereHisMotionLed) {
  AddRoom(100);
  AddSomebody(60);
  Begin();
  TrackTwo();
  LetLastHaveSeen([&](size_t i) { return !IsOfRoom(i); });
  const double there = 3 * kStep + 0.19;
  TrackedFrame frame = Sharp(3, there, All, 0.19);
  const MotionFollower::Attempt attempt = Follow(&frame);
  EXPECT_TRUE(attempt.report.HasPose()) << attempt.report.reason;
  EXPECT_TRUE(attempt.begins_anew);
  EXPECT_LT(ErrorAt(frame.T_cam_world, there), 2e-3);
  EXPECT_FALSE(Prediction(4).prior);
}

}  // namespace
}  // namespace dmslam
