#include "dmslam/mapping/map_maintenance.h"

#include <gtest/gtest.h>

#include <utility>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

constexpr int kFeatures = 9;

KeyframeId Id(uint32_t frame) { return KeyframeId::Make(1, frame); }
LandmarkId Numbered(uint64_t number) { return LandmarkId::Make(1, number); }

/// Keyframes are inserted in any order of their frames; all look at what lies four units before the first.
class Maintenance : public testing::Test {
 protected:
  Maintenance() : map_(TestCamera(), Pyramid()) {}

  void Insert(uint32_t frame) {
    FeatureSet features;
    features.keypoints.resize(kFeatures);
    features.descriptors.resize(kFeatures);
    Keyframe keyframe;
    keyframe.id = Id(frame);
    keyframe.map_id = 1;
    keyframe.stamp_ns = frame;
    if (!map_.keyframes().empty())
      keyframe.parent = root_;
    else
      root_ = Id(frame);
    keyframe.features = MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid());
    map_.AddKeyframe(std::move(keyframe));
    order_.Add(Id(frame));
  }
  void See(uint64_t number, double depth, std::initializer_list<uint32_t> frames, uint32_t made_with) {
    Landmark landmark;
    landmark.id = Numbered(number);
    landmark.map_id = 1;
    landmark.p_world = Eigen::Vector3d(0, 0, depth);
    landmark.reference = landmark.first_keyframe = Id(made_with);
    map_.AddLandmark(std::move(landmark));
    for (const uint32_t frame : frames)
      map_.SetObservation(Id(frame), static_cast<uint16_t>(number % kFeatures), Numbered(number));
  }
  bool Has(uint64_t number) const { return map_.FindLandmark(Numbered(number)) != nullptr; }

  MapEditor map_;
  InsertionOrder order_;
  KeyframeId root_;
};

TEST_F(Maintenance, ProbationCountsKeyframesAsTheyCameNotAsTheyWereSeen) {
  for (const uint32_t frame : {50U, 60U, 70U}) Insert(frame);  // tracked
  Insert(40);                                                  // and back from there
  See(1, 4.0, {40, 50}, 40);
  EXPECT_EQ(order_.CountSince(map_, Id(40), 3), 0);
  Insert(30);
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, {}), 0) << "one keyframe later it is too early";
  Insert(20);
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, {}), 1) << "seen by two after two more keyframes";
  EXPECT_FALSE(Has(1));
}

TEST_F(Maintenance, ProbationEndsAfterThreeKeyframes) {
  for (const uint32_t frame : {50U, 40U, 30U, 20U, 10U}) Insert(frame);
  See(1, 4.0, {40, 50}, 40);
  EXPECT_EQ(order_.CountSince(map_, Id(40), 3), 3);
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, {}), 0);
}

TEST_F(Maintenance, CulledKeyframesCount) {
  for (const uint32_t frame : {50U, 40U, 30U}) Insert(frame);
  map_.RemoveKeyframe(Id(40));
  EXPECT_EQ(order_.CountSince(map_, Id(50), 3), 2);
  EXPECT_EQ(order_.Newest(map_, 1, 8), (std::vector<KeyframeId>{Id(30), Id(50)}));
}

TEST_F(Maintenance, KeyframesOfADroppedMapDoNotCount) {
  for (const uint32_t frame : {50U, 40U}) Insert(frame);
  EXPECT_EQ(order_.CountSince(map_, Id(50), 3), 1);
  map_.DropMap(1);
  EXPECT_EQ(order_.CountSince(map_, Id(50), 3), 0);
}

TEST_F(Maintenance, OrderOfAMapOfOthersIsAssumedToBeThatOfItsStamps) {
  for (const uint32_t frame : {50U, 40U, 60U}) Insert(frame);
  InsertionOrder assumed;
  assumed.Assume(map_);
  EXPECT_EQ(assumed.Newest(map_, 1, 8), (std::vector<KeyframeId>{Id(60), Id(50), Id(40)}));
  MapProgress progress;
  progress.settled = Id(40);
  map_.SetProgress(progress);
  assumed.Assume(map_);
  EXPECT_EQ(assumed.Newest(map_, 1, 8), (std::vector<KeyframeId>{Id(40), Id(60), Id(50)}));
}

TEST_F(Maintenance, WhatLiesJustBeforeALensGoes) {
  for (const uint32_t frame : {1U, 2U}) Insert(frame);
  for (uint64_t number = 1; number <= 5; ++number) See(number, 4.0, {1, 2}, 2);
  See(6, 0.1, {1, 2}, 2);
  See(7, 0.5, {1, 2}, 2);
  See(8, -1.0, {1, 2}, 2);
  EXPECT_EQ(RemoveTooNear(map_, 1, 0.0), 0) << "switched off";
  EXPECT_EQ(RemoveTooNear(map_, 2, 0.05), 0) << "another map";
  EXPECT_EQ(RemoveTooNear(map_, 1, 0.05), 2);
  EXPECT_FALSE(Has(6));
  EXPECT_FALSE(Has(8));
  EXPECT_TRUE(Has(7));
}

}  // namespace
}  // namespace dmslam
