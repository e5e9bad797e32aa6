#include "dmslam/map/landmark_sights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr double kDepth = 4.0;
constexpr double kStep = 0.1;

KeyframeId Id(uint32_t frame) { return KeyframeId::Make(MapScene::kSession, frame); }

/// Three keyframes side by side that see one point.
MapScene OnePoint() {
  MapScene scene;
  scene.AddPoint({0, 0, kDepth});
  scene.MapAll(3, kStep);
  return scene;
}

TEST(LandmarkSights, AreWhereTheKeyframesSeeIt) {
  const MapScene scene = OnePoint();
  const std::vector<LandmarkSight> sights = SightsOf(scene.map(), scene.map().At(MapScene::IdOf(0)));
  ASSERT_EQ(sights.size(), 3u);
  for (uint32_t k = 0; k < 3; ++k) {
    EXPECT_EQ(sights[k].keyframe, Id(k));
    EXPECT_EQ(sights[k].stamp_ns, k * MapScene::kStepNs);
    EXPECT_EQ(sights[k].feature, 0u);
    EXPECT_EQ(sights[k].keypoint, scene.map().At(Id(k)).features->set.keypoints[0]);
    ASSERT_TRUE(sights[k].error_px);
    EXPECT_LT(*sights[k].error_px, 0.05) << "a keypoint is told in sixteenths of a pixel";
  }
}

TEST(LandmarkSights, TheErrorIsInPixelsAndNoneBehindTheCamera) {
  MapScene scene = OnePoint();
  const Landmark& landmark = scene.map().At(MapScene::IdOf(0));
  const double px = 3.0 * kDepth / scene.map().camera().fx_px;
  scene.map().SetPosition(landmark, {px, 0, kDepth});
  EXPECT_NEAR(SightsOf(scene.map(), landmark)[1].error_px.value(), 3.0, 0.05);
  scene.map().SetPosition(landmark, {0, 0, -kDepth});
  EXPECT_FALSE(SightsOf(scene.map(), landmark)[1].error_px);
}

TEST(LandmarkSights, TheWidestAngleIsWithTheFarthestCamera) {
  const MapScene scene = OnePoint();
  const Landmark& landmark = scene.map().At(MapScene::IdOf(0));
  const std::optional<WidestAngle> widest = WidestAngleWith(scene.map(), landmark, Id(0));
  ASSERT_TRUE(widest);
  EXPECT_EQ(widest->keyframe, Id(2));
  EXPECT_NEAR(widest->rad, std::atan(2 * kStep / kDepth), 1e-9);
  EXPECT_FALSE(WidestAngleWith(scene.map(), landmark, Id(9))) << "nobody's ray";
}

}  // namespace
}  // namespace dmslam
