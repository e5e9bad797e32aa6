// When a tracked frame becomes a keyframe.
#include "dmslam/tracking/keyframe_policy.h"

#include <gtest/gtest.h>

#include "dmslam/map/testing/map_scene.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

using testing::MapScene;

TEST(KeyframePolicyTest, AsksWhereTheMapShouldGrow) {
  const KeyframeOptions options;
  const int64_t long_ago = 2'000'000'000, just_now = 10'000'000;
  EXPECT_FALSE(WantsKeyframe(options, {200, 200, long_ago})) << "the map suffices";
  EXPECT_TRUE(WantsKeyframe(options, {170, 200, long_ago}));
  EXPECT_FALSE(WantsKeyframe(options, {170, 200, just_now})) << "not yet";
  EXPECT_TRUE(WantsKeyframe(options, {90, 200, just_now})) << "tracking becomes weak";
  EXPECT_TRUE(WantsKeyframe(options, {55, 70, just_now})) << "... or hangs on few landmarks";
  EXPECT_FALSE(WantsKeyframe(options, {15, 200, long_ago})) << "so few make no keyframe";
}

TEST(KeyframePolicyTest, TimeIsCountedInSecondsNotFrames) {
  KeyframeOptions options;
  options.min_interval_s = 0.1;
  EXPECT_FALSE(WantsKeyframe(options, {170, 200, 99'999'999}));
  EXPECT_TRUE(WantsKeyframe(options, {170, 200, 100'000'000}));
}

TEST(KeyframePolicyTest, AMapOfTwoKeyframesGrowsAlsoBesideALargerOne) {
  MapScene scene;
  scene.AddCloud(200, {0, 0, 4}, {1.0, 0.8, 0.5});
  scene.MapAll(4);
  MapEditor& map = scene.map();
  for (uint32_t k = 0; k < 2; ++k) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(MapScene::kSession, 100 + k);
    keyframe.map_id = 2;
    keyframe.features = scene.See(100 + k, 0, MapScene::PoseAt(0.1 * k)).features;
    map.AddKeyframe(std::move(keyframe));
  }
  for (uint16_t i = 0; i < 150; ++i) {
    Landmark landmark;
    landmark.id = LandmarkId::Make(2, i + 1);
    landmark.map_id = 2;
    landmark.reference = landmark.first_keyframe = KeyframeId::Make(MapScene::kSession, 100);
    map.AddLandmark(landmark);
    for (uint32_t k = 0; k < 2; ++k)
      map.SetObservation(map.At(KeyframeId::Make(MapScene::kSession, 100 + k)), i, map.At(landmark.id));
  }
  EXPECT_EQ(ExpectedOf(map, map.At(KeyframeId::Make(MapScene::kSession, 101))), 150);
  EXPECT_EQ(ExpectedOf(map, map.At(KeyframeId::Make(MapScene::kSession, 3))), 200);
}

TEST(KeyframePolicyTest, TheFirstKeyframeOfACameraIsDueAtOnce) {
  const KeyframeOptions options;
  KeyframeInputs inputs{
      .num_static = 100, .expected = 150, .since_ns = std::nullopt, .step_ns = std::nullopt};
  EXPECT_TRUE(WantsKeyframe(options, inputs));
  inputs.since_ns = 0;
  EXPECT_FALSE(WantsKeyframe(options, inputs));
  inputs.since_ns = ToNs(options.min_interval_s);
  EXPECT_TRUE(WantsKeyframe(options, inputs));
}

TEST(KeyframePolicyTest, TheFrameNearestToTheIntervalIsDue) {
  const KeyframeOptions options;  // 0.1 s
  const auto due_after = [&](int frames, double hz) {
    const auto ns = [&](int n) { return static_cast<int64_t>(1e9 * n / hz); };
    return WantsKeyframe(options,
                         {.num_static = 100, .expected = 150, .since_ns = ns(frames), .step_ns = ns(1)});
  };
  EXPECT_FALSE(due_after(2, 30));
  EXPECT_TRUE(due_after(3, 30));
  EXPECT_TRUE(due_after(1, 15)) << "the next one would come after 0.133 s";
  EXPECT_FALSE(due_after(1, 20));
  EXPECT_TRUE(due_after(2, 20));
  EXPECT_FALSE(due_after(5, 60));
  EXPECT_TRUE(due_after(6, 60));
  EXPECT_TRUE(due_after(1, 10));
}

}  // namespace
}  // namespace dmslam
