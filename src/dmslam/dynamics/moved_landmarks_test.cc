#include "dmslam/dynamics/moved_landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/dynamics/testing/poster_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;
using testing::PosterScene;

/// One of the poster's points is seen elsewhere, or not where it should be.
class MovedLandmarksTest : public ::testing::Test {
 protected:
  static constexpr size_t kPoint = PosterScene::kPoster + 12;
  static constexpr uint16_t kFeature = kPoint;  // every point is shown by the feature of its number
  static constexpr LandmarkId kId = MapScene::IdOf(kPoint);

  /// It has gone by `shift`. All others are found in their place.
  TrackedFrame FrameShifted(double shift) const {
    return scene_.Frame(
        [&, shift](size_t i) {
          return std::optional<Eigen::Vector3d>(scene_.point(i) +
                                                Eigen::Vector3d(i == kPoint ? shift : 0, 0, 0));
        },
        [](size_t i) { return i != kPoint; });
  }
  bool HasMoved(TrackedFrame* frame, const std::vector<RejectedMatch>& rejected = {}) {
    const std::vector<LandmarkId>& found =
        moved_.Find(scene_.map(), scene_.ExpectAll(*frame), rejected, frame);
    EXPECT_EQ(found.size(), moved_.features().size());
    const bool only_it = found == std::vector<LandmarkId>{kId};
    EXPECT_TRUE(only_it || found.empty());
    const bool marked = frame->classes[kFeature] == FeatureClass::kMoving;
    EXPECT_EQ(only_it, marked);
    if (only_it) {
      EXPECT_EQ(moved_.features().front(), kFeature);
    }
    return only_it;
  }
  static void Flip(TrackedFrame* frame, size_t feature, int bits) {
    auto features = std::make_shared<FrameFeatures>(*frame->features);
    for (int bit = 0; bit < bits; ++bit)
      features->set.descriptors[feature].words[bit % 4] ^= 1ULL << (bit / 4);
    frame->features = std::move(features);
  }

  /// The point beside it is not found, and looks as this one does.
  static void LetNeighbourLookLikeIt(TrackedFrame* frame) {
    auto features = std::make_shared<FrameFeatures>(*frame->features);
    features->set.descriptors[kFeature + 1] = features->set.descriptors[kFeature];
    frame->features = std::move(features);
    frame->landmarks[kFeature + 1] = {};
  }

  PosterScene scene_;
  MovedLandmarks moved_;
};

TEST_F(MovedLandmarksTest, WhatIsFoundBesideItsPlaceHasMoved) {
  TrackedFrame frame = FrameShifted(0.08);
  EXPECT_TRUE(HasMoved(&frame));
}

TEST_F(MovedLandmarksTest, WhatIsInItsPlaceHasNotAlsoWhereItWasNotMatched) {
  TrackedFrame frame = FrameShifted(0.0);
  EXPECT_FALSE(HasMoved(&frame));
}

TEST_F(MovedLandmarksTest, FarAwaySomethingThatLooksLikeItIsSomethingElse) {
  TrackedFrame frame = FrameShifted(0.3);
  EXPECT_FALSE(HasMoved(&frame));
}

TEST_F(MovedLandmarksTest, WhatDoesNotLookLikeItIsSomethingElse) {
  TrackedFrame frame = FrameShifted(0.08);
  Flip(&frame, kFeature, 41);
  EXPECT_FALSE(HasMoved(&frame));
}

TEST_F(MovedLandmarksTest, WhereTwoLookLikeItNobodyKnowsWhichItIs) {
  TrackedFrame frame = FrameShifted(0.08);
  Flip(&frame, kFeature, 20);
  LetNeighbourLookLikeIt(&frame);
  EXPECT_FALSE(HasMoved(&frame));
}

TEST_F(MovedLandmarksTest, WhatIsFoundInItsPlaceHasNotWhateverLooksLikeIt) {
  TrackedFrame frame = FrameShifted(0.0);
  frame.landmarks[kFeature] = kId;
  LetNeighbourLookLikeIt(&frame);
  EXPECT_FALSE(HasMoved(&frame));
}

TEST_F(MovedLandmarksTest, AFeatureThatShowsAnotherLandmarkIsNotIt) {
  TrackedFrame frame = FrameShifted(0.08);
  frame.landmarks[kFeature] = MapScene::IdOf(0);
  EXPECT_FALSE(HasMoved(&frame));
}

TEST_F(MovedLandmarksTest, AMatchThatThePoseRejectsByMuchHasMoved) {
  TrackedFrame frame = FrameShifted(0.3);
  EXPECT_TRUE(HasMoved(&frame, {{kId, kFeature, 16.0}}));
}

TEST_F(MovedLandmarksTest, OneThatIsHardlyRejectedHasNot) {
  TrackedFrame frame = FrameShifted(0.3);
  EXPECT_FALSE(HasMoved(&frame, {{kId, kFeature, 15.0}}));
}

TEST_F(MovedLandmarksTest, OneThatHardlyLooksLikeItsLandmarkWasAWrongMatch) {
  TrackedFrame frame = FrameShifted(0.3);
  Flip(&frame, kFeature, 61);
  EXPECT_FALSE(HasMoved(&frame, {{kId, kFeature, 100.0}}));
}

TEST_F(MovedLandmarksTest, NothingMovesTwiceInAFrame) {
  TrackedFrame frame = FrameShifted(0.3);
  LetNeighbourLookLikeIt(&frame);
  EXPECT_TRUE(HasMoved(&frame, {{kId, kFeature, 100.0}}));
}

}  // namespace
}  // namespace dmslam
