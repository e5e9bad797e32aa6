// The part of the map around a frame.
#include "dmslam/tracking/local_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"

namespace dmslam {
namespace {

constexpr size_t kFeatures = 100;

KeyframeId Kf(uint32_t index) { return KeyframeId::Make(1, index); }
LandmarkId Lm(size_t index) { return LandmarkId::Make(1, index + 1); }

FeatureSet NoMatterWhich() {
  FeatureSet set;
  set.keypoints.resize(kFeatures);
  set.descriptors.resize(kFeatures);
  return set;
}

/// A chain: keyframe k sees landmarks 20 k to 20 k + 59, so that it shares 40 with the next, 20 with the next
/// but one, and none with those further on.
class Chain : public ::testing::Test {
 protected:
  static constexpr uint32_t kKeyframes = 8;

  Chain() : map_(TestCamera(), Pyramid()) {
    for (uint32_t k = 0; k < kKeyframes; ++k) {
      Keyframe keyframe;
      keyframe.id = Kf(k);
      keyframe.map_id = 1;
      if (k > 0) keyframe.parent = Kf(k - 1);
      keyframe.features = MakeFrameFeatures(NoMatterWhich(), map_.camera(), map_.pyramid());
      map_.AddKeyframe(std::move(keyframe));
      for (size_t i = 0; i < 60; ++i) {
        const LandmarkId id = Lm(20 * k + i);
        if (map_.FindLandmark(id) == nullptr) {
          Landmark landmark;
          landmark.id = id;
          landmark.map_id = 1;
          landmark.p_world = {0, 0, 4};
          landmark.reference = landmark.first_keyframe = Kf(k);
          map_.AddLandmark(landmark);
        }
        map_.SetObservation(map_.At(Kf(k)), static_cast<uint16_t>(i), map_.At(id));
      }
    }
  }

  /// A frame matched with landmarks [first, first + count).
  TrackedFrame Seeing(size_t first, size_t count) {
    TrackedFrame frame(9, 0, MakeFrameFeatures(NoMatterWhich(), map_.camera(), map_.pyramid()));
    for (size_t i = 0; i < count; ++i) frame.landmarks[i] = Lm(first + i);
    return frame;
  }
  static bool Has(const LocalMap& local, size_t landmark) {
    const std::vector<LandmarkId>& all = local.landmarks();
    return std::binary_search(all.begin(), all.end(), Lm(landmark));
  }

  MapEditor map_;
};

TEST_F(Chain, TheReferenceIsTheKeyframeThatSharesMost) {
  LocalMap local(60);
  EXPECT_FALSE(local.reference());
  local.Collect(map_, Seeing(60, 60));
  EXPECT_EQ(local.reference(), Kf(3));
}

TEST_F(Chain, ItGoesBeyondWhatTheFrameSeesButNotToTheEnd) {
  LocalMap local(60);
  local.Collect(map_, Seeing(0, 20));  // keyframe 0 alone sees them
  EXPECT_TRUE(Has(local, 59)) << "of keyframe 0";
  EXPECT_TRUE(Has(local, 79)) << "of its neighbour";
  EXPECT_FALSE(Has(local, 20 * (kKeyframes - 1) + 59));
  EXPECT_TRUE(std::is_sorted(local.landmarks().begin(), local.landmarks().end()));
  EXPECT_EQ(std::adjacent_find(local.landmarks().begin(), local.landmarks().end()), local.landmarks().end());
}

TEST_F(Chain, LandmarksOfAMapperThatTookOverAreSortedBehindTheOthers) {
  Landmark landmark;
  landmark.id = LandmarkId::Make(2, 1);  // far from the others' numbers
  landmark.map_id = 1;
  landmark.p_world = {0, 0, 4};
  landmark.reference = landmark.first_keyframe = Kf(0);
  map_.AddLandmark(landmark);
  for (const uint32_t k : {0u, 1u}) map_.SetObservation(map_.At(Kf(k)), 90, map_.At(landmark.id));
  LocalMap local(60);
  local.Collect(map_, Seeing(0, 60));
  const std::vector<LandmarkId>& all = local.landmarks();
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
  EXPECT_EQ(std::count(all.begin(), all.end(), landmark.id), 1);
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
}

/// Keyframes of another session have numbers far from the others'; they are counted all the same.
TEST_F(Chain, KeyframesOfAnotherSessionCountAsWell) {
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(2, 1);
  keyframe.map_id = 1;
  keyframe.parent = Kf(0);
  keyframe.features = MakeFrameFeatures(NoMatterWhich(), map_.camera(), map_.pyramid());
  map_.AddKeyframe(std::move(keyframe));
  for (size_t i = 0; i < 60; ++i)
    map_.SetObservation(map_.At(KeyframeId::Make(2, 1)), static_cast<uint16_t>(i), map_.At(Lm(30 + i)));
  LocalMap local(60);
  local.Collect(map_, Seeing(30, 60));
  EXPECT_EQ(local.reference(), KeyframeId::Make(2, 1)) << "it sees all of them";
  local.Collect(map_, Seeing(20, 60));
  EXPECT_EQ(local.reference(), Kf(1)) << "the other sees fewer";
}

TEST_F(Chain, NoMoreKeyframesThanAllowed) {
  LocalMap all(60), one(1);
  const TrackedFrame frame = Seeing(0, 100);
  all.Collect(map_, frame);
  one.Collect(map_, frame);
  EXPECT_GT(all.landmarks().size(), 100u);
  EXPECT_EQ(one.landmarks().size(), 60u);
}

TEST_F(Chain, AFrameThatIsMatchedWithNothingLeavesTheReference) {
  LocalMap local(60);
  local.Collect(map_, Seeing(60, 60));
  local.Collect(map_, Seeing(0, 0));
  EXPECT_EQ(local.reference(), Kf(3));
  local.Reset();
  EXPECT_FALSE(local.reference());
  EXPECT_TRUE(local.landmarks().empty());
}

TEST_F(Chain, WhatHasLeftTheMapIsTakenOut) {
  LocalMap local(60);
  local.Collect(map_, Seeing(60, 60));
  ASSERT_TRUE(Has(local, 70));
  map_.RemoveLandmark(map_.At(Lm(70)));
  local.DropGone(map_);
  EXPECT_FALSE(Has(local, 70));
  EXPECT_TRUE(Has(local, 71));
}

}  // namespace
}  // namespace dmslam
