#include "dmslam/optimization/map_adjustment.h"

#include <gtest/gtest.h>

#include <functional>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

/// Four keyframes that all see the same points; all but the first are not where they should be.
class WholeMap : public ::testing::Test {
 protected:
  static constexpr double kStep = 0.1;

  WholeMap() {
    scene_.AddCloud(120, {0, 0, 4}, {0.9, 0.7, 0.6});
    scene_.MapAll(4, kStep);
    for (const uint32_t k : {1U, 2U, 3U}) {
      const Rigid3d off(ExpSo3({0.001, 0.003, 0.0}), {0.01, k == 2 ? 0.02 : -0.01, 0.01});
      map().SetPose(map().At(Id(k)), off * MapScene::PoseAt(kStep * k));
    }
  }
  static KeyframeId Id(uint32_t k) { return KeyframeId::Make(MapScene::kSession, k); }
  MapEditor& map() { return scene_.map(); }
  MapAdjustmentReport Adjust(MapId map_id, const std::function<bool()>& interrupt = {}) {
    return AdjustWholeMap(map(), map_id, 30, 1.0, interrupt);
  }
  /// Of the way the camera looks [rad]: the size of a map is free, this is not.
  double TurnedBy(uint32_t k) {
    return AngleBetween(map().At(Id(k)).T_cam_world.rotation, Eigen::Quaterniond::Identity());
  }
  /// Mean distance of its landmarks from where it sees them [px].
  double MeanErrorOf(uint32_t k) {
    const Keyframe& keyframe = map().At(Id(k));
    double sum = 0, count = 0;
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const Landmark* landmark = map().LandmarkSeenBy(keyframe, i);
      if (landmark == nullptr) continue;
      const Eigen::Vector3d p_cam = keyframe.T_cam_world * landmark->p_world;
      sum += (map().camera().Ideal().Project(p_cam) - keyframe.features->uv_px[i]).norm();
      ++count;
    }
    return sum / count;
  }

  MapScene scene_;
};

TEST_F(WholeMap, AllButTheFirstKeyframeGoWhereTheObservationsPutThem) {
  ASSERT_GT(MeanErrorOf(2), 1.0);
  const MapAdjustmentReport report = Adjust(MapScene::kMap);
  ASSERT_TRUE(report.bundle.usable) << report.bundle.message;
  EXPECT_EQ(report.keyframes, 3);
  EXPECT_EQ(report.fixed_keyframes, 1);
  EXPECT_EQ(report.landmarks, 120);
  for (const uint32_t k : {0U, 1U, 2U, 3U}) {
    EXPECT_LT(MeanErrorOf(k), 0.1) << k;
    EXPECT_LT(TurnedBy(k), 2e-4) << k;
  }
  EXPECT_EQ(map().At(Id(0)).T_cam_world.translation, MapScene::PoseAt(0).translation);
}

TEST_F(WholeMap, KeyframesOfAnotherMapStay) {
  map().SetMapId(map().At(Id(3)), 2);
  const Eigen::Vector3d before = map().At(Id(3)).T_cam_world.translation;
  const MapAdjustmentReport report = Adjust(MapScene::kMap);
  EXPECT_EQ(report.keyframes, 2);
  EXPECT_EQ(report.fixed_keyframes, 1) << "nor do they hold it";
  EXPECT_LT(MeanErrorOf(2), 0.1);
  EXPECT_EQ(map().At(Id(3)).T_cam_world.translation, before);
}

TEST_F(WholeMap, WhoSeesALandmarkElsewhereSeesItNoMore) {
  const KeyframeId at = Id(2);
  const auto& uv_px = map().At(at).features->uv_px;
  uint16_t other = 8;
  while ((uv_px[other] - uv_px[7]).norm() < 100.0) ++other;  // feature i sees point i
  for (const uint16_t feature : {uint16_t{7}, other}) map().ClearObservation(map().At(at), feature);
  map().SetObservation(map().At(at), other, map().At(MapScene::IdOf(7)));
  Adjust(MapScene::kMap);
  ASSERT_NE(map().FindLandmark(MapScene::IdOf(7)), nullptr);
  EXPECT_EQ(map().At(MapScene::IdOf(7)).SeenBy(at), nullptr);
  EXPECT_EQ(map().At(MapScene::IdOf(7)).observations.size(), 3u);
}

/// Two keyframes see it along rays that part by a pixel, so no distance is too far for it.
TEST(MapAdjustment, ALandmarkAtInfinityGoesNoFartherAndKeepsItsDirection) {
  constexpr double kStep = 0.1, kDepth = 4.0;
  MapScene scene;
  scene.AddCloud(60, {0, 0, kDepth}, {0.9, 0.7, 0.6});
  const size_t point = scene.AddPoint({0, 0, kDepth});
  const double pixel = kDepth / scene.map().camera().Ideal().fx_px;
  const auto mistaken = static_cast<uint16_t>(scene.AddPoint({3 * kStep + pixel, 0, kDepth}));
  scene.MapAll(4, kStep);
  MapEditor& map = scene.map();
  const auto keyframe = [&](uint32_t k) -> const Keyframe& {
    return map.At(KeyframeId::Make(MapScene::kSession, k));
  };
  for (const uint32_t k : {1U, 2U, 3U}) map.ClearObservation(keyframe(k), static_cast<uint16_t>(point));
  map.RemoveLandmark(map.At(MapScene::IdOf(mistaken)));
  map.SetObservation(keyframe(3), mistaken, map.At(MapScene::IdOf(point)));
  map.SetPosition(map.At(MapScene::IdOf(point)), {0, 0, 1e13});
  ASSERT_TRUE(AdjustWholeMap(map, MapScene::kMap, 30, 1.0, {}).bundle.usable);
  const Eigen::Vector3d& p_world = map.At(MapScene::IdOf(point)).p_world;
  EXPECT_LE(p_world.norm(), 1.0001e9);
  EXPECT_GT(p_world.normalized().z(), 0.9999) << p_world.transpose();
}

TEST_F(WholeMap, StopsWhenItIsAskedTo) {
  int asked = 0;
  const MapAdjustmentReport report = Adjust(MapScene::kMap, [&] { return ++asked > 0; });
  EXPECT_EQ(asked, 1);
  EXPECT_TRUE(report.bundle.interrupted);
}

TEST_F(WholeMap, OneThatIsNotThereChangesNothing) {
  const uint64_t before = map().version();
  EXPECT_EQ(Adjust(9).keyframes, 0);
  EXPECT_EQ(map().version(), before);
}

}  // namespace
}  // namespace dmslam
