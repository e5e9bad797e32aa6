#include "dmslam/refinement/frame_refiner.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kLandmarks = 60;

/// A keyframe at the origin and landmarks in front of it; a frame a little to the side sees them all.
class Refining : public testing::Test {
 protected:
  Refining() : map_(TestCamera(), Pyramid()) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, 0);
    keyframe.map_id = 1;
    keyframe.features = MakeFrameFeatures(FeatureSet(), map_.camera(), map_.pyramid());
    map_.AddKeyframe(std::move(keyframe));
    truth_.translation = Eigen::Vector3d(-0.2, 0.05, 0.1);
    Random random(7);
    FeatureSet features;
    std::vector<LandmarkId> ids;
    for (uint32_t i = 0; i < kLandmarks; ++i) {
      Landmark landmark;
      landmark.id = LandmarkId::Make(1, i + 1);
      landmark.map_id = 1;
      landmark.p_world =
          Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-0.7, 0.7), random.Uniform(2, 4));
      landmark.reference = landmark.first_keyframe = KeyframeId::Make(1, 0);
      const Eigen::Vector2d uv_px = *map_.camera().Project(truth_ * landmark.p_world);
      Keypoint keypoint;
      keypoint.x_q4 = static_cast<uint16_t>(std::lround(16 * uv_px.x()));
      keypoint.y_q4 = static_cast<uint16_t>(std::lround(16 * uv_px.y()));
      features.keypoints.push_back(keypoint);
      features.descriptors.emplace_back();
      ids.push_back(landmark.id);
      map_.AddLandmark(std::move(landmark));
    }
    frame_ = TrackedFrame(5, 1000, MakeFrameFeatures(features, map_.camera(), map_.pyramid()));
    frame_.landmarks = ids;
    frame_.classes.assign(kLandmarks, FeatureClass::kUsed);
    told_.frame_index = 5;
    told_.stamp_ns = 1000;
    told_.state = TrackingState::kTracking;
    told_.map_id = 1;
    told_.reference = KeyframeId::Make(1, 0);
    told_.T_cam_reference = truth_;
    told_.T_cam_reference.translation += Eigen::Vector3d(0.03, -0.02, 0.02);  // as an immature map had it
  }

  std::vector<FramePose> Refine(FrameRefiner& refiner, const FrameRefiner::Search& search = {}) const {
    std::vector<FramePose> poses;
    refiner.Begin(map_);
    while (refiner.IsBusy()) {
      if (auto pose = refiner.RefineNext(map_, search)) poses.push_back(pose->pose);
    }
    return poses;
  }

  MapEditor map_;
  Rigid3d truth_;
  TrackedFrame frame_;
  FramePose told_;
};

TEST_F(Refining, PoseComesFromTheMapAsItIsNow) {
  FrameRefiner refiner;
  refiner.Keep(frame_, told_);
  const std::vector<FramePose> refined = Refine(refiner);
  ASSERT_EQ(refined.size(), 1U);
  EXPECT_EQ(refined[0].frame_index, 5U);
  EXPECT_EQ(refined[0].state, TrackingState::kLocalizedLater);
  EXPECT_LT((refined[0].T_cam_reference.translation - truth_.translation).norm(), 1e-3);
  EXPECT_TRUE(Refine(refiner).empty()) << "frames are told once";
}

TEST_F(Refining, FrameThatTheMapContradictsIsLeftOut) {
  FrameRefiner refiner;
  refiner.Keep(frame_, told_);
  Random random(3);
  for (const LandmarkId id : map_.LandmarkIdsSorted()) {
    const Eigen::Vector3d shift(random.Uniform(-1, 1), random.Uniform(-1, 1), 0);
    map_.SetPosition(map_.At(id), map_.FindLandmark(id)->p_world + shift);
  }
  EXPECT_TRUE(Refine(refiner).empty());
}

/// What the frame sees puts it 0.23 from the keyframe at the origin, where it was told to be.
TEST_F(Refining, AFrameStaysWhereItWasToldWhereTheCameraCannotHaveGoneAsideInTheTime) {
  told_.T_cam_reference = Rigid3d();
  told_.stamp_ns = 200'000'000;
  FrameRefiner still;
  still.Keep(frame_, told_);
  EXPECT_TRUE(Refine(still).empty());
  Keyframe far;
  far.id = KeyframeId::Make(1, 10);
  far.map_id = 1;
  far.stamp_ns = 400'000'000;
  far.T_cam_world.translation.x() = -0.4;
  far.features = MakeFrameFeatures(FeatureSet(), map_.camera(), map_.pyramid());
  map_.AddKeyframe(std::move(far));
  FrameRefiner moving;
  moving.Keep(frame_, told_);
  const std::vector<FramePose> refined = Refine(moving);
  ASSERT_EQ(refined.size(), 1U) << "a camera that moves so fast can";
  EXPECT_LT((refined[0].T_cam_reference.translation - truth_.translation).norm(), 1e-3);
}

TEST_F(Refining, FrameThatWasNeverToldKeepsItsPlaceWithNothingMeasured) {
  FrameRefiner refiner;
  told_.state = TrackingState::kLocalizedLater;
  refiner.Keep(frame_, told_);
  for (const LandmarkId id : map_.LandmarkIdsSorted()) map_.RemoveLandmark(map_.At(id));
  refiner.Begin(map_);
  const std::optional<FinalPose> kept = refiner.RefineNext(map_, {});
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->pose.frame_index, 5U);
  EXPECT_LT((kept->pose.T_cam_reference.translation - told_.T_cam_reference.translation).norm(), 1e-12);
  EXPECT_TRUE(kept->information.isZero());
  EXPECT_TRUE(kept->sights.empty());
}

/// Tells of every landmark where it is.
bool FindAll(const std::vector<LandmarkId>& ids, TrackedFrame* frame) {
  frame->landmarks = ids;
  frame->classes.assign(ids.size(), FeatureClass::kUsed);
  return true;
}

TEST_F(Refining, WhatTheMapHasWonSinceCounts) {
  const std::vector<LandmarkId> ids = frame_.landmarks;
  for (size_t i = 20; i < ids.size(); ++i) frame_.landmarks[i] = {};  // too few to be refined with
  FrameRefiner refiner;
  refiner.Keep(frame_, told_);
  int known = 0;
  const auto refined = Refine(refiner, [&](TrackedFrame* frame) {
    for (const LandmarkId id : frame->landmarks) known += id.valid();
    return FindAll(ids, frame);
  });
  EXPECT_EQ(known, 20);
  ASSERT_EQ(refined.size(), 1U);
  EXPECT_LT((refined[0].T_cam_reference.translation - truth_.translation).norm(), 1e-3);
}

/// How many landmarks the last of three frames of a standing camera sees. From where the third was told to be
/// only two thirds of them are found.
size_t SeenByTheThird(const Map& map, const TrackedFrame& frame, FramePose told, const Rigid3d& truth,
                      bool follow_motion) {
  FrameRefiner refiner({.for_smoothing = follow_motion});
  for (const int64_t stamp_ns : {1000, 2000, 3000}) {
    told.stamp_ns = stamp_ns;
    refiner.Keep(frame, told);
  }
  refiner.Begin(map);
  std::optional<FinalPose> refined;
  int searches = 0;
  while (refiner.IsBusy()) {
    refined = refiner.RefineNext(map, [&](TrackedFrame* searched) {
      FindAll(frame.landmarks, searched);
      const bool astray = (searched->T_cam_world.translation - truth.translation).norm() > 0.01;
      if (++searches > 2 && astray) std::fill_n(searched->landmarks.begin(), kLandmarks / 3, LandmarkId());
      return true;
    });
  }
  return refined ? refined->sights.size() : 0;
}

TEST_F(Refining, WhereAFrameSeesLessThanTheOneBeforeItIsLookedForFromTheMotion) {
  EXPECT_EQ(SeenByTheThird(map_, frame_, told_, truth_, false), static_cast<size_t>(kLandmarks * 2 / 3));
  EXPECT_EQ(SeenByTheThird(map_, frame_, told_, truth_, true), static_cast<size_t>(kLandmarks));
}

/// What is refined of nine frames of a moving camera, each of which was told with an error of its own, by so
/// many threads; 0: without looking ahead.
std::vector<FramePose> RefinedBy(size_t threads, const Map& map, const TrackedFrame& frame, FramePose told) {
  FrameRefiner refiner({.for_smoothing = true});
  for (int i = 0; i < 9; ++i) {
    told.stamp_ns += 1000;
    told.T_cam_reference.translation.x() += 0.002 * i;
    refiner.Keep(frame, told);
  }
  const std::vector<FrameRefiner::Search> searches(std::max<size_t>(threads, 1), [&](TrackedFrame* searched) {
    return FindAll(frame.landmarks, searched);
  });
  refiner.Begin(map);
  std::vector<FramePose> refined;
  while (refiner.IsBusy()) {
    if (threads > 0 && !refiner.IsAhead()) refiner.LookAhead(map, searches);
    if (auto pose = refiner.RefineNext(map, searches.front())) refined.push_back(pose->pose);
  }
  EXPECT_FALSE(refiner.IsAhead());
  return refined;
}

TEST_F(Refining, FramesThatAreLookedForTogetherAreWhereTheyWouldBeAlone) {
  const auto alone = RefinedBy(0, map_, frame_, told_);
  ASSERT_EQ(alone.size(), 9U);
  for (const size_t threads : {1U, 2U, 3U}) {
    const auto together = RefinedBy(threads, map_, frame_, told_);
    ASSERT_EQ(together.size(), alone.size());
    for (size_t k = 0; k < alone.size(); ++k) {
      EXPECT_EQ(together[k].stamp_ns, alone[k].stamp_ns);
      EXPECT_EQ(together[k].T_cam_world.translation, alone[k].T_cam_world.translation);
    }
  }
}

TEST_F(Refining, WhatWasLookedForAheadIsLeftWhereTheMapIsGone) {
  FrameRefiner refiner;
  for (int i = 0; i < 2; ++i) refiner.Keep(frame_, told_);
  refiner.Begin(map_);
  const std::vector<FrameRefiner::Search> searches(2);
  refiner.LookAhead(map_, searches);
  const MapEditor emptied(TestCamera(), Pyramid());
  while (refiner.IsBusy()) EXPECT_FALSE(refiner.RefineNext(emptied, {}));
}

TEST_F(Refining, FramesOfAMapThatWasWrongAreGivenBackWithTheirFeatures) {
  FrameRefiner refiner;
  refiner.Keep(frame_, told_);
  FramePose of_another = told_;
  of_another.map_id = 2;
  of_another.frame_index = 6;
  refiner.Keep(frame_, of_another);
  const std::vector<WaitingFrame> back = refiner.TakeFramesOf(2);
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].index, 6U);
  EXPECT_EQ(back[0].stamp_ns, 1000);
  EXPECT_EQ(back[0].features.keypoints.size(), static_cast<size_t>(kLandmarks));
  const std::vector<FramePose> refined = Refine(refiner);
  ASSERT_EQ(refined.size(), 1U);
  EXPECT_EQ(refined[0].frame_index, 5U);
}

TEST_F(Refining, AFailedSearchLeavesWhatTheFrameSaw) {
  FrameRefiner refiner;
  refiner.Keep(frame_, told_);
  const auto refined = Refine(refiner, [](TrackedFrame* frame) {
    frame->ClearMatches();
    return false;
  });
  ASSERT_EQ(refined.size(), 1U);
  EXPECT_LT((refined[0].T_cam_reference.translation - truth_.translation).norm(), 1e-3);
}

TEST_F(Refining, FeaturesOfTheOldestAreForgottenBeyondTheBound) {
  FrameRefiner refiner({.max_features = 2 * kLandmarks});
  for (uint32_t i = 0; i < 4; ++i) {
    told_.frame_index = i;
    refiner.Keep(frame_, told_);
  }
  std::vector<uint32_t> searched;
  const auto refined = Refine(refiner, [&](TrackedFrame* frame) {
    searched.push_back(frame->index);
    return false;
  });
  EXPECT_EQ(searched, (std::vector<uint32_t>{2, 3}));
  EXPECT_EQ(refined.size(), 4U);
}

TEST_F(Refining, OldestIsDroppedBeyondTheBound) {
  FrameRefiner refiner({.max_frames = 2});
  for (uint32_t i = 0; i < 4; ++i) {
    told_.frame_index = i;
    refiner.Keep(frame_, told_);
  }
  const std::vector<FramePose> refined = Refine(refiner);
  ASSERT_EQ(refined.size(), 2U);
  EXPECT_EQ(refined[0].frame_index, 2U);
  EXPECT_EQ(refined[1].frame_index, 3U);
}

}  // namespace
}  // namespace dmslam
