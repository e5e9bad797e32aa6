#include "purity.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr MapId kMap = 1;
constexpr uint16_t kPersonX = 100, kWallX = 500;  // the masks below end at 320

/// The left half is a person, who stands in every other frame. There is no mask of 4 s.
std::optional<GrayImage> LeftHalf(int64_t stamp_ns) {
  if (stamp_ns == 4'000'000'000) return std::nullopt;
  GrayImage mask(640, 480);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 320; ++x) mask.at(x, y) = stamp_ns % 2'000'000'000 == 0 ? 128 : 255;
  }
  return mask;
}

KeyframeId AddKeyframe(MapEditor* map, uint32_t second, const std::vector<uint16_t>& x_px,
                       MapId map_id = kMap) {
  FeatureSet set;
  for (const uint16_t x : x_px) {
    set.keypoints.push_back({static_cast<uint16_t>(x * 16), 200 * 16, 0, 0});
    set.descriptors.emplace_back();
  }
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(1, second);
  keyframe.map_id = map_id;
  keyframe.stamp_ns = second * 1'000'000'000LL;
  keyframe.features = MakeFrameFeatures(std::move(set), TestCamera(), Pyramid());
  keyframe.landmarks.resize(x_px.size());
  map->AddKeyframe(keyframe);
  return keyframe.id;
}

LandmarkId AddLandmark(MapEditor* map, uint64_t number, MapId map_id = kMap) {
  Landmark landmark;
  landmark.id = LandmarkId::Make(1, number);
  landmark.map_id = map_id;
  map->AddLandmark(landmark);
  return landmark.id;
}

TEST(JudgeMap, CountsWhatIsSeenMostlyOnPeople) {
  MapEditor map(TestCamera(), Pyramid());
  std::vector<KeyframeId> keyframes;
  for (uint32_t second = 1; second <= 3; ++second)
    keyframes.push_back(AddKeyframe(&map, second, {kPersonX, kWallX, kPersonX, kWallX}));
  const LandmarkId walker = AddLandmark(&map, 1), wall = AddLandmark(&map, 2), half = AddLandmark(&map, 3);
  for (const KeyframeId keyframe : keyframes) {
    map.SetObservation(map.At(keyframe), 0, map.At(walker));
    map.SetObservation(map.At(keyframe), 1, map.At(wall));
  }
  // On the person in one of two keyframes: not mostly.
  map.SetObservation(map.At(keyframes[0]), 2, map.At(half));
  map.SetObservation(map.At(keyframes[1]), 3, map.At(half));

  const MapPurity purity = JudgeMap(map, kMap, LeftHalf);
  EXPECT_EQ(purity.keyframes, 3U);
  EXPECT_EQ(purity.keyframes_unjudged, 0U);
  EXPECT_EQ(purity.landmarks, 3U);
  EXPECT_EQ(purity.on_people, 1U);
  EXPECT_EQ(purity.ever_on_people, 2U);
  EXPECT_NEAR(purity.OnPeoplePercent(), 100.0 / 3, 1e-9);
}

TEST(JudgeMap, LeavesOutKeyframesWithoutMaskAndOtherMaps) {
  MapEditor map(TestCamera(), Pyramid());
  const KeyframeId masked = AddKeyframe(&map, 3, {kPersonX});
  const KeyframeId unmasked = AddKeyframe(&map, 4, {kWallX, kWallX});
  const KeyframeId other = AddKeyframe(&map, 5, {kPersonX}, 2);
  const LandmarkId walker = AddLandmark(&map, 1), unjudged = AddLandmark(&map, 2),
                   foreign = AddLandmark(&map, 3, 2);
  map.SetObservation(map.At(masked), 0, map.At(walker));
  map.SetObservation(map.At(unmasked), 0, map.At(walker));
  map.SetObservation(map.At(unmasked), 1, map.At(unjudged));
  map.SetObservation(map.At(other), 0, map.At(foreign));

  const MapPurity purity = JudgeMap(map, kMap, LeftHalf);
  EXPECT_EQ(purity.keyframes, 2U);
  EXPECT_EQ(purity.keyframes_unjudged, 1U);
  EXPECT_EQ(purity.landmarks, 1U);
  EXPECT_EQ(purity.on_people, 1U);
}

TEST(JudgeMap, EmptyMapHasNobodyInIt) {
  EXPECT_EQ(JudgeMap(Map(TestCamera(), Pyramid()), kMap, LeftHalf).OnPeoplePercent(), 0.0);
}

TEST(MasksIn, NamesWhatIsMissing) {
  try {
    MasksIn("/nowhere");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/mask.txt"), std::string::npos);
  }
}

}  // namespace
}  // namespace dmslam
