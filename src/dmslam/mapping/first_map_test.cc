#include "dmslam/mapping/first_map.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

constexpr auto Id = WallScene::Id;

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
