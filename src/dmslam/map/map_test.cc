#include "dmslam/map/map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

std::shared_ptr<const FrameFeatures> RandomFeatures(Random& random, size_t count) {
  FeatureSet set;
  for (size_t i = 0; i < count; ++i) {
    set.keypoints.push_back({static_cast<uint16_t>(random.Below(640 * 16)),
                             static_cast<uint16_t>(random.Below(480 * 16)),
                             static_cast<uint8_t>(random.Below(8)), static_cast<uint8_t>(random.Below(256))});
    Descriptor descriptor;
    for (uint64_t& word : descriptor.words) word = random.Next();
    set.descriptors.push_back(descriptor);
  }
  return MakeFrameFeatures(std::move(set), TestCamera(), Pyramid());
}

/// Edits a map at random: what a mapper may do to it, in any order.
class RandomEditor {
 public:
  explicit RandomEditor(uint64_t seed) : random_(seed), map_(TestCamera(), Pyramid()) {}

  Map& map() { return map_; }

  void Step() {
    switch (random_.Below(10)) {
      case 0:
        AddKeyframe();
        break;
      case 1:
      case 2:
        AddLandmark();
        break;
      case 3:
      case 4:
      case 5:
        Observe();
        break;
      case 6:
        MoveSomething();
        break;
      case 7:
        FuseSomething();
        break;
      case 8:
        if (random_.Below(4) == 0) RemoveSomeKeyframe();
        break;
      default:
        if (random_.Below(3) == 0) RemoveSomeLandmark();
    }
  }

 private:
  KeyframeId AnyKeyframe() {
    if (map_.keyframes().empty()) return {};
    auto it = map_.keyframes().begin();
    std::advance(it, random_.Below(static_cast<uint32_t>(map_.keyframes().size())));
    return it->first;
  }
  LandmarkId AnyLandmark() {
    const std::vector<LandmarkId> ids = map_.LandmarkIdsSorted();
    return ids.empty() ? LandmarkId{} : ids[random_.Below(static_cast<uint32_t>(ids.size()))];
  }
  void AddKeyframe() {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, next_frame_++);
    keyframe.map_id = 1;
    keyframe.parent = AnyKeyframe();
    keyframe.T_cam_world.rotation = ExpSo3({0, 0.1 * (next_frame_ % 7), 0});
    keyframe.T_cam_world.translation = {random_.Uniform(), random_.Uniform(), random_.Uniform()};
    keyframe.features = RandomFeatures(random_, 30);
    map_.AddKeyframe(keyframe);
  }
  void AddLandmark() {
    if (map_.keyframes().empty()) return;
    Landmark landmark;
    landmark.id = LandmarkId::Make(1, next_landmark_++);
    landmark.map_id = 1;
    landmark.p_world = {random_.Uniform(), random_.Uniform(), 5};
    landmark.reference = AnyKeyframe();
    const KeyframeId observer = landmark.reference;
    const LandmarkId id = landmark.id;
    map_.AddLandmark(landmark);
    map_.SetObservation(observer, static_cast<uint16_t>(random_.Below(30)), id);
  }
  void Observe() {
    const LandmarkId landmark = AnyLandmark();
    if (!landmark.valid()) return;
    const KeyframeId keyframe = AnyKeyframe();
    map_.SetObservation(keyframe, static_cast<uint16_t>(random_.Below(30)), landmark);
    if (random_.Below(3) == 0) map_.UpdateDescriptor(landmark);
  }
  void MoveSomething() {
    if (const KeyframeId id = AnyKeyframe(); id.valid()) {
      map_.SetPoseAndScale(id, Rigid3d(ExpSo3({random_.Uniform(), 0, 0}), {random_.Uniform(), 0, 0}), 1.25);
    }
    if (const LandmarkId id = AnyLandmark(); id.valid()) {
      map_.SetPosition(id, {random_.Uniform(), random_.Uniform(), 4});
      LandmarkEvidence evidence;
      evidence.found = random_.Below(100);
      map_.SetEvidence(id, evidence);
    }
  }
  void FuseSomething() {
    const LandmarkId a = AnyLandmark(), b = AnyLandmark();
    if (a.valid() && a != b) map_.Fuse(a, b);
  }
  void RemoveSomeLandmark() {
    if (const LandmarkId id = AnyLandmark(); id.valid()) map_.RemoveLandmark(id);
  }
  void RemoveSomeKeyframe() {
    const KeyframeId id = AnyKeyframe();
    if (id.valid() && map_.FindKeyframe(id)->parent.valid()) map_.RemoveKeyframe(id);
  }

  Random random_;
  Map map_;
  uint32_t next_frame_ = 1;
  uint64_t next_landmark_ = 1;
};

void ExpectSameLandmarks(const Map& a, const Map& b) {
  ASSERT_EQ(a.LandmarkIdsSorted(), b.LandmarkIdsSorted());
  for (const LandmarkId id : a.LandmarkIdsSorted()) {
    const Landmark &x = *a.FindLandmark(id), &y = *b.FindLandmark(id);
    EXPECT_EQ(x.p_world, y.p_world);
    EXPECT_EQ(x.descriptor, y.descriptor);
    EXPECT_EQ(x.reference, y.reference);
    EXPECT_EQ(x.evidence, y.evidence);
    EXPECT_EQ(x.observations, y.observations);
    EXPECT_EQ(x.first_keyframe, y.first_keyframe);
  }
}

/// KeyframesNear goes by a copy of what the keyframes say.
void ExpectNeighboursInSpace(const Map& map) {
  constexpr double kDistance = 0.5, kAngleRad = 0.3;
  for (const auto& [id, keyframe] : map.keyframes()) {
    std::vector<std::pair<double, KeyframeId>> near;
    for (const auto& [other_id, other] : map.keyframes()) {
      const double apart = (other.T_cam_world.Center() - keyframe.T_cam_world.Center()).norm();
      const double turned = AngleBetween(other.T_cam_world.rotation, keyframe.T_cam_world.rotation);
      const bool is_near = apart < kDistance && turned < kAngleRad;
      if (other_id != id && other.map_id == keyframe.map_id && is_near) near.emplace_back(apart, other_id);
    }
    std::sort(near.begin(), near.end());
    std::vector<KeyframeId> expected;
    for (const auto& [apart, other_id] : near) expected.push_back(other_id);
    EXPECT_EQ(map.KeyframesNear(id, kDistance, kAngleRad), expected);
  }
}

void ExpectSameMaps(const Map& a, const Map& b) {
  ASSERT_EQ(a.keyframes().size(), b.keyframes().size());
  for (const auto& [id, x] : a.keyframes()) {
    const Keyframe* y = b.FindKeyframe(id);
    ASSERT_NE(y, nullptr);
    EXPECT_EQ(x.T_cam_world.rotation.coeffs(), y->T_cam_world.rotation.coeffs());
    EXPECT_EQ(x.T_cam_world.translation, y->T_cam_world.translation);
    EXPECT_EQ(x.scale, y->scale);
    EXPECT_EQ(x.parent, y->parent);
    EXPECT_EQ(x.landmarks, y->landmarks);
    EXPECT_EQ(x.covisible, y->covisible);
    EXPECT_EQ(a.Children(id), b.Children(id));
  }
  EXPECT_EQ(a.landmark_tombstones(), b.landmark_tombstones());
  ExpectSameLandmarks(a, b);
  ExpectNeighboursInSpace(a);
  ExpectNeighboursInSpace(b);
}

TEST(Map, ReplicaEqualsOriginalAfterRandomEdits) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    RandomEditor editor(seed);
    Map replica(TestCamera(), Pyramid());
    for (int round = 0; round < 40; ++round) {
      for (int step = 0; step < 25; ++step) editor.Step();
      const MapDelta delta = editor.map().TakeDelta(MapEvent::kSettled, {}, 1);
      replica.Apply(delta);
      if (round % 3 == 0) replica.Apply(delta);  // twice is once
    }
    ExpectSameMaps(editor.map(), replica);
    EXPECT_EQ(replica.skipped_references(), 0u);
  }
}

TEST(Map, SnapshotRebuildsTheMap) {
  size_t unobserved = 0;  // landmarks whose only feature was given to another one
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    RandomEditor editor(seed);
    for (int step = 0; step < 1500; ++step) editor.Step();
    Map replica(TestCamera(), Pyramid());
    const std::vector<MapDelta> parts = editor.map().Snapshot(editor.map().keyframes().begin()->first, 8000);
    EXPECT_GT(parts.size(), 3u);
    for (const MapDelta& part : parts) replica.Apply(part);
    ExpectSameMaps(editor.map(), replica);
    for (const LandmarkId id : replica.LandmarkIdsSorted())
      unobserved += replica.FindLandmark(id)->observations.empty() ? 1 : 0;
  }
  EXPECT_GT(unobserved, 0u);
}

TEST(Map, CovisibilityCountsSharedLandmarks) {
  RandomEditor editor(9);
  for (int step = 0; step < 2000; ++step) editor.Step();
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

TEST(Map, SpanningTreeStaysOneTree) {
  RandomEditor editor(11);
  for (int step = 0; step < 3000; ++step) editor.Step();
  for (const auto& [id, keyframe] : editor.map().keyframes()) {
    std::set<KeyframeId> seen;
    KeyframeId at = id;
    while (at.valid()) {
      ASSERT_TRUE(seen.insert(at).second) << "a circle in the spanning tree";
      const Keyframe* node = editor.map().FindKeyframe(at);
      ASSERT_NE(node, nullptr) << "a parent that is gone";
      at = node->parent;
    }
  }
}

TEST(Map, CulledKeyframesAndFusedLandmarksResolve) {
  Random random(3);
  Map map(TestCamera(), Pyramid());
  for (uint32_t i = 1; i <= 3; ++i) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, i);
    keyframe.map_id = 1;
    if (i > 1) keyframe.parent = KeyframeId::Make(1, i - 1);
    keyframe.T_cam_world.translation = {-static_cast<double>(i), 0, 0};
    keyframe.features = RandomFeatures(random, 5);
    map.AddKeyframe(keyframe);
  }
  map.RemoveKeyframe(KeyframeId::Make(1, 3));
  map.RemoveKeyframe(KeyframeId::Make(1, 2));
  map.SetPoseAndScale(KeyframeId::Make(1, 1), Rigid3d(Eigen::Quaterniond::Identity(), {-2, 0, 0}), 2.0);
  const auto pose = map.ResolvePose(KeyframeId::Make(1, 3));
  ASSERT_TRUE(pose.has_value());
  EXPECT_NEAR((pose->T_cam_world.translation - Eigen::Vector3d(-6, 0, 0)).norm(), 0, 1e-12);
  EXPECT_EQ(map.ResolveKeyframe(KeyframeId::Make(1, 3)), KeyframeId::Make(1, 1));
  EXPECT_FALSE(map.ResolvePose(KeyframeId::Make(1, 9)).has_value());
}

TEST(Map, TombstonesOfLandmarksAreBounded) {
  Map map(TestCamera(), Pyramid()), replica(TestCamera(), Pyramid());
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(1, 1);
  keyframe.map_id = 1;
  keyframe.features = MakeFrameFeatures({}, map.camera(), map.pyramid());
  const KeyframeId first = keyframe.id;
  map.AddKeyframe(std::move(keyframe));
  const auto add_and_remove = [&](LandmarkId id) {
    Landmark landmark;
    landmark.id = id;
    landmark.map_id = 1;
    landmark.reference = landmark.first_keyframe = first;
    map.AddLandmark(std::move(landmark));
    map.RemoveLandmark(id);
  };
  add_and_remove(LandmarkId::Make(2, 1));  // of the highest epoch, and the first to die
  constexpr uint64_t kMany = 3 * Map::kLandmarkTombstones;
  for (uint64_t i = 1; i <= kMany; ++i) {
    add_and_remove(LandmarkId::Make(1, i));
    if (i % 1000 == 0) replica.Apply(map.TakeDelta(MapEvent::kSettled, {}, 1));
  }
  replica.Apply(map.TakeDelta(MapEvent::kSettled, {}, 1));
  EXPECT_EQ(map.landmark_tombstones().size(), Map::kLandmarkTombstones);
  EXPECT_FALSE(map.landmark_tombstones().contains(LandmarkId::Make(1, 1)));
  EXPECT_TRUE(map.landmark_tombstones().contains(LandmarkId::Make(1, kMany)));
  EXPECT_EQ(map.HighestOrdinal(), 2);
  Map late(TestCamera(), Pyramid());
  for (const MapDelta& part : map.Snapshot(first, 60000)) late.Apply(part);
  for (const Map* other : {&replica, &late}) {
    EXPECT_EQ(other->landmark_tombstones(), map.landmark_tombstones());
    EXPECT_EQ(other->HighestOrdinal(), 2);
  }
}

TEST(Map, FirstKeyframeCannotBeRemoved) {
  Random random(3);
  Map map(TestCamera(), Pyramid());
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(1, 1);
  keyframe.features = RandomFeatures(random, 5);
  map.AddKeyframe(keyframe);
  EXPECT_THROW(map.RemoveKeyframe(keyframe.id), InvariantError);
}

}  // namespace
}  // namespace dmslam
