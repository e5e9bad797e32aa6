#include "viewer/viewer_core.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr MapId kMapId = 3;

/// A mapper's map of cameras on a circle, and what it says.
class ViewerCoreTest : public testing::Test {
 protected:
  ViewerCoreTest() : map_(TestCamera(), Pyramid()), core_(TestCamera(), Pyramid()) {}

  static KeyframeId Kf(int i) { return KeyframeId::Make(1, static_cast<uint32_t>(10 * i)); }
  static Rigid3d PoseAt(int i) {
    const double angle = 0.3 * i;
    return Rigid3d(ExpSo3({0, angle, 0}), {2 * std::cos(angle), 0.1 * i, 2 * std::sin(angle)}).Inverse();
  }
  void AddKeyframe(int i, size_t features = 40) {
    AddKeyframeOf(kMapId, Kf(i), i, i > 0 ? std::optional(Kf(i - 1)) : std::nullopt, features);
  }
  void AddKeyframeOf(MapId map_id, KeyframeId id, int i, std::optional<KeyframeId> parent = {},
                     size_t features = 40) {
    FeatureSet set;
    Random random(static_cast<uint64_t>(i));
    for (size_t k = 0; k < features; ++k) {
      set.keypoints.push_back(
          {static_cast<uint16_t>(random.Below(10000)), static_cast<uint16_t>(random.Below(7000)), 0, 0});
      set.descriptors.push_back({{random.Next(), random.Next(), random.Next(), random.Next()}});
    }
    Keyframe keyframe;
    keyframe.id = id;
    keyframe.map_id = map_id;
    keyframe.T_cam_world = PoseAt(i);
    keyframe.parent = parent;
    keyframe.features = MakeFrameFeatures(set, map_.camera(), map_.pyramid());
    map_.AddKeyframe(keyframe);
  }
  void AddLandmark(uint64_t number, int seen_by, uint16_t feature, float belief = -1) {
    Landmark landmark;
    landmark.id = LandmarkId::Make(1, number);
    landmark.map_id = kMapId;
    landmark.p_world = {1.0 * static_cast<double>(number), 0, 5};
    landmark.reference = landmark.first_keyframe = Kf(seen_by);
    landmark.evidence.motion_belief = belief;
    map_.AddLandmark(landmark);
    map_.SetObservation(map_.At(Kf(seen_by)), feature, map_.At(landmark.id));
  }
  void Say(MapEvent event = MapEvent::kMapped) {
    core_.OnMapDelta(map_.TakeDelta(event, map_.keyframes().rbegin()->first, kMapId));
    core_.Draw(&scene_);
  }
  void SayFrame(uint32_t index, int reference, const Rigid3d& T_cam_reference = {}) {
    SayFrameOf(0, index, kMapId, Kf(reference), T_cam_reference);
  }
  void SayFrameOf(CameraId camera, uint32_t index, MapId map_id, KeyframeId reference,
                  const Rigid3d& T_cam_reference = {}) {
    FramePose pose;
    pose.camera_id = camera;
    pose.frame_index = index;
    pose.stamp_ns = static_cast<int64_t>(index) * 33'000'000;
    pose.state = TrackingState::kTracking;
    pose.map_id = map_id;
    pose.reference = reference;
    pose.T_cam_reference = T_cam_reference;
    core_.OnFramePose(pose);
  }
  /// As it is drawn.
  template <typename Table, typename Key>
  static auto Drawn(const Table& table, const Key& key) {
    const int64_t slot = table.Find(key);
    EXPECT_GE(slot, 0);
    return table.slots().at(static_cast<size_t>(slot)).value;
  }
  static Eigen::Vector3d Vector(const Float3& p) { return {p[0], p[1], p[2]}; }
  Eigen::Vector3d PathAt(uint32_t frame, CameraId camera = 0) {
    return Vector(Drawn(scene_.path(), SceneFrame{camera, frame}).position);
  }
  /// Where a camera is drawn with this version of the map.
  Eigen::Vector3d CameraAt(CameraId camera) { return Vector(scene_.cameras().at(camera).center); }
  /// A second map of camera 1, with three keyframes where the first map has its own, and a landmark.
  static constexpr MapId kOtherMap = kMapsPerCamera + 1;
  static KeyframeId OtherKf(int i) { return KeyframeId::Make(1, static_cast<uint32_t>(10 * i), 1); }
  void AddOtherMap() {
    for (int i = 0; i < 3; ++i)
      AddKeyframeOf(kOtherMap, OtherKf(i), i, i > 0 ? std::optional(OtherKf(i - 1)) : std::nullopt);
    Landmark landmark;
    landmark.id = kOtherLandmark;
    landmark.map_id = kOtherMap;
    landmark.p_world = {1, 2, 3};
    landmark.reference = landmark.first_keyframe = OtherKf(0);
    map_.AddLandmark(landmark);
    map_.SetObservation(map_.At(OtherKf(0)), 0, map_.At(landmark.id));
  }
  static constexpr LandmarkId kOtherLandmark{(uint64_t{1} << 48) | 900};

  MapEditor map_;
  ViewerCore core_;
  ViewerScene scene_;
};

TEST_F(ViewerCoreTest, DrawsWhatTheMapHolds) {
  AddKeyframe(0);
  AddKeyframe(1);
  for (uint64_t i = 1; i <= 35; ++i) AddLandmark(i, 0, static_cast<uint16_t>(i), i == 4 ? 2.0F : -1.0F);
  for (uint16_t i = 1; i <= 35; ++i) map_.SetObservation(map_.At(Kf(1)), i, map_.At(LandmarkId::Make(1, i)));
  Say();
  EXPECT_EQ(scene_.points().size(), 35u);
  EXPECT_EQ(scene_.keyframes().size(), 2u);
  EXPECT_EQ(core_.num_moving(), 1u);
  const auto& second = scene_.keyframes().slots()[1].value;
  ASSERT_EQ(second.links.size(), 1u) << "its parent, which it shares landmarks with, is linked once";
  EXPECT_EQ(second.links[0].slot, 0u);
  EXPECT_NEAR(
      (Eigen::Vector3d(second.center[0], second.center[1], second.center[2]) - PoseAt(1).Center()).norm(), 0,
      1e-6);
}

TEST_F(ViewerCoreTest, AParentThatIsDrawnAfterItsChildIsLinked) {
  AddKeyframe(1);
  map_.SetParent(map_.At(Kf(1)), {});
  AddKeyframe(0);  // the map grew back to it
  map_.SetParent(map_.At(Kf(0)), Kf(1));
  Say();
  const int64_t slot = scene_.keyframes().Find(Kf(0));
  ASSERT_GE(slot, 0);
  const auto& links = scene_.keyframes().slots()[static_cast<size_t>(slot)].value.links;
  ASSERT_EQ(links.size(), 1U);
  EXPECT_EQ(links[0].slot, scene_.keyframes().Find(Kf(1)));
}

TEST_F(ViewerCoreTest, LandmarksGoWithTheirTombstonesOrTheirKeyframe) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  for (uint64_t i = 1; i <= 20; ++i) AddLandmark(i, static_cast<int>(i % 3), static_cast<uint16_t>(i));
  Say();
  map_.RemoveLandmark(map_.At(LandmarkId::Make(1, 6)));
  map_.RemoveKeyframe(map_.At(Kf(1)));
  Say();
  EXPECT_EQ(scene_.points().size(), map_.num_landmarks());
  EXPECT_EQ(scene_.keyframes().size(), 2u);
}

TEST_F(ViewerCoreTest, FramesFollowTheirReferenceEvenWhenItIsCulled) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  SayFrame(11, 1, Rigid3d(Eigen::Quaterniond::Identity(), {0, 0, 0.5}));
  Say();
  const Eigen::Vector3d before = PathAt(11);
  map_.RemoveKeyframe(map_.At(Kf(1)));
  Say();
  EXPECT_NEAR((PathAt(11) - before).norm(), 0, 1e-6);
  const Eigen::Vector3d shift(0.3, -0.2, 0.1);
  const Rigid3d T = map_.FindKeyframe(Kf(0))->T_cam_world;
  map_.SetPose(map_.At(Kf(0)), T * Rigid3d(Eigen::Quaterniond::Identity(), -shift));
  Say();
  EXPECT_NEAR((PathAt(11) - before - shift).norm(), 0, 1e-6) << "the parent that stands for it has moved";
}

TEST_F(ViewerCoreTest, TruthIsAlignedByASimilarity) {
  for (int i = 0; i < 20; ++i) AddKeyframe(i);
  const Sim3d truth_from_map(ExpSo3({0.1, -0.4, 0.2}), {3, 1, -2}, 2.5);
  for (int i = 0; i < 20; ++i) {
    SayFrame(static_cast<uint32_t>(10 * i), i);
    core_.OnTruth({0, static_cast<uint32_t>(10 * i)},
                  Rigid3d(Eigen::Quaterniond::Identity(), truth_from_map * PoseAt(i).Center()));
  }
  Say();
  EXPECT_EQ(scene_.truth().size(), 20u);
  const auto alignment = core_.AlignTruth();
  ASSERT_TRUE(alignment);
  EXPECT_EQ(alignment->pairs, 20u);
  EXPECT_LT(alignment->rmse_m, 1e-4);
  EXPECT_NEAR(alignment->map_from_truth.scale, 1 / 2.5, 1e-4);
  const Eigen::Vector3d back = alignment->map_from_truth * (truth_from_map * PoseAt(5).Center());
  EXPECT_NEAR((back - PoseAt(5).Center()).norm(), 0, 1e-3);
}

TEST_F(ViewerCoreTest, AVoidMapIsTakenOffAndASnapshotBringsTheFramesBack) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  for (uint64_t i = 1; i <= 20; ++i) AddLandmark(i, 0, static_cast<uint16_t>(i));
  SayFrame(15, 1);
  Say();
  const uint32_t generation = scene_.generation();
  core_.ForgetMap();
  core_.Draw(&scene_);
  EXPECT_NE(scene_.generation(), generation);
  EXPECT_EQ(scene_.points().size() + scene_.keyframes().size() + scene_.path().size(), 0u);
  for (const MapDelta& part : CutSnapshot(map_, Kf(2), 4000)) core_.OnMapDelta(part);
  core_.Draw(&scene_);
  EXPECT_EQ(scene_.points().size(), 20u);
  EXPECT_EQ(scene_.keyframes().size(), 3u);
  EXPECT_EQ(scene_.path().size(), 1u);
}

TEST_F(ViewerCoreTest, MapsThatAreApartLieBesideEachOtherInTheirColours) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  for (uint64_t i = 1; i <= 20; ++i) AddLandmark(i, 0, static_cast<uint16_t>(i));
  SayFrame(11, 1);
  Say();
  AddOtherMap();
  SayFrameOf(1, 12, kOtherMap, OtherKf(1));
  Say();
  EXPECT_EQ(core_.shown_map(), kMapId) << "another camera's first frame moves nothing";
  EXPECT_EQ(scene_.keyframes().size(), 6u);
  EXPECT_EQ(scene_.points().size(), 21u);
  const auto first = Drawn(scene_.keyframes(), Kf(1)), second = Drawn(scene_.keyframes(), OtherKf(1));
  EXPECT_EQ(first.colour, 0u);
  EXPECT_EQ(second.colour, 1u);
  EXPECT_NEAR((Vector(first.center) - PoseAt(1).Center()).norm(), 0, 1e-6) << "it lies as it is";
  const Eigen::Vector3d offset = Vector(second.center) - PoseAt(1).Center();
  EXPECT_GT(offset.x(), 3) << "no keyframe of one lies among those of the other";
  EXPECT_NEAR(offset.tail<2>().norm(), 0, 1e-6);
  const auto point = Drawn(scene_.points(), kOtherLandmark);
  EXPECT_EQ(point.colour, 1u);
  EXPECT_NEAR((Vector(point.position) - Eigen::Vector3d(1, 2, 3) - offset).norm(), 0, 1e-5);
  EXPECT_NEAR((PathAt(12, 1) - PathAt(11) - offset).norm(), 0, 1e-5);
  EXPECT_EQ(Drawn(scene_.path(), SceneFrame{1, 12}).colour, 1u);
  const auto drawn = core_.Drawn(PoseAt(1).Inverse(), kOtherMap);
  ASSERT_TRUE(drawn);
  EXPECT_NEAR((drawn->translation - Vector(second.center)).norm(), 0, 1e-5) << "so does the camera";
  EXPECT_FALSE(core_.Drawn({}, MapId{77})) << "nobody knows where that map lies";
}

TEST_F(ViewerCoreTest, WhatIsBelievedToMoveIsSoHoweverLittle) {
  AddKeyframe(0);
  AddLandmark(1, 0, 1, kBelievedToMove + 0.01F);
  AddLandmark(2, 0, 2, kBelievedToMove);
  AddLandmark(3, 0, 3, kBelievedToMove - 0.01F);
  Say();
  EXPECT_EQ(core_.num_moving(), 1u);
  EXPECT_GT(Drawn(scene_.points(), LandmarkId::Make(1, 1)).belief, 0);
  EXPECT_LE(Drawn(scene_.points(), LandmarkId::Make(1, 2)).belief, 0);
  EXPECT_LE(Drawn(scene_.points(), LandmarkId::Make(1, 3)).belief, 0);
}

TEST_F(ViewerCoreTest, WithoutAMapNoneIsShown) { EXPECT_FALSE(core_.shown_map().has_value()); }

TEST_F(ViewerCoreTest, MapsThatAreJoinedBecomeOnePlaceAndOneColour) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  AddOtherMap();
  SayFrame(11, 1);
  SayFrameOf(1, 11, kOtherMap, OtherKf(1));
  Say();
  EXPECT_TRUE(core_.TakeJoined().empty());
  const uint32_t generation = scene_.generation();
  const Rigid3d T_first_other(ExpSo3({0, 0.5, 0}), {0.3, 0.2, 0.1});
  for (int i = 0; i < 3; ++i) {
    const Keyframe& keyframe = map_.At(OtherKf(i));
    map_.SetPose(keyframe, keyframe.T_cam_world * T_first_other.Inverse());
    map_.SetMapId(keyframe, kMapId);
  }
  map_.SetMapId(map_.At(kOtherLandmark), kMapId);
  map_.SetPosition(map_.At(kOtherLandmark), T_first_other * Eigen::Vector3d(1, 2, 3));
  Say(MapEvent::kCorrected);
  const std::vector<JoinedMaps> joined = core_.TakeJoined();
  ASSERT_EQ(joined.size(), 1u);
  EXPECT_EQ(joined[0].from, kOtherMap);
  EXPECT_EQ(joined[0].into, kMapId);
  EXPECT_EQ(core_.layout().places().size(), 1u);
  EXPECT_EQ(scene_.generation(), generation) << "nothing has to be fetched anew";
  const auto moved = Drawn(scene_.keyframes(), OtherKf(1));
  EXPECT_EQ(moved.colour, 0u);
  EXPECT_NEAR((Vector(moved.center) - T_first_other * PoseAt(1).Center()).norm(), 0, 1e-5);
  const auto point = Drawn(scene_.points(), kOtherLandmark);
  EXPECT_EQ(point.colour, 0u);
  EXPECT_NEAR((Vector(point.position) - T_first_other * Eigen::Vector3d(1, 2, 3)).norm(), 0, 1e-5);
  EXPECT_NEAR((PathAt(11, 1) - T_first_other * PoseAt(1).Center()).norm(), 0, 1e-5) << "its frames follow";
  EXPECT_EQ(Drawn(scene_.path(), SceneFrame{1, 11}).colour, 0u);
}

TEST_F(ViewerCoreTest, CamerasMoveWithTheirMapWhenItIsJoined) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  AddOtherMap();
  SayFrame(11, 1);
  SayFrameOf(1, 11, kOtherMap, OtherKf(1));
  Say();
  const Eigen::Vector3d offset = CameraAt(1) - PoseAt(1).Center();
  EXPECT_GT(offset.x(), 3) << "beside it, in its own map";
  EXPECT_NEAR((CameraAt(0) - PoseAt(1).Center()).norm(), 0, 1e-5);
  const uint32_t apart = scene_.arrangement();
  Say();
  EXPECT_EQ(scene_.arrangement(), apart) << "nothing has moved";
  // The first one's map is joined to the other one's, so it is its keyframes that move.
  const Rigid3d T_other_first(ExpSo3({0, 0.5, 0}), {0.3, 0.2, 0.1});
  for (int i = 0; i < 3; ++i) {
    const Keyframe& keyframe = map_.At(Kf(i));
    map_.SetPose(keyframe, keyframe.T_cam_world * T_other_first.Inverse());
    map_.SetMapId(keyframe, kOtherMap);
  }
  core_.OnMapDelta(map_.TakeDelta(MapEvent::kCorrected, Kf(2), kOtherMap));
  EXPECT_TRUE(core_.moves()) << "no place fits what is drawn until it is drawn anew";
  core_.Draw(&scene_);
  EXPECT_FALSE(core_.moves());
  EXPECT_NE(scene_.arrangement(), apart);
  EXPECT_EQ(core_.shown_map(), kOtherMap);
  EXPECT_NEAR((CameraAt(0) - T_other_first * PoseAt(1).Center()).norm(), 0, 1e-5)
      << "its frontend has not said anything yet";
  EXPECT_NEAR((CameraAt(1) - PoseAt(1).Center()).norm(), 0, 1e-5);
  const auto now = core_.WhereIs(0);
  ASSERT_TRUE(now);
  EXPECT_NEAR((now->T_world_cam.translation - CameraAt(0)).norm(), 0, 1e-5);
  SayFrameOf(0, 12, kMapId, Kf(1));
  EXPECT_NEAR((core_.WhereIs(0)->T_world_cam.translation - CameraAt(0)).norm(), 0, 1e-5)
      << "nor does it matter which map it takes it for";
}

TEST_F(ViewerCoreTest, ACorrectionMovesCamerasWithTheMap) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  SayFrame(11, 1);
  Say();
  const uint32_t before = scene_.arrangement();
  const Eigen::Vector3d shift(0.5, 0, 0);
  const Keyframe& keyframe = map_.At(Kf(1));
  map_.SetPose(keyframe, keyframe.T_cam_world * Rigid3d(Eigen::Quaterniond::Identity(), -shift));
  Say(MapEvent::kCorrected);
  EXPECT_NE(scene_.arrangement(), before);
  EXPECT_NEAR((CameraAt(0) - PoseAt(1).Center() - shift).norm(), 0, 1e-5);
}

TEST_F(ViewerCoreTest, ALostCameraIsNowhereAndWhatIsToldLaterDoesNotBringItBack) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  SayFrame(11, 1);
  Say();
  EXPECT_TRUE(core_.WhereIs(0));
  FramePose frame;
  frame.frame_index = 12;
  frame.state = TrackingState::kWaitingForMap;
  core_.OnFramePose(frame);
  EXPECT_TRUE(core_.WhereIs(0)) << "that says nothing of where it is";
  frame.frame_index = 13;
  frame.state = TrackingState::kLost;
  core_.OnFramePose(frame);
  EXPECT_FALSE(core_.WhereIs(0));
  frame.state = TrackingState::kLocalizedLater;
  frame.reference = Kf(1);
  core_.OnFramePose(frame);
  SayFrame(11, 2);
  EXPECT_FALSE(core_.WhereIs(0));
  core_.Draw(&scene_);
  EXPECT_TRUE(scene_.cameras().empty());
  SayFrame(14, 2);
  core_.Draw(&scene_);
  EXPECT_NEAR((CameraAt(0) - PoseAt(2).Center()).norm(), 0, 1e-5);
}

TEST_F(ViewerCoreTest, TheMapThatWasShownStaysWhereItIsWhileACameraIsInIt) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  AddOtherMap();
  SayFrame(11, 1);
  SayFrameOf(1, 11, kOtherMap, OtherKf(1));
  Say();
  SayFrameOf(1, 12, kMapId, Kf(2));
  SayFrameOf(0, 12, kOtherMap, OtherKf(2));
  EXPECT_EQ(core_.shown_map(), kMapId);
  SayFrameOf(1, 13, kOtherMap, OtherKf(2));
  EXPECT_EQ(core_.shown_map(), kOtherMap) << "both have left it";
  core_.Draw(&scene_);
  EXPECT_NEAR((PathAt(13, 1) - PoseAt(2).Center()).norm(), 0, 1e-6);
  EXPECT_GT((PathAt(11) - PoseAt(1).Center()).x(), 3) << "now the first one lies beside it";
  EXPECT_EQ(Drawn(scene_.keyframes(), OtherKf(2)).colour, 1u) << "colours stay";
}

TEST_F(ViewerCoreTest, TheSameFrameOfTwoCamerasIsTwoFrames) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  SayFrameOf(0, 15, kMapId, Kf(1));
  SayFrameOf(1, 15, kMapId, Kf(2));
  Say();
  EXPECT_EQ(scene_.path().size(), 2u);
  EXPECT_NEAR((PathAt(15, 0) - PoseAt(1).Center()).norm(), 0, 1e-6);
  EXPECT_NEAR((PathAt(15, 1) - PoseAt(2).Center()).norm(), 0, 1e-6);
}

TEST_F(ViewerCoreTest, TruthOfACameraInAnotherMapIsNotDrawnUntilItIsInTheShownOne) {
  for (int i = 0; i < 3; ++i) AddKeyframe(i);
  AddOtherMap();
  SayFrame(11, 1);
  SayFrameOf(1, 11, kOtherMap, OtherKf(1));
  core_.OnTruth({0, 11}, {});
  core_.OnTruth({1, 11}, {});
  Say();
  EXPECT_EQ(scene_.truth().size(), 1u);
  SayFrameOf(1, 12, kMapId, Kf(1));
  core_.Draw(&scene_);
  EXPECT_EQ(scene_.truth().size(), 2u);
}

TEST_F(ViewerCoreTest, UpIsWhereTheCamerasHeadsAre) {
  for (int i = 0; i < 5; ++i) AddKeyframe(i);
  Say();
  EXPECT_GT(core_.Up(std::nullopt).dot(Eigen::Vector3d(0, -1, 0)), 0.999);
}

}  // namespace
}  // namespace dmslam
