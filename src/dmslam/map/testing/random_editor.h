#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/util/random.h"

namespace dmslam {

inline std::shared_ptr<const FrameFeatures> RandomFeatures(Random& random, size_t count) {
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

  MapEditor& map() { return map_; }

  /// What a loop does: keyframes move, and landmarks with their references. Once between two deltas.
  void Correct() {
    std::map<KeyframeId, Sim3d> moves;
    for (const auto& [id, keyframe] : map_.keyframes()) {
      if (random_.Below(3) == 0) continue;
      const Sim3d move(ExpSo3({0, random_.Uniform(-0.1, 0.1), 0}), {random_.Uniform(), 0, random_.Uniform()},
                       random_.Uniform(0.9, 1.1));
      const Sim3d corrected = Sim3d(keyframe.T_cam_world) * move.Inverse();
      map_.SetPoseAndScale(keyframe, corrected.ToRigid(), move.scale);
      moves.emplace(id, move);
    }
    for (const LandmarkId id : map_.LandmarkIdsSorted()) {
      const Landmark& landmark = map_.At(id);
      const auto move = moves.find(landmark.reference);
      if (move == moves.end()) continue;
      if (random_.Below(5) == 0) {
        map_.SetPosition(landmark, {random_.Uniform(), random_.Uniform(), 4});
      } else {
        map_.MoveWithReference(landmark, move->second);
      }
    }
  }

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
  void Steps(int count) {
    for (int i = 0; i < count; ++i) Step();
  }

 private:
  std::optional<KeyframeId> AnyKeyframe() {
    if (map_.keyframes().empty()) return std::nullopt;
    auto it = map_.keyframes().begin();
    std::advance(it, random_.Below(static_cast<uint32_t>(map_.keyframes().size())));
    return it->first;
  }
  std::optional<LandmarkId> AnyLandmark() {
    const std::vector<LandmarkId> ids = map_.LandmarkIdsSorted();
    if (ids.empty()) return std::nullopt;
    return ids[random_.Below(static_cast<uint32_t>(ids.size()))];
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
    landmark.reference = *AnyKeyframe();
    const KeyframeId observer = landmark.reference;
    const LandmarkId id = landmark.id;
    map_.AddLandmark(landmark);
    map_.SetObservation(map_.At(observer), static_cast<uint16_t>(random_.Below(30)), map_.At(id));
  }
  void Observe() {
    const std::optional<LandmarkId> landmark = AnyLandmark();
    if (!landmark) return;
    const std::optional<KeyframeId> keyframe = AnyKeyframe();
    map_.SetObservation(map_.At(*keyframe), static_cast<uint16_t>(random_.Below(30)), map_.At(*landmark));
    if (random_.Below(3) == 0) map_.UpdateDescriptor(map_.At(*landmark));
  }
  void MoveSomething() {
    if (const std::optional<KeyframeId> id = AnyKeyframe()) {
      map_.SetPoseAndScale(map_.At(*id),
                           Rigid3d(ExpSo3({random_.Uniform(), 0, 0}), {random_.Uniform(), 0, 0}), 1.25);
    }
    if (const std::optional<LandmarkId> id = AnyLandmark()) {
      map_.SetPosition(map_.At(*id), {random_.Uniform(), random_.Uniform(), 4});
      LandmarkEvidence evidence;
      evidence.found = random_.Below(100);
      map_.SetEvidence(map_.At(*id), evidence);
    }
  }
  void FuseSomething() {
    const std::optional<LandmarkId> a = AnyLandmark(), b = AnyLandmark();
    if (a && a != b) map_.Fuse(map_.At(*a), map_.At(*b), map_.At(*a).evidence);
  }
  void RemoveSomeLandmark() {
    if (const std::optional<LandmarkId> id = AnyLandmark()) map_.RemoveLandmark(map_.At(*id));
  }
  void RemoveSomeKeyframe() {
    const std::optional<KeyframeId> id = AnyKeyframe();
    if (id && map_.At(*id).parent) map_.RemoveKeyframe(map_.At(*id));
  }

  Random random_;
  MapEditor map_;
  uint32_t next_frame_ = 1;
  uint64_t next_landmark_ = 1;
};

inline void ExpectSameLandmarks(const Map& a, const Map& b) {
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
inline void ExpectNeighboursInSpace(const Map& map) {
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
    std::vector<const Keyframe*> expected;
    expected.reserve(near.size());
    for (const auto& [apart, other_id] : near) expected.push_back(&map.At(other_id));
    EXPECT_EQ(map.KeyframesNear(keyframe, kDistance, kAngleRad), expected);
  }
}

inline void ExpectSameMaps(const Map& a, const Map& b) {
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
    EXPECT_TRUE(std::is_permutation(x.seen.begin(), x.seen.end(), y->seen.begin(), y->seen.end()));
    EXPECT_EQ(a.Children(id), b.Children(id));
  }
  EXPECT_EQ(a.landmark_tombstones(), b.landmark_tombstones());
  EXPECT_EQ(a.keyframe_tombstones().size(), b.keyframe_tombstones().size());
  for (const auto& [id, tombstone] : a.keyframe_tombstones()) EXPECT_TRUE(b.HasKnown(id));
  ExpectSameLandmarks(a, b);
  ExpectNeighboursInSpace(a);
  ExpectNeighboursInSpace(b);
}

}  // namespace dmslam
