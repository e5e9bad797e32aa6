#include "dmslam/mapping/local_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

/// Six keyframes side by side. Each sees a stripe of the wall, most of which the next one sees, too; the last
/// two are not where the map has them.
class LocalAdjustment : public testing::Test {
 protected:
  static constexpr uint32_t kLast = 6;
  static constexpr double kStep = 0.15;

  LocalAdjustment() {
    options_.local_keyframes = 3;
    for (uint32_t k = 1; k <= kLast; ++k) scene_.AddKeyframe(map_, k, X(k));
    for (uint16_t i = 0; i < scene_.size(); ++i) {
      std::vector<uint32_t> frames;
      for (uint32_t k = 1; k <= kLast; ++k) {
        if (i >= 15 * (k - 1) && i < 15 * (k - 1) + 65) frames.push_back(k);
      }
      if (frames.size() > 1) scene_.AddLandmark(map_, i + 1U, i, frames);
    }
    for (const uint32_t k : {kLast - 1, kLast})
      map_.SetPose(map_.At(Id(k)), Rigid3d(ExpSo3({0, 0.003, 0}), {0.02, -0.01, 0}) * WallScene::At(X(k)));
  }
  static double X(uint32_t k) { return kStep * k; }
  double ErrorOf(uint32_t k) const { return (map_.At(Id(k)).T_cam_world.Center().x() - X(k)); }

  WallScene scene_;
  MapEditor map_{TestCamera(), Pyramid()};
  MapperOptions options_;
};

TEST_F(LocalAdjustment, TheKeyframeAndItsBestNeighboursGoWhereTheObservationsPutThem) {
  ASSERT_GT(std::abs(ErrorOf(kLast)), 0.01);
  const MapAdjustmentReport report = AdjustLocally(map_, map_.At(Id(kLast)), options_, {});
  EXPECT_TRUE(report.bundle.usable);
  EXPECT_EQ(report.keyframes, 3);
  for (uint32_t k = 1; k <= kLast; ++k) EXPECT_LT(std::abs(ErrorOf(k)), 2e-3) << k;
}

TEST_F(LocalAdjustment, KeyframesBeyondTheWindowHoldItAndStay) {
  const MapAdjustmentReport report = AdjustLocally(map_, map_.At(Id(kLast)), options_, {});
  EXPECT_EQ(report.fixed_keyframes, 3);
  for (uint32_t k = 1; k <= 3; ++k)
    EXPECT_EQ(map_.At(Id(k)).T_cam_world.translation, WallScene::At(X(k)).translation) << k;
}

TEST_F(LocalAdjustment, WhoSharesLittleIsNoNeighbour) {
  options_.local_keyframes = 10;
  EXPECT_EQ(AdjustLocally(map_, map_.At(Id(kLast)), options_, {}).keyframes, 4)
      << "the first two share fewer than 15 landmarks with the last";
}

}  // namespace
}  // namespace dmslam
