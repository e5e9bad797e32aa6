#include "dmslam/loops/loop_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "dmslam/loops/testing/indexed_room.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the room and all it is made of

LoopAnswer Correct(const IndexedRoom& room, const VerifiedLoop& loop, const LoopcloserOptions& options = {}) {
  return CorrectLoop(room.map(), loop, LoopVerifier(options, 1), options, {});
}

std::map<KeyframeId, Sim3d> ByKeyframe(const LoopAnswer& answer) {
  std::map<KeyframeId, Sim3d> corrections;
  for (const auto& c : answer.corrections) corrections[c.keyframe] = c.corrected_from_base;
  return corrections;
}

/// A camera that is back after a round has drifted by 0.2 units and by 5 % of the scale.
class AfterARound : public ::testing::Test {
 protected:
  static constexpr int kHere = kPerRound + 10, kThere = 10;

  AfterARound() : AfterARound(WorldOptions{}) {}
  explicit AfterARound(const WorldOptions& world) : room_(world, kHere + 1) {
    loop_ = room_.TrueLoop(kHere, kThere);
    answer_ = Correct(room_, loop_);
    corrections_ = ByKeyframe(answer_);
  }
  /// By how much a correction moves the camera.
  double MovedBy(int k) const {
    const Eigen::Vector3d center = room_.At(k).T_cam_world.Center();
    return (corrections_.at(Room::IdOf(k)) * center - center).norm();
  }
  /// What the correction makes of the pose.
  Sim3d Corrected(int k) const {
    return Sim3d(room_.At(k).T_cam_world) * corrections_.at(Room::IdOf(k)).Inverse();
  }
  /// The keyframe in which a landmark was made, by its number.
  int MadeIn(LandmarkId id) const {
    return static_cast<int>(room_.map().At(id).first_keyframe.frame_index()) - 1;
  }

  IndexedRoom room_;
  VerifiedLoop loop_;
  LoopAnswer answer_;
  std::map<KeyframeId, Sim3d> corrections_;
};

TEST_F(AfterARound, TheKeyframeGoesWhereThePlaceSaysAndThePlaceStays) {
  ASSERT_EQ(answer_.kind, LoopAnswer::Kind::kLoop);
  EXPECT_EQ(answer_.seen_from, loop_.keyframe->id);
  EXPECT_EQ(answer_.matched, loop_.place->id);
  EXPECT_LT(MovedBy(kThere), 1e-9);
  EXPECT_GT(MovedBy(kHere), 0.15);
  const Sim3d S_here_there = Corrected(kHere) * Corrected(kThere).Inverse();
  EXPECT_LT((S_here_there.Inverse().translation - loop_.S_keyframe_place.Inverse().translation).norm(), 0.02);
  EXPECT_NEAR(S_here_there.scale / loop_.S_keyframe_place.scale, 1.0, 0.005);
}

TEST_F(AfterARound, ItGoesThereAlsoWhereNoLandmarksAreFused) {
  loop_.landmarks.clear();
  const LoopAnswer answer = Correct(room_, loop_);
  EXPECT_TRUE(answer.fusions.empty());
  corrections_ = ByKeyframe(answer);
  const Sim3d S_here_there = Corrected(kHere) * Corrected(kThere).Inverse();
  EXPECT_LT((S_here_there.Inverse().translation - loop_.S_keyframe_place.Inverse().translation).norm(), 0.02);
}

TEST_F(AfterARound, FusedLandmarksTieTheNeighboursToThePlaceAsWell) {
  for (const int back : {2, 4, 6, 8}) {
    const Sim3d S_here_there = Corrected(kHere - back) * Corrected(kThere - back).Inverse();
    const Sim3d truth = room_.TrueLoop(kHere - back, kThere - back).S_keyframe_place;
    EXPECT_LT((S_here_there.Inverse().translation - truth.Inverse().translation).norm(), 3e-4 * back) << back;
    EXPECT_NEAR(S_here_there.scale / truth.scale, 1.0, 3e-4) << back;
  }
}

TEST_F(AfterARound, TheDriftIsSpreadOverTheKeyframesBetween) {
  ASSERT_EQ(corrections_.size(), room_.map().keyframes().size());
  double before = MovedBy(kThere);
  for (const int k : {30, 50, 70, 90, kHere}) {
    EXPECT_GT(MovedBy(k), before + 0.005) << k;
    before = MovedBy(k);
  }
  for (int k = 1; k <= kHere; ++k) EXPECT_LT(std::abs(MovedBy(k) - MovedBy(k - 1)), 0.02) << k;
}

TEST_F(AfterARound, LandmarksSeenFromBothSidesBecomeOne) {
  EXPECT_GE(answer_.fusions.size(), 100U);
  int wrong = 0;
  std::set<LandmarkId> gone;
  for (const auto& [from, into] : answer_.fusions) {
    EXPECT_NE(from, into);
    EXPECT_TRUE(gone.insert(from).second) << "none becomes two others";
    const Eigen::Vector3d p_from = Drift(MadeIn(from)).Inverse() * room_.map().At(from).p_world;
    const Eigen::Vector3d p_into = Drift(MadeIn(into)).Inverse() * room_.map().At(into).p_world;
    if ((p_from - p_into).norm() > 1e-6) ++wrong;  // two points of the room
  }
  EXPECT_LE(wrong, 2);
}

TEST_F(AfterARound, TheNeighboursGoWithTheKeyframeAndBringTheirLandmarks) {
  const Keyframe& here = room_.At(kHere);
  const auto seen_by_others = std::ranges::count_if(answer_.fusions, [&](const auto& fusion) {
    return room_.map().At(fusion.from).SeenBy(here.id) == nullptr;
  });
  EXPECT_GE(seen_by_others, 20);
}

TEST_F(AfterARound, WhatIsBelievedToMoveIsNotFused) {
  MapEditor map(room_.map());
  const std::vector<LandmarkId> seen = loop_.keyframe->landmarks;
  LandmarkEvidence moves;
  moves.motion_belief = 1.0F;
  for (const LandmarkId id : seen) map.SetEvidence(map.At(id), moves);
  const LoopcloserOptions options;
  const VerifiedLoop loop = room_.TrueLoopIn(map, kHere, kThere);
  const LoopAnswer answer = CorrectLoop(map, loop, LoopVerifier(options, 1), options, {});
  for (const auto& fusion : answer.fusions)
    EXPECT_EQ(std::ranges::count(seen, fusion.from), 0) << fusion.from.number();
}

class InAnotherMap : public AfterARound {
 protected:
  InAnotherMap() : AfterARound({.second_map_at = kPerRound - 2}) {}
};

TEST_F(InAnotherMap, TheWholeMapIsCarriedAndNothingElse) {
  ASSERT_EQ(answer_.kind, LoopAnswer::Kind::kLoop);
  EXPECT_EQ(corrections_.size(), room_.map().KeyframesOf(2).size());
  for (const auto& [id, correction] : corrections_) {
    EXPECT_EQ(room_.map().At(id).map_id, 2U);
    EXPECT_EQ(correction, corrections_.begin()->second);
  }
  const Sim3d S_here_there = Corrected(kHere) * Sim3d(room_.At(kThere).T_cam_world).Inverse();
  EXPECT_LT((S_here_there.Inverse().translation - loop_.S_keyframe_place.Inverse().translation).norm(), 1e-6);
  EXPECT_NEAR(S_here_there.scale / loop_.S_keyframe_place.scale, 1.0, 1e-6);
  EXPECT_GE(answer_.fusions.size(), 20U);
}

// ---- The adjustment that follows ----

/// Keyframes that see a cloud. One of them, and some of the points, are not where they are said to be.
class Adjusting : public ::testing::Test {
 protected:
  static constexpr size_t kPoints = 120;
  static constexpr uint32_t kKeyframesOfCloud = 5, kMisplaced = 3;

  Adjusting() {
    scene_.AddCloud(kPoints, {0.2, 0, 4}, {1.5, 1.2, 0.8});
    scene_.MapAll(kKeyframesOfCloud, 0.2);
    MapEditor& map = scene_.map();
    const Keyframe& keyframe = map.At(Id(kMisplaced));
    map.SetPose(keyframe, Rigid3d(ExpSo3({0, 0.004, 0}), {0.02, -0.01, 0.01}) * keyframe.T_cam_world);
    for (size_t i = 0; i < kPoints; i += 10)
      map.SetPosition(map.At(MapScene::IdOf(i)), 1.01 * scene_.point(i));
  }
  static KeyframeId Id(uint32_t k) { return KeyframeId::Make(MapScene::kSession, k); }

  MapScene scene_;
};

TEST_F(Adjusting, KeyframesAndLandmarksGoWhereTheObservationsPutThem) {
  const Map& map = scene_.map();
  const LoopAnswer answer = AdjustGlobally(map, MapScene::kMap, 1, {}, {});
  ASSERT_EQ(answer.kind, LoopAnswer::Kind::kGlobalAdjustment);
  std::map<KeyframeId, Sim3d> corrections = ByKeyframe(answer);
  ASSERT_EQ(corrections.size(), kKeyframesOfCloud);
  const Sim3d corrected = Sim3d(map.At(Id(kMisplaced)).T_cam_world) * corrections[Id(kMisplaced)].Inverse();
  EXPECT_LT((corrected.ToRigid().Center() - MapScene::PoseAt(0.2 * kMisplaced).Center()).norm(), 2e-3);
  ASSERT_EQ(answer.landmark_offsets.size(), kPoints);
  for (const auto& [id, offset_world] : answer.landmark_offsets) {
    const Landmark& landmark = map.At(id);
    const Eigen::Vector3d after = corrections[landmark.reference] * landmark.p_world + offset_world;
    EXPECT_LT((after - scene_.point(id.number() - 1)).norm(), 0.015) << id.number();
  }
}

/// Farther away than the way between the cameras allows.
TEST_F(Adjusting, WhatHangsOnAKeyframeShrinksWithItsWorld) {
  MapEditor& map = scene_.map();
  for (size_t i = 0; i < kPoints; ++i) map.SetPosition(map.At(MapScene::IdOf(i)), 1.1 * scene_.point(i));
  const LoopAnswer answer = AdjustGlobally(map, MapScene::kMap, 1, {}, {});
  ASSERT_EQ(answer.kind, LoopAnswer::Kind::kGlobalAdjustment);
  for (const auto& [id, correction] : ByKeyframe(answer)) EXPECT_NEAR(correction.scale, 1 / 1.1, 0.005);
  for (const auto& [id, left_world] : answer.landmark_offsets) EXPECT_LT(left_world.norm(), 0.02);
}

/// More than half of them say so and are dropped: the median depth falls from there to four.
TEST_F(Adjusting, NoWorldShrinksFromInfinity) {
  MapEditor& map = scene_.map();
  for (size_t i = 0; i < kPoints; ++i) {
    if (i % 5 < 3) map.SetPosition(map.At(MapScene::IdOf(i)), 1e8 * scene_.point(i));
  }
  const LoopAnswer answer = AdjustGlobally(map, MapScene::kMap, 1, {}, {});
  ASSERT_EQ(answer.kind, LoopAnswer::Kind::kGlobalAdjustment);
  for (const auto& [id, correction] : ByKeyframe(answer)) EXPECT_GT(correction.scale, 0.499) << id.value;
}

}  // namespace
}  // namespace dmslam
