#include "dmslam/loops/chain_drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"

namespace dmslam {
namespace {

constexpr uint16_t kFeatures = 500;
constexpr double kDepth = 2.0;

KeyframeId Id(int k) { return KeyframeId::Make(1, static_cast<uint32_t>(k + 1)); }

/// Keyframes in a row, one map unit apart, that look at a wall.
class Row {
 public:
  Row() : map_(TestCamera(), Pyramid()) {}

  void Add(int k, MapId map_id = 1) {
    FeatureSet features;
    for (int i = 0; i < kFeatures; ++i) {
      features.keypoints.push_back(
          {static_cast<uint16_t>(16 * (20 + i)), static_cast<uint16_t>(16 * 240), 0, 0});
      features.descriptors.emplace_back();
    }
    Keyframe keyframe;
    keyframe.id = Id(k);
    keyframe.map_id = map_id;
    keyframe.T_cam_world = Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-k, 0, 0));
    keyframe.features = MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid());
    map_.AddKeyframe(std::move(keyframe));
  }
  void Share(int a, int b, int landmarks) {
    for (int i = 0; i < landmarks; ++i) {
      Landmark landmark;
      landmark.id = LandmarkId::Make(1, ++last_);
      landmark.map_id = 1;
      landmark.p_world = {0.5 * (a + b), 0, kDepth};
      map_.AddLandmark(landmark);
      map_.SetObservation(map_.At(Id(a)), used_[a]++, map_.At(landmark.id));
      map_.SetObservation(map_.At(Id(b)), used_[b]++, map_.At(landmark.id));
    }
  }
  std::optional<ChainDrift> Drift(int a, int b) const {
    return DriftAlongChain(map_, map_.At(Id(a)), map_.At(Id(b)), ChainDriftOptions());
  }
  MapEditor& map() { return map_; }

 private:
  MapEditor map_;
  uint64_t last_ = 0;
  std::map<int, uint16_t> used_;
};

TEST(ChainDriftTest, ALinkOfAHundredLandmarksHasTheErrorsOfTheOptions) {
  Row row;
  row.Add(0);
  row.Add(1);
  row.Share(0, 1, 100);
  const ChainDriftOptions options;
  const auto drift = row.Drift(0, 1);
  ASSERT_TRUE(drift);
  EXPECT_EQ(drift->links, 1);
  EXPECT_NEAR(drift->rotation_rad, options.link_rotation_rad, 1e-9);
  EXPECT_NEAR(drift->log_scale, options.link_log_scale, 1e-9);
  const double lever = 1.0;
  EXPECT_NEAR(drift->position,
              std::sqrt(std::pow(options.link_position * kDepth, 2) +
                        (std::pow(options.link_rotation_rad, 2) + std::pow(options.link_log_scale, 2)) *
                            lever * lever),
              1e-9);
}

TEST(ChainDriftTest, AWeakLinkLeavesTheEndUncertain) {
  Row strong, weak;
  for (Row* row : {&strong, &weak}) {
    for (int k = 0; k < 5; ++k) row->Add(k);
    for (int k = 0; k < 4; ++k) row->Share(k, k + 1, row == &weak && k == 1 ? 16 : 100);
  }
  const auto good = strong.Drift(0, 4), bad = weak.Drift(0, 4);
  ASSERT_TRUE(good && bad);
  EXPECT_EQ(good->links, 4);
  EXPECT_NEAR(good->rotation_rad, 2 * ChainDriftOptions().link_rotation_rad, 1e-9);
  EXPECT_GT(bad->position, 1.4 * good->position);
}

TEST(ChainDriftTest, WhatBothSeeIsAShorterChain) {
  Row row;
  for (int k = 0; k < 5; ++k) row.Add(k);
  for (int k = 0; k < 4; ++k) row.Share(k, k + 1, 100);
  row.Share(0, 4, 100);
  const auto drift = row.Drift(0, 4);
  ASSERT_TRUE(drift);
  EXPECT_EQ(drift->links, 1);
}

TEST(ChainDriftTest, TheSpanningTreeLinksWhatSharesNothing) {
  Row row;
  row.Add(0);
  row.Add(1);
  EXPECT_FALSE(row.Drift(0, 1));
  row.map().SetParent(row.map().At(Id(1)), Id(0));
  const auto drift = row.Drift(0, 1);
  ASSERT_TRUE(drift);
  EXPECT_NEAR(drift->rotation_rad, 10 * ChainDriftOptions().link_rotation_rad, 1e-9);
}

TEST(ChainDriftTest, NoChainLeadsThroughAParentThatIsNotThere) {
  Row row;
  row.Add(0);
  row.Add(1);
  for (const int k : {0, 1}) row.map().SetParent(row.map().At(Id(k)), Id(7));
  EXPECT_FALSE(row.Drift(0, 1));
}

TEST(ChainDriftTest, AMoveIsMeasuredInSigmas) {
  const ChainDrift drift{.rotation_rad = 0.01, .position = 0.1, .log_scale = 0.02, .links = 3};
  const Rigid3d here;
  EXPECT_NEAR(SigmasOf(drift, here, Sim3d(Rigid3d(Eigen::Quaterniond::Identity(), {0.2, 0, 0}))), 2.0, 1e-9);
  EXPECT_NEAR(SigmasOf(drift, here, Sim3d(Eigen::Quaterniond::Identity(), {0, 0, 0}, std::exp(0.1))), 5.0,
              1e-9);
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY()));
  EXPECT_NEAR(SigmasOf(drift, here, Sim3d(Rigid3d(turned, {0, 0, 0}))), 3.0, 1e-6);
}

}  // namespace
}  // namespace dmslam
