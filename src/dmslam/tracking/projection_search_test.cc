// Each rule of the search fails its test when it is taken out.
#include "dmslam/tracking/projection_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr size_t kPoints = 200;

/// A cloud that four keyframes see, and a frame at the place of the first.
class Search : public ::testing::Test {
 protected:
  Search() {
    scene_.AddCloud(kPoints, {0, 0, 4}, {1.0, 0.8, 0.4});
    scene_.MapAll();
    for (size_t i = 0; i < kPoints; ++i) ids_.push_back(MapScene::IdOf(i));
  }

  /// What the camera sees, changed; feature i shows point i.
  template <typename Change>
  TrackedFrame Changed(Change change) const {
    FeatureSet set = scene_.See(9, 0, Rigid3d()).features->set;
    change(&set);
    TrackedFrame frame(9, 0,
                       MakeFrameFeatures(std::move(set), scene_.map().camera(), scene_.map().pyramid()));
    frame.T_cam_world = Rigid3d();
    return frame;
  }
  TrackedFrame Frame() const {
    return Changed([](FeatureSet*) {});
  }
  /// The frame before, that saw all of it.
  TrackedFrame Before() const {
    TrackedFrame frame = Frame();
    frame.landmarks = ids_;
    return frame;
  }
  std::vector<LandmarkMatch> FromFrameBefore(const TrackedFrame& frame) {
    return search_.MatchFrame(scene_.map(), votes_, Before(), Rigid3d(), 15.0, *frame.features);
  }
  std::vector<LandmarkMatch> FromKeyframe(const TrackedFrame& frame) {
    const Keyframe& keyframe = *scene_.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, 0));
    return search_.MatchKeyframe(scene_.map(), votes_, keyframe, *frame.features);
  }
  void BelieveToMove(size_t point) {
    LandmarkEvidence evidence;
    evidence.motion_belief = 1.0F;
    scene_.map().SetEvidence(scene_.map().At(ids_[point]), evidence);
  }
  /// Features 8 and 9 look much like landmark 9: they differ from it in 11 and 10 bits.
  static void MakeTwins(FeatureSet* set) {
    set->descriptors[8] = set->descriptors[9];
    set->descriptors[8].words[0] ^= 0x7FF;
    set->descriptors[9].words[0] ^= 0x3FF;
  }
  static bool Has(const std::vector<LandmarkMatch>& matches, size_t feature) {
    return std::any_of(matches.begin(), matches.end(),
                       [&](const LandmarkMatch& m) { return m.feature == feature; });
  }

  MapScene scene_;
  std::vector<LandmarkId> ids_;
  LandmarkVotes votes_{VoteOptions()};
  ProjectionSearch search_{TrackingOptions()};
};

TEST_F(Search, WhatTheFrameBeforeSawIsFoundWhereItIs) {
  const std::vector<LandmarkMatch> matches = FromFrameBefore(Frame());
  EXPECT_EQ(matches.size(), kPoints);
  for (const LandmarkMatch& match : matches) EXPECT_EQ(match.landmark->id, ids_[match.feature]);
}

TEST_F(Search, ALandmarkThatWasFusedIsTheOneItBecame) {
  scene_.map().Fuse(scene_.map().At(ids_[3]), scene_.map().At(ids_[4]), {});
  for (const LandmarkMatch& match : FromFrameBefore(Frame())) EXPECT_NE(match.landmark->id, ids_[3]);
}

TEST_F(Search, WhatIsBelievedToMoveIsNotMatchedButExpected) {
  BelieveToMove(5);
  EXPECT_FALSE(Has(FromFrameBefore(Frame()), 5));
  EXPECT_FALSE(Has(FromKeyframe(Frame()), 5));
  TrackedFrame frame = Frame();
  const auto expected = search_.MatchLandmarks(scene_.map(), votes_, ids_, 1.0, &frame);
  EXPECT_FALSE(frame.landmarks[5].valid());
  EXPECT_TRUE(frame.landmarks[6].valid());
  EXPECT_EQ(expected.size(), kPoints);
}

TEST_F(Search, KeypointsThatTurnOtherwiseThanMostAreNoMatches) {
  const TrackedFrame frame = Changed([](FeatureSet* set) {
    for (size_t i = 0; i < 5; ++i) set->keypoints[i].angle = static_cast<uint8_t>(50 * (i + 1));
  });
  const std::vector<LandmarkMatch> matches = FromFrameBefore(frame);
  EXPECT_EQ(matches.size(), kPoints - 5);
  for (size_t i = 0; i < 5; ++i) EXPECT_FALSE(Has(matches, i)) << i;
}

TEST_F(Search, AFarOctaveIsAnotherSize) {
  const auto coarse = [](FeatureSet* set) { set->keypoints[7].octave = 3; };
  EXPECT_FALSE(Has(FromFrameBefore(Changed(coarse)), 7));
  TrackedFrame before = Changed(coarse);
  before.landmarks = ids_;
  EXPECT_FALSE(Has(search_.MatchFrame(scene_.map(), votes_, before, Rigid3d(), 15.0, *Frame().features), 7));
}

TEST_F(Search, AKeyframesLandmarksAreFoundWhereverTheyAre) {
  const TrackedFrame frame =
      Changed([](FeatureSet* set) { std::reverse(set->keypoints.begin(), set->keypoints.end()); });
  EXPECT_EQ(FromKeyframe(frame).size(), kPoints);
}

TEST_F(Search, WithoutAPlaceATwinMakesItAmbiguous) {
  const TrackedFrame frame = Changed(MakeTwins);
  const std::vector<LandmarkMatch> matches = FromKeyframe(frame);
  for (const LandmarkMatch& match : matches) EXPECT_NE(match.landmark->id, ids_[9]);
}

TEST_F(Search, ATwinBesideItInTheSameOctaveMakesItAmbiguous) {
  const auto twin_beside = [](FeatureSet* set) {
    MakeTwins(set);
    set->keypoints[8] = set->keypoints[9];
    set->keypoints[8].x_q4 = static_cast<uint16_t>(set->keypoints[8].x_q4 + 16);
  };
  TrackedFrame frame = Changed(twin_beside);
  search_.MatchLandmarks(scene_.map(), votes_, ids_, 1.0, &frame);
  EXPECT_EQ(std::count(frame.landmarks.begin(), frame.landmarks.end(), ids_[9]), 0);
  EXPECT_EQ(std::count(frame.landmarks.begin(), frame.landmarks.end(), ids_[10]), 1);
}

TEST_F(Search, NobodyIsMatchedTwice) {
  TrackedFrame frame = Frame();
  frame.landmarks[11] = ids_[12];  // as the search from the frame before said
  search_.MatchLandmarks(scene_.map(), votes_, ids_, 1.0, &frame);
  EXPECT_EQ(frame.landmarks[11], ids_[12]);
  EXPECT_FALSE(frame.landmarks[12].valid()) << "its landmark is seen by another feature";
}

}  // namespace
}  // namespace dmslam
