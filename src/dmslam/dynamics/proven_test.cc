#include "dmslam/dynamics/proven.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

std::vector<int64_t> Stamps(const std::vector<double>& seconds) {
  std::vector<int64_t> stamps;
  for (const double s : seconds) stamps.push_back(static_cast<int64_t>(s * kSecond));
  return stamps;
}

/// A map in which one landmark is seen at these times.
MapEditor MapSeenAt(const std::vector<double>& seconds, float motion_belief = 0.0F) {
  MapEditor map(TestCamera(), Pyramid());
  Landmark landmark;
  landmark.id = LandmarkId::Make(1, 1);
  landmark.map_id = 1;
  landmark.p_world = {0, 0, 2};
  landmark.evidence.motion_belief = motion_belief;
  map.AddLandmark(landmark);
  for (size_t i = 0; i < seconds.size(); ++i) {
    FeatureSet features;
    features.keypoints.push_back({320 * 16, 240 * 16, 0, 0});
    features.descriptors.emplace_back();
    Keyframe keyframe;
    // Ids run against time, as they do where the map grows back.
    keyframe.id = KeyframeId::Make(1, static_cast<uint32_t>(seconds.size() - i));
    keyframe.map_id = 1;
    keyframe.stamp_ns = Stamps(seconds)[i];
    keyframe.features = MakeFrameFeatures(std::move(features), map.camera(), map.pyramid());
    const KeyframeId id = keyframe.id;
    map.AddKeyframe(std::move(keyframe));
    map.SetObservation(map.At(id), 0, map.At(landmark.id));
  }
  return map;
}

bool Proven(const Map& map) {
  return IsProven(map, *map.FindLandmark(LandmarkId::Make(1, 1)), ProvenOptions());
}

TEST(ProvenTest, WhatIsSeenNoLongerThanPeopleStandIsNot) {
  EXPECT_FALSE(OutlastsStanding({}, ProvenOptions()));
  EXPECT_FALSE(OutlastsStanding(Stamps({0, 1, 2, 3, 4}), ProvenOptions()));
}

TEST(ProvenTest, ASingleObservationAtAnotherTimeMayBeAWrongMatch) {
  EXPECT_FALSE(OutlastsStanding(Stamps({0, 1, 2, 3, 9}), ProvenOptions()));
  EXPECT_TRUE(OutlastsStanding(Stamps({0, 1, 2, 3, 8, 9}), ProvenOptions()));
}

TEST(ProvenTest, SeenLongIsProvenInWhateverOrderTheKeyframesCame) {
  EXPECT_TRUE(Proven(MapSeenAt({0, 1, 2, 3, 4, 5, 6})));
  EXPECT_FALSE(Proven(MapSeenAt({0, 1, 2, 3})));
}

TEST(ProvenTest, WhatIsBelievedToMoveIsNot) { EXPECT_FALSE(Proven(MapSeenAt({0, 2, 4, 6, 8}, 1.0F))); }

TEST(ProvenTest, AYoungMapCannotHaveProvenLandmarks) {
  const MapEditor young = MapSeenAt({0, 1, 2, 3, 4, 5, 6}), old = MapSeenAt({0, 2, 4, 6, 8, 10});
  EXPECT_FALSE(CanBeProven(young, 1, ProvenOptions()));
  EXPECT_TRUE(CanBeProven(old, 1, ProvenOptions()));
  EXPECT_FALSE(CanBeProven(old, 2, ProvenOptions())) << "there is no such map";
  const LandmarkId id = LandmarkId::Make(1, 1);
  EXPECT_EQ(CountProven(old, {id, LandmarkId(), LandmarkId::Make(1, 9)}, ProvenOptions()), 1);
}

}  // namespace
}  // namespace dmslam
