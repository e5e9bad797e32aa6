#include "dmslam/map/map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <thread>
#include <vector>

#include "dmslam/map/projection.h"
#include "dmslam/map/testing/random_editor.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Two keypoints of octaves 0 and 2, in the middle and 200 pixels beside it.
FeatureSet TwoKeypoints() {
  FeatureSet set;
  set.keypoints = {{320 * 16, 240 * 16, 0, 0}, {520 * 16, 240 * 16, 2, 0}};
  set.descriptors.resize(2);
  return set;
}

TEST(FrameFeatures, OctavesSayHowExactTheyAreUnlessSigmasDo) {
  const auto by_octave = MakeFrameFeatures(TwoKeypoints(), TestCamera(), Pyramid());
  EXPECT_TRUE(by_octave->sigmas_px.empty());
  EXPECT_EQ(by_octave->Variance(1, Pyramid()), Pyramid().SigmaSquared(2));
  FeatureSet set = TwoKeypoints();
  set.sigmas_px = {0.5F, 3};
  const auto measured = MakeFrameFeatures(std::move(set), TestCamera(), Pyramid());
  EXPECT_EQ(measured->Variance(0, Pyramid()), 0.25);
  EXPECT_EQ(NormalizedErrorSquared(*measured, 1, measured->uv_px[1] + Eigen::Vector2d(6, 0), Pyramid()), 4.0);
}

TEST(FrameFeatures, OfSmallImagesAreExactToAPartOfAPixel) {
  Camera camera = TestCamera();
  camera.width_px = 320;
  camera.height_px = 240;
  FeatureSet set = TwoKeypoints();
  set.keypoints[0].x_q4 = set.keypoints[1].x_q4 = 160 * 16;
  const Map map(camera, Pyramid());
  const auto features = MakeFrameFeatures(set, camera, Pyramid());
  EXPECT_EQ(features->Variance(0, map.pyramid()), 0.25);
  camera.lens = Lens::kFisheye;
  camera.cx_px = 160;
  camera.cy_px = 240;
  EXPECT_NEAR(MakeFrameFeatures(set, camera, Pyramid())->Variance(0, map.pyramid()), 0.25, 1e-6);
}

TEST(FrameFeatures, AreLessExactWhereTheLensStretchesTheImage) {
  Camera camera = TestCamera(300);
  camera.lens = Lens::kFisheye;
  const auto features = MakeFrameFeatures(TwoKeypoints(), camera, Pyramid());
  EXPECT_EQ(features->Variance(0, Pyramid()), 1.0);
  // An angle of 2/3: the tangent grows by 1 + tan^2 outwards, by tan / angle around.
  const double tangent = std::tan(2.0 / 3.0);
  const double stretch_squared = (1 + tangent * tangent) * tangent / (2.0 / 3.0);
  EXPECT_NEAR(features->Variance(1, Pyramid()), stretch_squared * Pyramid().SigmaSquared(2), 1e-4);
}

TEST(Map, CovisibilityCountsSharedLandmarks) {
  RandomEditor editor(9);
  editor.Steps(2000);
  const Map& map = editor.map();
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (const auto& [other_id, other] : map.keyframes()) {
      if (id == other_id) continue;
      int shared = 0;
      for (const LandmarkId landmark : keyframe.landmarks) {
        if (!landmark.valid()) continue;
        shared += static_cast<int>(std::count(other.landmarks.begin(), other.landmarks.end(), landmark));
      }
      const auto it = keyframe.covisible.find(other_id);
      EXPECT_EQ(it == keyframe.covisible.end() ? 0 : it->second, shared);
    }
  }
}

TEST(Map, KeyframesListTheLandmarksThatTheySee) {
  RandomEditor editor(11);
  editor.Steps(2000);
  size_t seen = 0;
  for (const auto& [id, keyframe] : editor.map().keyframes()) {
    std::vector<LandmarkId> expected;
    for (const LandmarkId landmark : keyframe.landmarks) {
      if (landmark.valid()) expected.push_back(landmark);
    }
    EXPECT_TRUE(
        std::is_permutation(keyframe.seen.begin(), keyframe.seen.end(), expected.begin(), expected.end()));
    seen += expected.size();
  }
  EXPECT_GT(seen, 20u);
}

TEST(Map, KeyframesNearStandNearAndLookTheSameWay) {
  RandomEditor editor(13);
  editor.Steps(2000);
  MapEditor& map = editor.map();
  double angle = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {  // most of them look the same way before
    Rigid3d turned = keyframe.T_cam_world;
    turned.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle += 0.3, Eigen::Vector3d::UnitY()));
    map.SetPoseAndScale(keyframe, turned, keyframe.scale);
  }
  size_t near = 0, too_far = 0, turned_away = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    std::set<KeyframeId> expected;
    for (const auto& [other_id, other] : map.keyframes()) {
      if (other_id == id || other.map_id != keyframe.map_id) continue;
      const double apart = (other.T_cam_world.Center() - keyframe.T_cam_world.Center()).norm();
      const double angle_rad = other.T_cam_world.rotation.angularDistance(keyframe.T_cam_world.rotation);
      too_far += apart >= 1.0 ? 1 : 0;
      turned_away += apart < 1.0 && angle_rad >= 0.7 ? 1 : 0;
      if (apart < 1.0 && angle_rad < 0.7) expected.insert(other_id);
    }
    double farthest = 0;
    std::set<KeyframeId> found;
    for (const Keyframe* other : map.KeyframesNear(keyframe, 1.0, 0.7)) {
      const double apart = (other->T_cam_world.Center() - keyframe.T_cam_world.Center()).norm();
      EXPECT_GE(apart, farthest) << "the nearest first";
      farthest = apart;
      found.insert(other->id);
    }
    EXPECT_EQ(found, expected);
    near += expected.size();
  }
  EXPECT_GT(near, 0u);
  EXPECT_GT(too_far, 0u);
  EXPECT_GT(turned_away, 0u);
}

TEST(Map, KnowsWhichMapsThereAre) {
  RandomEditor editor(13);
  editor.Steps(2000);
  MapEditor& map = editor.map();
  const MapId one = map.keyframes().begin()->second.map_id;
  constexpr MapId kNew = 77;
  EXPECT_TRUE(map.HasMap(one));
  EXPECT_FALSE(map.HasMap(kNew));
  for (const Keyframe* keyframe : map.KeyframesOf(one)) map.SetMapId(*keyframe, kNew);
  EXPECT_FALSE(map.HasMap(one));
  EXPECT_TRUE(map.HasMap(kNew));
  for (const auto& [id, keyframe] : map.keyframes()) map.SetMapId(keyframe, kNew);
  EXPECT_FALSE(map.HasAnotherMap(kNew));
  map.SetMapId(map.keyframes().begin()->second, one);
  EXPECT_TRUE(map.HasAnotherMap(kNew));
  map.DropMap(one);
  EXPECT_FALSE(map.HasAnotherMap(kNew));
}

TEST(Map, BestCovisibleAreThoseThatShareMost) {
  RandomEditor editor(5);
  editor.Steps(2000);
  const Map& map = editor.map();
  for (const auto& [id, keyframe] : map.keyframes()) {
    const std::vector<const Keyframe*> best = map.BestCovisible(keyframe, 3, 2);
    ASSERT_LE(best.size(), 3u);
    int least = 1 << 30;
    std::set<KeyframeId> listed;
    for (const Keyframe* other : best) {
      EXPECT_LE(keyframe.covisible.at(other->id), least);
      least = keyframe.covisible.at(other->id);
      listed.insert(other->id);
    }
    for (const auto& [other, shared] : keyframe.covisible) {
      if (listed.contains(other)) continue;
      EXPECT_LE(shared, best.size() < 3 ? 1 : least);
    }
    std::vector<KeyframeId> ids;
    ids.reserve(best.size());
    for (const Keyframe* other : best) ids.push_back(other->id);
    EXPECT_EQ(map.BestCovisible(id, 3, 2), ids);
  }
}

TEST(Map, SpanningTreeStaysOneTree) {
  RandomEditor editor(11);
  editor.Steps(3000);
  for (const auto& [id, keyframe] : editor.map().keyframes()) {
    std::set<KeyframeId> seen;
    for (std::optional<KeyframeId> at = id; at;) {
      ASSERT_TRUE(seen.insert(*at).second) << "a circle in the spanning tree";
      const Keyframe* node = editor.map().FindKeyframe(*at);
      ASSERT_NE(node, nullptr) << "a parent that is gone";
      at = node->parent;
    }
  }
}

TEST(Map, CulledKeyframesAndFusedLandmarksResolve) {
  Random random(3);
  MapEditor map(TestCamera(), Pyramid());
  for (uint32_t i = 1; i <= 3; ++i) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, i);
    keyframe.map_id = 1;
    if (i > 1) keyframe.parent = KeyframeId::Make(1, i - 1);
    keyframe.T_cam_world.translation = {-static_cast<double>(i), 0, 0};
    keyframe.features = RandomFeatures(random, 5);
    map.AddKeyframe(keyframe);
  }
  map.RemoveKeyframe(map.At(KeyframeId::Make(1, 3)));
  map.RemoveKeyframe(map.At(KeyframeId::Make(1, 2)));
  map.SetPoseAndScale(map.At(KeyframeId::Make(1, 1)), Rigid3d(Eigen::Quaterniond::Identity(), {-2, 0, 0}),
                      2.0);
  const auto pose = map.ResolvePose(KeyframeId::Make(1, 3));
  ASSERT_TRUE(pose.has_value());
  EXPECT_NEAR((pose->T_cam_world.translation - Eigen::Vector3d(-6, 0, 0)).norm(), 0, 1e-12);
  EXPECT_EQ(map.Resolve(KeyframeId::Make(1, 3)), &map.At(KeyframeId::Make(1, 1)));
  EXPECT_EQ(pose->keyframe, map.Resolve(KeyframeId::Make(1, 3)));
  EXPECT_TRUE(map.HasKnown(KeyframeId::Make(1, 3)));
  EXPECT_FALSE(map.ResolvePose(KeyframeId::Make(1, 9)).has_value());
  EXPECT_FALSE(map.HasKnown(KeyframeId::Make(1, 9)));
}

TEST(Map, AtNamesWhatIsMissing) {
  const Map map(TestCamera(), Pyramid());
  EXPECT_THROW((void)map.At(KeyframeId::Make(1, 1)), InvariantError);
  EXPECT_THROW((void)map.At(LandmarkId::Make(1, 1)), InvariantError);
}

/// A landmark four units before two cameras that stand two units apart; the features are of octaves 0 and 2.
class Viewing : public testing::Test {
 protected:
  Viewing() : map_(TestCamera(), Pyramid()) {
    for (const uint8_t octave : {uint8_t{0}, uint8_t{2}}) {
      FeatureSet features;
      features.keypoints.push_back({320 * 16, 240 * 16, octave, 0});
      features.descriptors.emplace_back();
      Keyframe keyframe;
      keyframe.id = KeyframeId::Make(1, octave + 1U);
      keyframe.T_cam_world.translation = {octave == 0 ? 1.0 : -1.0, 0, 0};
      keyframe.features = MakeFrameFeatures(features, map_.camera(), map_.pyramid());
      map_.AddKeyframe(keyframe);
    }
    Landmark landmark;
    landmark.id = id_;
    landmark.p_world = {0, 0, 4};
    landmark.reference = KeyframeId::Make(1, 3);
    map_.AddLandmark(landmark);
    map_.SetObservation(map_.At(KeyframeId::Make(1, 1)), 0, map_.At(id_));
  }
  ViewingRange Range() const { return map_.Viewing(map_.At(id_)); }

  MapEditor map_;
  const LandmarkId id_ = LandmarkId::Make(1, 1);
};

TEST_F(Viewing, FollowsFromWhoSeesTheLandmark) {
  EXPECT_NEAR(Range().max_distance, std::sqrt(17.0), 1e-12) << "the oldest: its reference does not see it";
  map_.SetObservation(map_.At(KeyframeId::Make(1, 3)), 0, map_.At(id_));
  const double scale = map_.pyramid().Scale(2);
  EXPECT_NEAR(Range().max_distance, std::sqrt(17.0) * scale, 1e-12) << "its reference sees it at octave 2";
  EXPECT_NEAR(Range().mean_direction.x(), 0, 1e-12) << "one from the left, one from the right";
  EXPECT_NEAR(Range().min_distance, Range().max_distance / map_.pyramid().Scale(map_.pyramid().levels - 1),
              1e-12);
}

TEST_F(Viewing, IsComputedAnewWhenTheLandmarkMoves) {
  EXPECT_NEAR(Range().max_distance, std::sqrt(17.0), 1e-12);
  map_.SetPosition(map_.At(id_), {-1, 0, 8});
  EXPECT_NEAR(Range().max_distance, 8, 1e-12);
}

TEST_F(Viewing, IsTheSameForThreadsThatAskAtATime) {
  const Map& map = map_;
  const Landmark& landmark = map.At(id_);
  for (int round = 0; round < 200; ++round) {
    map_.SetPosition(landmark, {0.01 * round, 0, 4});
    std::array<ViewingRange, 4> ranges;
    std::vector<std::thread> threads;
    threads.reserve(ranges.size());
    for (ViewingRange& range : ranges) threads.emplace_back([&] { range = map.Viewing(landmark); });
    for (std::thread& thread : threads) thread.join();
    for (const ViewingRange& range : ranges) {
      EXPECT_NEAR(range.max_distance, std::hypot(0.01 * round + 1, 4), 1e-12);
      EXPECT_EQ(range.mean_direction, Range().mean_direction);
    }
  }
}

TEST_F(Viewing, StaysWhenNobodySeesTheLandmarkAnyMore) {
  const double before = Range().max_distance;
  map_.ClearObservation(map_.At(KeyframeId::Make(1, 1)), 0);
  EXPECT_EQ(Range().max_distance, before);
}

}  // namespace
}  // namespace dmslam
