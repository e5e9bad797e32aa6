#include "mapper/mapper_core.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return KeyframeId::Make(1, frame); }

/// A map of three keyframes in a row, each hanging from the one before.
Map SmallMap() {
  Map map(TestCamera(), Pyramid());
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
  Map replica(TestCamera(), Pyramid());
  for (const MapDelta& part : core_.map().Snapshot(Id(1), 60000)) replica.Apply(part);
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

}  // namespace
}  // namespace dmslam
