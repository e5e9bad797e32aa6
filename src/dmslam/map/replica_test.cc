#include "dmslam/map/replica.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "dmslam/map/snapshot.h"
#include "dmslam/map/testing/random_editor.h"

namespace dmslam {
namespace {

template <typename T>
concept CanSetPose = requires(T map) {
  map.SetPose(map.At(KeyframeId()), Rigid3d());
};
template <typename T>
concept CanRemoveLandmark = requires(T map) {
  map.RemoveLandmark(map.At(LandmarkId()));
};

TEST(Replica, CannotBeEdited) {
  static_assert(CanSetPose<MapEditor> && CanRemoveLandmark<MapEditor>);
  EXPECT_FALSE(CanSetPose<Replica>);
  EXPECT_FALSE(CanRemoveLandmark<Replica>);
}

TEST(Replica, EqualsTheOriginalAfterRandomEdits) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    RandomEditor editor(seed);
    Replica replica(TestCamera(), Pyramid());
    for (int round = 0; round < 40; ++round) {
      editor.Steps(25);
      const MapDelta delta = editor.map().TakeDelta(MapEvent::kSettled, {}, 1);
      replica.Apply(delta);
      if (round % 3 == 0) replica.Apply(delta);  // twice is once
    }
    ExpectSameMaps(editor.map(), replica);
    EXPECT_EQ(replica.version(), editor.map().version());
    EXPECT_EQ(replica.skipped_references(), 0u);
  }
}

TEST(Replica, FollowsCorrectionsThatAreToldOfKeyframesAlone) {
  size_t moves = 0, landmarks_moved = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    RandomEditor editor(seed);
    Replica replica(TestCamera(), Pyramid());
    for (int round = 0; round < 20; ++round) {
      editor.Steps(20);
      if (round % 2 == 0) replica.Apply(editor.map().TakeDelta(MapEvent::kSettled, {}, 1));
      if (round % 4 < 2) editor.Correct();
      if (round % 4 == 0) editor.Steps(20);
      const MapDelta delta = editor.map().TakeDelta(MapEvent::kSettled, {}, 1);
      replica.Apply(delta);
      if (round % 3 == 0) replica.Apply(delta);  // twice is once
      moves += delta.reference_moves.size();
      landmarks_moved += editor.map().num_landmarks() -
                         std::min(editor.map().num_landmarks(), delta.landmark_positions.size());
    }
    ExpectSameMaps(editor.map(), replica);
    EXPECT_EQ(replica.skipped_references(), 0u);
  }
  EXPECT_GT(moves, 100u);
  EXPECT_GT(landmarks_moved, 1000u);
}

TEST(Replica, ALateComerDoesNotMoveLandmarksAgain) {
  RandomEditor editor(3);
  editor.Steps(300);
  editor.map().TakeDelta(MapEvent::kSettled, {}, 1);
  editor.Correct();
  const MapDelta correction = editor.map().TakeDelta(MapEvent::kCorrected, {}, 1);
  ASSERT_FALSE(correction.reference_moves.empty());
  Replica replica(TestCamera(), Pyramid());
  for (const MapDelta& part : CutSnapshot(editor.map(), {}, 3000)) replica.Apply(part);
  replica.Apply(correction);
  ExpectSameMaps(editor.map(), replica);
}

TEST(Replica, NamesTheKeyframesThatCameAndWent) {
  RandomEditor editor(4);
  Replica replica(TestCamera(), Pyramid());
  std::set<KeyframeId> indexed;
  size_t removed = 0;
  for (int round = 0; round < 60; ++round) {
    editor.Steps(25);
    if (round == 50) editor.map().DropMap(1);
    replica.Apply(editor.map().TakeDelta(MapEvent::kSettled, {}, 1));
    for (const KeyframeId id : replica.applied_removed_keyframes()) removed += indexed.erase(id);
    for (const KeyframeId id : replica.applied_new_keyframes()) EXPECT_TRUE(indexed.insert(id).second);
    ASSERT_EQ(indexed.size(), replica.keyframes().size());
    for (const KeyframeId id : indexed) ASSERT_NE(replica.FindKeyframe(id), nullptr);
  }
  EXPECT_GT(removed, 3u);
}

TEST(Replica, SkipsAndCountsWhatItDoesNotKnow) {
  Replica replica(TestCamera(), Pyramid());
  MapDelta delta;
  delta.keyframe_poses.push_back({KeyframeId::Make(1, 1), Rigid3d(), 1.0});
  delta.landmark_positions.push_back({LandmarkId::Make(1, 1), Eigen::Vector3d::Zero()});
  delta.landmark_evidence.push_back({LandmarkId::Make(1, 1), {}});
  delta.observations.push_back({KeyframeId::Make(1, 1), 3, LandmarkId::Make(1, 1)});
  replica.Apply(delta);
  EXPECT_EQ(replica.skipped_references(), 4u);
  EXPECT_TRUE(replica.keyframes().empty());
}

TEST(Replica, ACulledKeyframeDoesNotComeBack) {
  RandomEditor editor(7);
  editor.Steps(300);
  const MapDelta everything = editor.map().TakeDelta(MapEvent::kSettled, {}, 1);
  Replica replica(TestCamera(), Pyramid());
  replica.Apply(everything);
  KeyframeId culled;
  for (const auto& [id, keyframe] : editor.map().keyframes()) {
    if (keyframe.parent) culled = id;
  }
  ASSERT_TRUE(culled.valid());
  editor.map().RemoveKeyframe(editor.map().At(culled));
  replica.Apply(editor.map().TakeDelta(MapEvent::kSettled, {}, 1));
  replica.Apply(everything);  // an old record once more
  EXPECT_EQ(replica.FindKeyframe(culled), nullptr);
  EXPECT_TRUE(replica.HasKnown(culled));
}

TEST(Replica, ClearForgetsAll) {
  RandomEditor editor(7);
  editor.Steps(300);
  Replica replica(TestCamera(), Pyramid());
  replica.Apply(editor.map().TakeDelta(MapEvent::kSettled, {}, 1));
  replica.Clear();
  EXPECT_TRUE(replica.keyframes().empty());
  EXPECT_EQ(replica.num_landmarks(), 0u);
  EXPECT_EQ(replica.version(), 0u);
  EXPECT_EQ(replica.camera().width_px, TestCamera().width_px);
}

TEST(Replica, TombstonesOfLandmarksAreBounded) {
  MapEditor map(TestCamera(), Pyramid());
  Replica replica(TestCamera(), Pyramid());
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(1, 1);
  keyframe.map_id = 1;
  keyframe.features = MakeFrameFeatures({}, map.camera(), map.pyramid());
  const KeyframeId first = map.AddKeyframe(std::move(keyframe)).id;
  const auto add_and_remove = [&](LandmarkId id) {
    Landmark landmark;
    landmark.id = id;
    landmark.map_id = 1;
    landmark.reference = landmark.first_keyframe = first;
    map.AddLandmark(std::move(landmark));
    map.RemoveLandmark(map.At(id));
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
  Replica late(TestCamera(), Pyramid());
  for (const MapDelta& part : CutSnapshot(map, first, 60000)) late.Apply(part);
  for (const Map* other : {&replica, &late}) {
    EXPECT_EQ(other->landmark_tombstones(), map.landmark_tombstones());
    EXPECT_EQ(other->HighestOrdinal(), 2);
  }
}

}  // namespace
}  // namespace dmslam
