#include "collector/corrections.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

class CorrectionsTest : public testing::Test {
 protected:
  CorrectionsTest() {
    for (const uint32_t frame : {0, 1, 2, 3}) scene_.AddKeyframe(map_, frame, frame);
    AddLoop(3, 1);
  }
  void AddLoop(uint32_t from, uint32_t to) {
    map_.AddLoopEdge(map_.At(WallScene::Id(from)), map_.At(WallScene::Id(to)));
  }
  static MapDelta Correction(MapEvent event) {
    MapDelta delta;
    delta.event = event;
    delta.about = WallScene::Id(3);
    delta.correction_id = 5;
    delta.note = "why";
    return delta;
  }

  WallScene scene_{4, 3};
  MapEditor map_{TestCamera(), Pyramid()};
};

TEST_F(CorrectionsTest, ALoopsOtherEndIsWhereThereWasNoEdgeBefore) {
  const auto before = LoopsOf(map_, WallScene::Id(3));
  EXPECT_EQ(before, std::vector<KeyframeId>{WallScene::Id(1)});
  AddLoop(3, 0);
  const CorrectionRecord record = RecordOf(Correction(MapEvent::kCorrected), before, map_);
  EXPECT_EQ(record.keyframe, WallScene::Id(3));
  EXPECT_EQ(record.note, "why");
  EXPECT_EQ(record.matched, WallScene::Id(0));
  EXPECT_NEAR(record.T_matched_keyframe.translation.x(), 3, 1e-12) << "where the keyframe is, seen from it";
}

TEST_F(CorrectionsTest, OneThatWasRefusedOrClosedNoLoopHasNoOtherEnd) {
  const auto before = LoopsOf(map_, WallScene::Id(3));
  EXPECT_FALSE(RecordOf(Correction(MapEvent::kCorrected), before, map_).matched);
  AddLoop(3, 0);
  const CorrectionRecord record = RecordOf(Correction(MapEvent::kCorrectionRefused), before, map_);
  EXPECT_EQ(record.event, MapEvent::kCorrectionRefused);
  EXPECT_FALSE(record.matched);
}

TEST_F(CorrectionsTest, AKeyframeThatIsNotInTheMapHasNoLoops) {
  EXPECT_TRUE(LoopsOf(map_, WallScene::Id(9)).empty());
  EXPECT_TRUE(LoopsOf(map_, std::nullopt).empty());
}

}  // namespace
}  // namespace dmslam
