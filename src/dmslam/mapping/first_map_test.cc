#include "dmslam/mapping/first_map.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

class FirstMapBuilding : public testing::Test {
 protected:
  /// Two frames 0.4 apart, with points somewhat away from where they are.
  InitialMap Proposal(uint16_t points) const {
    InitialMap proposal;
    proposal.map_id = 1;
    proposal.first = scene_.Propose(1, 0.0, 1, 0.0, 0.0);
    proposal.second = scene_.Propose(2, 0.4, 1, 0.0, 0.5);
    Random random(DeriveSeed(1, 0, "points"));
    for (uint16_t i = 0; i < points; ++i) {
      const Eigen::Vector3d away =
          0.05 * Eigen::Vector3d(random.Uniform() - 0.5, random.Uniform() - 0.5, random.Uniform() - 0.5);
      proposal.points.push_back({i, i, scene_.point(i) + away});
    }
    return proposal;
  }

  WallScene scene_;
  MapEditor map_{TestCamera(), Pyramid()};
  LandmarkMaker maker_{1};
};

TEST_F(FirstMapBuilding, AdjustsAndScalesToUnitDepth) {
  ASSERT_TRUE(BuildFirstMap(map_, Proposal(100), maker_));
  const Keyframe &first = map_.At(Id(1)), &second = map_.At(Id(2));
  EXPECT_EQ(first.T_cam_world.Center().norm(), 0.0) << "the world's origin";
  EXPECT_EQ(second.parent, first.id);
  EXPECT_NEAR(*map_.MedianDepth(first), 1.0, 1e-9);
  EXPECT_EQ(map_.num_landmarks(), 100u);
  const double scale = second.T_cam_world.Center().norm() / 0.4;
  for (const Landmark* landmark : map_.LandmarksOf(1)) {
    const uint16_t i = landmark->observations.front().feature;
    EXPECT_LT((landmark->p_world / scale - scene_.point(i)).norm(), 0.03) << i;
    EXPECT_EQ(landmark->observations.size(), 2u);
    EXPECT_EQ(landmark->first_keyframe, second.id);
    EXPECT_EQ(landmark->reference, first.id);
    EXPECT_EQ(landmark->descriptor, scene_.descriptor(i));
  }
}

/// Two noisy views 0.1 apart hardly know how far away the points are. What two between them say is not
/// forgotten.
TEST_F(FirstMapBuilding, TheViewsBetweenHaveTheirSay) {
  const auto shake = [](FeatureSet* features, Random* random) {
    for (Keypoint& keypoint : features->keypoints) {
      keypoint.x_q4 = static_cast<uint16_t>(keypoint.x_q4 + random->Below(33) - 16);
      keypoint.y_q4 = static_cast<uint16_t>(keypoint.y_q4 + random->Below(33) - 16);
    }
  };
  const auto depth_error = [&](uint64_t noise, uint32_t views) {
    Random random(DeriveSeed(1, noise, "noise"));
    InitialMap proposal = Proposal(100);
    proposal.second = scene_.Propose(2, 0.1, 1, 0.0, 0.5);
    shake(&proposal.second.features, &random);
    for (uint32_t k = 0; k < views; ++k) {
      InitialMap::View& view = proposal.between.emplace_back();
      view.keyframe = scene_.Propose(10 + k, 0.09 + 0.005 * k, 1, 0.0, 0.25);
      shake(&view.keyframe.features, &random);
      for (uint16_t i = 0; i < 100; ++i) view.sights.push_back({i, i});
    }
    MapEditor map(TestCamera(), Pyramid());
    LandmarkMaker maker(1);
    EXPECT_TRUE(BuildFirstMap(map, proposal, maker));
    EXPECT_EQ(map.KeyframesOf(1).size(), views + 2);
    double squared = 0;
    for (const Landmark* landmark : map.LandmarksOf(1)) {
      const double truth = scene_.point(landmark->observations.front().feature).z() / 4.25;
      squared += std::pow(landmark->p_world.z() - truth, 2);
    }
    return std::sqrt(squared / static_cast<double>(map.num_landmarks()));
  };
  double alone = 0, together = 0;
  for (uint64_t noise = 0; noise < 10; ++noise) {
    alone += depth_error(noise, 0);
    together += depth_error(noise, 2);
  }
  EXPECT_LT(together, 0.9 * alone);
}

TEST_F(FirstMapBuilding, AViewBetweenIsAKeyframeThatSeesWhatItWasToldToShow) {
  InitialMap proposal = Proposal(100);
  InitialMap::View& view = proposal.between.emplace_back();
  view.keyframe = scene_.Propose(10, 0.2, 1, 0.0, 0.25);
  for (uint16_t i = 0; i < 60; ++i) view.sights.push_back({i, i});
  view.sights.push_back({60000, 60});
  view.sights.push_back({60, 60000});
  proposal.between.push_back(view);
  ASSERT_TRUE(BuildFirstMap(map_, proposal, maker_));
  EXPECT_EQ(map_.KeyframesOf(1).size(), 3u) << "the same frame again is left out";
  EXPECT_EQ(map_.At(Id(10)).parent, Id(1));
  EXPECT_EQ(map_.CountTracked(map_.At(Id(10)), 3), 60);
}

/// Nothing would hold its pose, wherever it claims to be.
TEST_F(FirstMapBuilding, AViewThatSeesTooLittleIsLeftOut) {
  InitialMap proposal = Proposal(100);
  proposal.between.resize(2);
  proposal.between[0].keyframe = scene_.Propose(10, 1e12, 1, 0.0, 0.25);
  proposal.between[1].keyframe = scene_.Propose(11, 0.2, 1, 0.0, 0.25);
  for (uint16_t i = 0; i < 60; ++i)  // each of them elsewhere
    proposal.between[1].sights.push_back({i, static_cast<uint16_t>(139 - i)});
  ASSERT_TRUE(BuildFirstMap(map_, proposal, maker_));
  EXPECT_EQ(map_.KeyframesOf(1).size(), 2u);
  for (const Landmark* landmark : map_.LandmarksOf(1)) EXPECT_EQ(landmark->observations.size(), 2u);
}

TEST_F(FirstMapBuilding, TooFewLandmarksAreNoMap) { EXPECT_FALSE(BuildFirstMap(map_, Proposal(39), maker_)); }

TEST_F(FirstMapBuilding, PointsThatDoNotFitDoNotCount) {
  InitialMap proposal = Proposal(60);
  for (size_t i = 0; i < 30; ++i) proposal.points[i].feature_second = static_cast<uint16_t>(139 - i);
  EXPECT_FALSE(BuildFirstMap(map_, proposal, maker_));
}

TEST_F(FirstMapBuilding, FeaturesThatAreNotThereMakeNoLandmark) {
  InitialMap proposal = Proposal(60);
  proposal.points.push_back({60000, 61, scene_.point(61)});
  proposal.points.push_back({61, 60000, scene_.point(61)});
  ASSERT_TRUE(BuildFirstMap(map_, proposal, maker_));
  EXPECT_EQ(map_.num_landmarks(), 60u);
}

}  // namespace
}  // namespace dmslam
