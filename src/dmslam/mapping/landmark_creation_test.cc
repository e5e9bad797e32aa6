#include "dmslam/mapping/landmark_creation.h"

#include <gtest/gtest.h>

#include <set>

#include "dmslam/camera/image_scale.h"
#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

/// Keyframes in a row, `step` apart and one second apart in time. All see the first `shared` points already,
/// and have the rest of the wall free.
class Creation : public testing::Test {
 protected:
  void Build(const WallScene& scene, uint32_t keyframes, uint16_t shared, double step = 0.4) {
    scene_ = scene;
    std::vector<uint32_t> frames;
    for (uint32_t frame = 1; frame <= keyframes; ++frame) {
      newest_ = &scene_.AddKeyframe(map_, frame, step * (frame - 1.0), frame - 1.0);
      frames.push_back(frame);
    }
    for (uint16_t i = 0; i < shared; ++i) scene_.AddLandmark(map_, 1000U + i, i, frames);
  }
  std::vector<KeyframePoint> Propose(const std::vector<uint16_t>& moving = {}) {
    diagnostics_ = {};
    return ProposeLandmarks(map_, *newest_, moving, options_, &diagnostics_);
  }
  static std::set<uint16_t> FeaturesOf(const std::vector<KeyframePoint>& landmarks) {
    std::set<uint16_t> features;
    for (const KeyframePoint& landmark : landmarks) features.insert(landmark.feature);
    return features;
  }

  WallScene scene_;
  MapEditor map_{TestCamera(), Pyramid()};
  LandmarkCreationOptions options_;
  CreationDiagnostics diagnostics_;
  const Keyframe* newest_ = nullptr;
};

TEST_F(Creation, FindsTheWallWhereItIs) {
  Build(WallScene(), 2, 20);
  const std::vector<KeyframePoint> made = Propose();
  EXPECT_GT(made.size(), 110u) << "of 120 that are free";
  for (const KeyframePoint& landmark : made) {
    EXPECT_GE(landmark.feature, 20) << "the others see something already";
    ASSERT_EQ(landmark.seen_by.size(), 1u);
    EXPECT_EQ(landmark.seen_by.front().keyframe, &map_.At(Id(1)));
    EXPECT_EQ(landmark.seen_by.front().feature, landmark.feature);
    EXPECT_LT((landmark.p_world - scene_.point(landmark.feature)).norm(), 0.03) << landmark.feature;
  }
  EXPECT_EQ(diagnostics_.created, made.size());
}

TEST_F(Creation, AllThatAgreeBecomeItsObservers) {
  Build(WallScene(), 3, 20);
  size_t both = 0;
  for (const KeyframePoint& landmark : Propose()) both += landmark.seen_by.size() == 2 ? 1 : 0;
  EXPECT_GT(both, 100u);
}

TEST_F(Creation, NothingIsMadeOfWhatMoves) {
  Build(WallScene(), 2, 20);
  std::vector<uint16_t> moving;
  for (uint16_t i = 30; i < 60; ++i) moving.push_back(i);
  const std::set<uint16_t> features = FeaturesOf(Propose(moving));
  EXPECT_EQ(diagnostics_.refused_motion, 30u);
  for (const uint16_t feature : moving) EXPECT_FALSE(features.contains(feature)) << feature;
  EXPECT_GT(features.size(), 80u);
}

TEST_F(Creation, WhatMovesAndHasALandmarkIsNotCounted) {
  Build(WallScene(), 2, 20);
  std::vector<uint16_t> moving;
  for (uint16_t i = 10; i < 60; ++i) moving.push_back(i);
  Propose(moving);
  EXPECT_EQ(diagnostics_.refused_motion, 40u) << "ten of them have one already";
}

TEST_F(Creation, NeedsABaseline) {
  Build(WallScene(), 2, 20);
  map_.SetPose(map_.At(Id(1)), WallScene::At(0.4 - 0.02));  // 0.005 of the depth
  EXPECT_TRUE(Propose().empty());
  EXPECT_EQ(diagnostics_.matched, 0u);
}

/// Two keyframes that see the wall under about 0.7 degrees, as those of a camera do that turns more than it
/// moves.
class LittleParallax : public Creation {
 protected:
  LittleParallax() { Build(WallScene(), 2, 20, 0.052); }
};

TEST_F(LittleParallax, IsEnoughForTheNewestKeyframe) {
  EXPECT_GT(Propose().size(), 60u);
  options_.triangulation.min_parallax_rad = 0.02;
  EXPECT_TRUE(Propose().empty());
  EXPECT_GT(diagnostics_.refused_parallax, 60u);
}

TEST_F(LittleParallax, IsTooLittleWhereTheMapGrowsIntoThePast) {
  scene_.AddKeyframe(map_, 3, 0.4, 2.0);
  EXPECT_TRUE(Propose().empty()) << "others follow the keyframe";
  EXPECT_GT(diagnostics_.refused_parallax, 60u);
}

TEST_F(Creation, APointThatOneOfThemWouldSeeElsewhereIsRefused) {
  Build(WallScene(), 2, 20);
  FeatureSet features = newest_->features->set;
  for (size_t i = 20; i < features.size(); ++i)
    features.keypoints[i].y_q4 += 16 * 6;  // off its epipolar line
  Keyframe off = *newest_;
  off.features = MakeFrameFeatures(features, map_.camera(), map_.pyramid());
  EXPECT_LT(ProposeLandmarks(map_, off, {}, options_, &diagnostics_).size(), 10u);
}

/// A wall whose points lie 13 px apart: a neighbourhood of 25 px around one holds three more on each side.
class DenseWall : public Creation {
 protected:
  DenseWall() {
    Build(WallScene(30, 20, 0.1), 2, 60);
    options_.min_candidates = 10000;
  }
  int LargestCrowd(const std::vector<KeyframePoint>& made) const {
    const double neighbourhood_px = options_.neighbourhood_rad * FocalPx(map_.camera());
    int largest = 0;
    for (const KeyframePoint& a : made) {
      int near = 0;
      for (const KeyframePoint& b : made) {
        const Eigen::Vector2d apart =
            newest_->features->uv_px[a.feature] - newest_->features->uv_px[b.feature];
        near += apart.cwiseAbs().maxCoeff() <= neighbourhood_px ? 1 : 0;
      }
      largest = std::max(largest, near);
    }
    return largest;
  }
};

TEST_F(DenseWall, CandidatesExcludeEachOtherInTheirNeighbourhood) {
  const std::vector<KeyframePoint> made = Propose();
  EXPECT_GT(made.size(), 20u);
  EXPECT_EQ(LargestCrowd(made), 1);
  EXPECT_GT(diagnostics_.refused_neighbourhood, 300u);
  EXPECT_EQ(diagnostics_.refused_count, 0u);
}

TEST_F(DenseWall, WithoutTheRuleTheyDoNot) {
  options_.mutual_exclusion = false;
  const std::vector<KeyframePoint> made = Propose();
  EXPECT_GT(made.size(), 400u);
  EXPECT_GT(LargestCrowd(made), 10);
}

TEST_F(DenseWall, ThereAreNoMoreThanAlphaTimesWhatIsTracked) {
  options_.neighbourhood_rad = 0.002;
  options_.min_candidates = 10;
  options_.alpha = 0.5;
  EXPECT_EQ(Propose().size(), 30u) << "of 60 tracked";
  EXPECT_GT(diagnostics_.refused_count, 300u);
  options_.min_candidates = 45;
  EXPECT_EQ(Propose().size(), 45u);
}

TEST_F(Creation, WhatManyViewsOverSomeTimeConfirmIsNotBound) {
  Build(WallScene(30, 20, 0.08), 4, 60);
  options_.min_candidates = 10;
  options_.alpha = 0.1;
  const size_t confirmed = Propose().size();
  options_.confirmed_span_s = 10;  // longer than they were seen
  const size_t bound = Propose().size();
  EXPECT_EQ(bound, 10u);
  EXPECT_GT(confirmed, 100u);
}

TEST_F(Creation, EveryCandidateBecomesALandmark) {
  Build(WallScene(), 2, 20);
  const size_t proposed = Propose().size();
  LandmarkMaker maker(3);
  CreateLandmarks(map_, *newest_, {}, options_, maker, &diagnostics_);
  EXPECT_EQ(map_.num_landmarks(), 20 + proposed);
  for (const Landmark* landmark : map_.LandmarksOf(1)) {
    if (landmark->id.epoch_ordinal() != 3) continue;
    EXPECT_EQ(landmark->observations.size(), 2u);
    EXPECT_EQ(landmark->reference, newest_->id);
    EXPECT_EQ(landmark->descriptor, scene_.descriptor(landmark->observations.front().feature));
    EXPECT_EQ(landmark->evidence.found, 1u);
  }
  for (const KeyframePoint& landmark : Propose())
    EXPECT_FALSE(newest_->landmarks[landmark.feature].valid()) << "nothing is made twice";
}

}  // namespace
}  // namespace dmslam
