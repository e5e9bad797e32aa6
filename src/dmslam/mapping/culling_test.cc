#include "dmslam/mapping/culling.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

class Culling : public testing::Test {
 protected:
  void Insert(std::initializer_list<uint32_t> frames) {
    for (const uint32_t frame : frames) {
      scene_.AddKeyframe(map_, frame, 0.001 * frame);
      order_.Add(Id(frame));
    }
  }
  LandmarkId See(uint64_t number, const std::vector<uint32_t>& frames) {
    return scene_.AddLandmark(map_, number, static_cast<uint16_t>(number), frames);
  }
  bool Has(uint64_t number) const { return map_.FindLandmark(LandmarkId::Make(1, number)) != nullptr; }

  WallScene scene_;
  MapEditor map_{TestCamera(), Pyramid()};
  InsertionOrder order_;
  MapperOptions options_;
};

TEST_F(Culling, ALandmarkSeenByTwoGoesAfterTwoMoreKeyframes) {
  Insert({50, 60, 70, 40});  // tracked to 70, and back from there
  See(1, {40, 50});
  See(2, {40, 50, 60});
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, options_), 0);
  Insert({30});
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, options_), 0) << "one keyframe later it is too early";
  Insert({20});
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, options_), 1);
  EXPECT_FALSE(Has(1));
  EXPECT_TRUE(Has(2)) << "three see it";
}

TEST_F(Culling, ProbationEndsAfterThreeKeyframes) {
  Insert({50, 40, 30, 20, 10});
  See(1, {40, 50});
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, options_), 0);
}

TEST_F(Culling, AYoungLandmarkThatIsSeldomFoundGoes) {
  Insert({10, 20, 30});
  map_.SetEvidence(map_.At(See(1, {30, 10})), {20, 4, 0, 0, 0});
  map_.SetEvidence(map_.At(See(2, {30, 10})), {20, 5, 0, 0, 0});
  EXPECT_EQ(CullYoungLandmarks(map_, 1, order_, options_), 1);
  EXPECT_FALSE(Has(1));
}

TEST_F(Culling, LandmarksOfOtherMapsStay) {
  Insert({50, 60, 70});
  See(1, {50, 60});
  EXPECT_EQ(CullYoungLandmarks(map_, 2, order_, options_), 0);
}

/// Keyframes 1 to 5 see twenty landmarks; of 2, one in twenty is seen by nobody else but 1.
class Redundancy : public Culling {
 protected:
  Redundancy() {
    Insert({1, 2, 3, 4, 5});
    for (uint64_t number = 0; number < 20; ++number) See(number + 1, {1, 2, 3, 4, 5});
    See(30, {1, 2});
  }
};

TEST_F(Redundancy, AKeyframeWhoseLandmarksThreeOthersSeeGoes) {
  EXPECT_EQ(CullRedundantKeyframes(map_, map_.At(Id(5)), {}, options_), 2);
  EXPECT_EQ(map_.FindKeyframe(Id(2)), nullptr) << "the first of those with most in common";
  EXPECT_EQ(map_.FindKeyframe(Id(3)), nullptr);
  EXPECT_NE(map_.FindKeyframe(Id(4)), nullptr) << "now too few others see what it sees";
  EXPECT_FALSE(Has(30)) << "only one keyframe saw it still";
  EXPECT_TRUE(Has(1));
}

TEST_F(Redundancy, TheFirstTheKeptAndThoseOfALoopStay) {
  map_.AddLoopEdge(map_.At(Id(2)), map_.At(Id(1)));
  EXPECT_EQ(CullRedundantKeyframes(map_, map_.At(Id(5)), Id(3), options_), 1);
  EXPECT_NE(map_.FindKeyframe(Id(1)), nullptr) << "a map's first";
  EXPECT_NE(map_.FindKeyframe(Id(2)), nullptr) << "of a loop";
  EXPECT_NE(map_.FindKeyframe(Id(3)), nullptr) << "asked for";
  EXPECT_EQ(map_.FindKeyframe(Id(4)), nullptr);
}

TEST_F(Redundancy, AKeyframeThatSeesWhatOthersDoNotStays) {
  for (uint64_t number = 40; number < 45; ++number) {
    See(number, {2, 5});
    See(number + 10, {3, 5});
    See(number + 20, {4, 5});
  }
  EXPECT_EQ(CullRedundantKeyframes(map_, map_.At(Id(5)), {}, options_), 0);
}

TEST_F(Culling, WhatLiesJustBeforeALensGoes) {
  Insert({1, 2});
  for (uint64_t number = 1; number <= 5; ++number) See(number, {1, 2});
  map_.SetPosition(map_.At(See(6, {1, 2})), {0, 0, 0.1});
  map_.SetPosition(map_.At(See(7, {1, 2})), {0, 0, 0.5});
  map_.SetPosition(map_.At(See(8, {1, 2})), {0, 0, -1});
  EXPECT_EQ(RemoveTooNear(map_, 1, 0.0), 0) << "switched off";
  EXPECT_EQ(RemoveTooNear(map_, 2, 0.05), 0) << "another map";
  EXPECT_EQ(RemoveTooNear(map_, 1, 0.05), 2);
  EXPECT_FALSE(Has(6));
  EXPECT_FALSE(Has(8));
  EXPECT_TRUE(Has(7));
}

}  // namespace
}  // namespace dmslam
