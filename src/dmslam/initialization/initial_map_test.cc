// A first map on its way to the mapper: what is said of it, and the adjustment that the search asks for.
#include "dmslam/initialization/initial_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr Pinhole kCamera = {500, 500, 320, 240};

InitializerFrame Frame(uint32_t index, size_t num_features) {
  auto features = std::make_shared<FrameFeatures>();
  for (size_t i = 0; i < num_features; ++i) {
    features->set.keypoints.push_back({static_cast<uint16_t>(index), static_cast<uint16_t>(i), 0, 0});
    features->set.descriptors.push_back({{index, i, 0, 0}});
  }
  return {index, 1000 + index, features};
}

TEST(MakeInitialMap, TellsBothKeyframesAndWhatEachSees) {
  FirstMap map;
  map.frame0 = Frame(4, 30);
  map.frame1 = Frame(19, 40);
  map.T_1_0 = Rigid3d(Eigen::Quaterniond(0.8, 0.6, 0, 0), {1, 2, 3});
  map.points = {{7, 9, {0.1, 0.2, 1.0}}, {8, 3, {0.3, 0.4, 2.0}}};
  const InitialMap told = MakeInitialMap(map, 5, 0, 2);
  EXPECT_EQ(told.map_id, 2u);
  EXPECT_EQ(told.first.id, KeyframeId::Make(5, 4));
  EXPECT_EQ(told.second.id, KeyframeId::Make(5, 19));
  EXPECT_EQ(told.first.stamp_ns, 1004);
  EXPECT_EQ(told.second.stamp_ns, 1019);
  EXPECT_EQ(told.second.reference, told.first.id);
  EXPECT_FALSE(told.first.reference);
  EXPECT_EQ(told.second.T_cam_reference.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(told.first.features.keypoints, map.frame0.features->set.keypoints);
  EXPECT_EQ(told.second.features.descriptors, map.frame1.features->set.descriptors);
  ASSERT_EQ(told.points.size(), 2u);
  EXPECT_EQ(told.points[0].feature_first, 7);
  EXPECT_EQ(told.points[0].feature_second, 9);
  EXPECT_EQ(told.points[1].p_world, Eigen::Vector3d(0.3, 0.4, 2.0));
}

/// A map of frames 4 and 19, of so many features each, and views between that see its two points.
FirstMap MapWithViews(size_t num_features, uint32_t num_views) {
  FirstMap map;
  map.frame0 = Frame(4, num_features);
  map.frame1 = Frame(19, num_features);
  map.points = {{7, 9, {0.1, 0.2, 1.0}}, {8, 3, {0.3, 0.4, 2.0}}};
  for (uint32_t k = 0; k < num_views; ++k) {
    const Rigid3d T_k_0(Eigen::Quaterniond::Identity(), {0.1 * k, 0, 0});
    map.between.push_back({Frame(5 + k, num_features), T_k_0, {{0, 12}, {1, 5}}});
  }
  return map;
}

TEST(MakeInitialMap, TellsOfTwoViewsBetweenAtAThirdAndTwo) {
  const FirstMap map = MapWithViews(30, 6);
  const InitialMap told = MakeInitialMap(map, 5, 0, 2);
  ASSERT_EQ(told.between.size(), 2u);
  EXPECT_EQ(told.between[0].keyframe.id, KeyframeId::Make(5, 7));
  EXPECT_EQ(told.between[1].keyframe.id, KeyframeId::Make(5, 9));
  const InitialMap::View& view = told.between[1];
  EXPECT_EQ(view.keyframe.reference, told.first.id);
  EXPECT_EQ(view.keyframe.T_cam_reference.translation, map.between[4].T_k_0.translation);
  EXPECT_EQ(view.keyframe.features.descriptors, map.between[4].frame.features->set.descriptors);
  ASSERT_EQ(view.sights.size(), 2u);
  EXPECT_EQ(view.sights[1].point, 1);
  EXPECT_EQ(view.sights[1].feature, 5);
}

TEST(MakeInitialMap, LeavesViewsOutRatherThanBeingTooLong) {
  EXPECT_EQ(MakeInitialMap(MapWithViews(6000, 2), 5, 0, 2).between.size(), 1u);
  EXPECT_EQ(MakeInitialMap(MapWithViews(10'000, 2), 5, 0, 2).between.size(), 0u);
}

TEST(MakeInitialMap, OfASingleViewBetweenTellsThatOne) {
  const InitialMap told = MakeInitialMap(MapWithViews(30, 1), 5, 0, 2);
  ASSERT_EQ(told.between.size(), 1u);
  EXPECT_EQ(told.between[0].keyframe.id, KeyframeId::Make(5, 5));
}

/// Three cameras side by side see a cloud; what is known of the others' places and of the points is wrong.
class InitialAdjustment : public ::testing::Test {
 protected:
  InitialAdjustment() {
    Random random(7);
    for (int k = 0; k < 3; ++k) {
      truth_.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.2 * k, 0, 0));
      poses_.push_back(truth_.back());
    }
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d p(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(3, 5));
      for (int k = 0; k < 3; ++k)
        observations_.push_back({k, i, kCamera.Project(truth_[static_cast<size_t>(k)] * p), 1.0});
      points_.push_back(p * random.Uniform(0.95, 1.05));
    }
    for (size_t k = 1; k < 3; ++k) poses_[k].translation.y() += 0.01;
  }

  double WorstErrorPx() const {
    double worst = 0;
    for (const InitialObservation& o : observations_) {
      const Eigen::Vector3d p_cam =
          poses_[static_cast<size_t>(o.pose)] * points_[static_cast<size_t>(o.point)];
      worst = std::max(worst, (kCamera.Project(p_cam) - o.uv_px).norm());
    }
    return worst;
  }

  std::vector<Rigid3d> truth_, poses_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<InitialObservation> observations_;
};

TEST_F(InitialAdjustment, FindsPosesAndPointsAndHoldsTheFirstCamera) {
  ASSERT_GT(WorstErrorPx(), 1.0);
  ASSERT_TRUE(AdjustInitialMap(kCamera)(&poses_, &points_, observations_));
  EXPECT_LT(WorstErrorPx(), 0.01);
  EXPECT_EQ(poses_[0].translation, truth_[0].translation);
  EXPECT_EQ(poses_[0].rotation.coeffs(), truth_[0].rotation.coeffs());
}

TEST_F(InitialAdjustment, WithoutObservationsNothingIsAdjusted) {
  const std::vector<Eigen::Vector3d> before = points_;
  EXPECT_FALSE(AdjustInitialMap(kCamera)(&poses_, &points_, {}));
  EXPECT_EQ(points_, before);
}

}  // namespace
}  // namespace dmslam
