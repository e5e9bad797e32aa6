#include "dmslam/mapping/mapper_core.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/replica.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return KeyframeId::Make(1, frame); }

/// A map of three keyframes in a row, each hanging from the one before.
MapEditor SmallMap() {
  MapEditor map(TestCamera(), Pyramid());
  for (uint32_t frame = 1; frame <= 3; ++frame) {
    Keyframe keyframe;
    keyframe.id = Id(frame);
    keyframe.map_id = 1;
    keyframe.T_cam_world = Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(frame, 0, 0));
    if (frame > 1) keyframe.parent = Id(frame - 1);
    keyframe.features = MakeFrameFeatures({}, map.camera(), map.pyramid());
    map.AddKeyframe(std::move(keyframe));
  }
  map.TakeDelta(MapEvent::kMapStarted, Id(3), 1);
  return map;
}

/// Carries what hangs on keyframes 1 and 2 one unit up.
LoopAnswer OneUp(uint64_t base_version, uint64_t correction_id = 7) {
  LoopAnswer answer;
  answer.keyframe = Id(2);
  answer.base_version = base_version;
  answer.correction_id = correction_id;
  answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
  const Sim3d up(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 1, 0), 1.0);
  answer.corrections = {{Id(1), up}, {Id(2), up}};
  return answer;
}

class Corrections : public testing::Test {
 protected:
  Corrections() : core_(MakeCore()) { core_.Continue(SmallMap()); }

  MapperCore MakeCore() {
    return MapperCore(MapperOptions(), TestCamera(), Pyramid(), 1,
                      [this](const MapDelta& delta) { said_.push_back(delta); });
  }
  static double HeightOf(const MapperCore& core, uint32_t frame) {
    return core.map().FindKeyframe(Id(frame))->T_cam_world.Center().y();
  }
  double HeightOf(uint32_t frame) const { return HeightOf(core_, frame); }

  std::vector<MapDelta> said_;
  MapperCore core_;
};

TEST_F(Corrections, OneOfAnOlderVersionIsComposedWithThePosesOfNow) {
  const uint64_t base = core_.map().version();
  for (int i = 0; i < 5; ++i) core_.Settle(Id(3), 1);
  core_.OnLoopAnswer(OneUp(base));
  EXPECT_EQ(core_.counters().corrections_applied, 1u);
  for (const uint32_t frame : {1u, 2u, 3u}) EXPECT_NEAR(HeightOf(frame), 1.0, 1e-12) << frame;
  EXPECT_EQ(said_.back().event, MapEvent::kGloballyAdjusted);
  EXPECT_EQ(said_.back().correction_id, 7u);
  EXPECT_EQ(said_.back().progress.corrected, said_.back().version);
}

TEST_F(Corrections, OneFromBeforeAnotherIsRefused) {
  const uint64_t base = core_.map().version();
  core_.OnLoopAnswer(OneUp(base));
  core_.OnLoopAnswer(OneUp(base, 8));  // of a loop closer that had not heard of the first one
  EXPECT_EQ(core_.counters().corrections_applied, 1u);
  EXPECT_EQ(core_.counters().corrections_refused, 1u);
  EXPECT_NEAR(HeightOf(2), 1.0, 1e-12);
  EXPECT_EQ(said_.back().event, MapEvent::kRefused);
  EXPECT_EQ(said_.back().correction_id, 8u);
  EXPECT_NE(said_.back().note.find("before the correction"), std::string::npos) << said_.back().note;
  core_.OnLoopAnswer(OneUp(core_.map().version(), 9));
  EXPECT_NEAR(HeightOf(2), 2.0, 1e-12);
}

TEST_F(Corrections, AMapperThatContinuesAReplicaRefusesThemToo) {
  const uint64_t base = core_.map().version();
  core_.OnLoopAnswer(OneUp(base));
  Replica replica(TestCamera(), Pyramid());
  for (const MapDelta& part : CutSnapshot(core_.map(), Id(1), 60000)) replica.Apply(part);
  MapperCore next = MakeCore();
  next.Continue(std::move(replica));
  next.OnLoopAnswer(OneUp(base, 8));
  EXPECT_EQ(next.counters().corrections_refused, 1u);
  EXPECT_NEAR(HeightOf(next, 2), 1.0, 1e-12);
}

TEST_F(Corrections, OneOfAVersionThatIsNotOursIsRefused) {
  core_.OnLoopAnswer(OneUp(core_.map().version() + 1));
  EXPECT_EQ(core_.counters().corrections_refused, 1u);
  EXPECT_NEAR(HeightOf(2), 0.0, 1e-12);
}

TEST_F(Corrections, OneWhoseKeyframesAreGoneIsRefused) {
  const uint64_t base = core_.map().version();
  MapReset reset;
  reset.map_id = 1;
  reset.drop = true;
  core_.OnReset(reset);
  core_.OnLoopAnswer(OneUp(base));
  EXPECT_EQ(core_.counters().corrections_refused, 1u);
  EXPECT_EQ(said_.back().note, "its keyframes are gone");
}

/// Two keyframes that see the wall of a third one again. They share landmarks of their own on its first half;
/// of its second half they have none.
class SecondVisit : public Corrections {
 protected:
  static constexpr uint16_t kHalf = 20;

  SecondVisit() {
    MapEditor map(TestCamera(), Pyramid());
    for (const uint32_t frame : {1u, 2u, 3u}) AddKeyframe(frame, 0.05 * frame, map);
    for (const uint16_t feature : Features(0, 2 * kHalf)) AddLandmark(100u + feature, {1}, feature, map);
    for (const uint16_t feature : Features(0, kHalf)) AddLandmark(200u + feature, {2, 3}, feature, map);
    map.TakeDelta(MapEvent::kMapStarted, Id(3), 1);
    core_.Continue(std::move(map));
  }

  static std::vector<uint16_t> Features(uint16_t from, uint16_t to) {
    std::vector<uint16_t> features;
    for (uint16_t i = from; i < to; ++i) features.push_back(i);
    return features;
  }
  static Eigen::Vector3d Point(uint16_t i) { return {0.3 * (i % 8) - 1.0, 0.3 * (i / 8) - 0.6, 4.0}; }
  static Descriptor DescriptorOf(uint16_t i) {
    Random random(DeriveSeed(1, i, "descriptor"));
    return {{random.Next(), random.Next(), random.Next(), random.Next()}};
  }
  static void AddKeyframe(uint32_t frame, double x, MapEditor& map) {
    Keyframe keyframe;
    keyframe.id = Id(frame);
    keyframe.map_id = 1;
    keyframe.T_cam_world = Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0));
    if (frame > 1) keyframe.parent = Id(frame - 1);
    FeatureSet features;
    for (uint16_t i = 0; i < 2 * kHalf; ++i) {
      const Eigen::Vector2d uv = *map.camera().Project(keyframe.T_cam_world * Point(i));
      features.keypoints.push_back({static_cast<uint16_t>(std::lround(uv.x() * 16)),
                                    static_cast<uint16_t>(std::lround(uv.y() * 16)), 1, 0});
      features.descriptors.push_back(DescriptorOf(i));
    }
    keyframe.features = MakeFrameFeatures(std::move(features), map.camera(), map.pyramid());
    map.AddKeyframe(std::move(keyframe));
  }
  static void AddLandmark(uint64_t number, const std::vector<uint32_t>& frames, uint16_t feature,
                          MapEditor& map) {
    Landmark landmark;
    landmark.id = LandmarkId::Make(1, number);
    landmark.map_id = 1;
    landmark.p_world = Point(feature);
    landmark.reference = landmark.first_keyframe = Id(frames.front());
    const LandmarkId id = landmark.id;
    map.AddLandmark(std::move(landmark));
    for (const uint32_t frame : frames) map.SetObservation(Id(frame), feature, id);
    map.UpdateDescriptor(id);
  }
};

TEST_F(SecondVisit, TiesEveryKeyframeOfItsSideToThePlace) {
  LoopAnswer answer;
  answer.keyframe = Id(3);
  answer.matched = Id(1);
  answer.base_version = core_.map().version();
  answer.correction_id = 7;
  answer.kind = LoopAnswer::Kind::kLoop;
  // The graph has moved the neighbour out of its place: what it sees is looked for beside the loop's
  // keyframe.
  const Sim3d aside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.2, 0, 0), 1.0);
  answer.corrections = {{Id(1), Sim3d()}, {Id(2), aside}, {Id(3), Sim3d()}};
  core_.OnLoopAnswer(answer);
  const Keyframe& neighbour = *core_.map().FindKeyframe(Id(2));
  for (const uint16_t feature : Features(kHalf, 2 * kHalf)) {
    EXPECT_EQ(neighbour.landmarks[feature], LandmarkId::Make(1, 100u + feature)) << feature;
  }
}

}  // namespace
}  // namespace dmslam
