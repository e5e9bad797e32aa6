#include "dmslam/slam/own_maps.h"

#include <gtest/gtest.h>

#include <iterator>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"

namespace dmslam {
namespace {

class OwnMapsTest : public testing::Test {
 protected:
  void AddKeyframe(MapId map_id, uint32_t frame) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, frame);
    keyframe.map_id = map_id;
    keyframe.features = MakeFrameFeatures({}, TestCamera(), Pyramid());
    map_.AddKeyframe(keyframe);
  }
  MapEditor map_{TestCamera(), Pyramid()};
};

TEST_F(OwnMapsTest, EachCameraHasARangeOfItsOwn) {
  OwnMaps first(0), second(1);
  EXPECT_EQ(first.First(), 1u);
  EXPECT_EQ(second.First(), kMapsPerCamera + 1);
  EXPECT_EQ(first.Next(map_), 2u);
  EXPECT_EQ(second.Next(map_), kMapsPerCamera + 2);
}

TEST_F(OwnMapsTest, NoNumberIsGivenTwice) {
  OwnMaps maps(0);
  AddKeyframe(5, 1);                   // of a saved map
  AddKeyframe(kMapsPerCamera + 7, 2);  // another camera's
  EXPECT_EQ(maps.Next(map_), 6u);
  maps.Take(9);  // was tracked in, and is joined with another
  EXPECT_EQ(maps.Next(map_), 10u);
}

TEST_F(OwnMapsTest, AMapThatWasDroppedIsThereUntilTheMapperHasHeardOfIt) {
  OwnMaps maps(0);
  EXPECT_FALSE(maps.HasDropped(map_));
  AddKeyframe(1, 1);
  EXPECT_FALSE(maps.HasDropped(map_));
  maps.Drop(1);
  EXPECT_TRUE(maps.HasDropped(map_));
  map_.DropMap(1);
  EXPECT_FALSE(maps.HasDropped(map_));
}

TEST_F(OwnMapsTest, AMapThatWasJoinedBeforeTheMapperHeardOfItStays) {
  OwnMaps maps(0);
  for (const uint32_t frame : {1U, 2U}) AddKeyframe(1, frame);
  maps.Drop(1);
  ASSERT_TRUE(maps.HasDropped(map_));
  const auto first = map_.keyframes().begin();
  map_.AddLoopEdge(first->second, std::next(first)->second);
  EXPECT_FALSE(maps.HasDropped(map_));
}

}  // namespace
}  // namespace dmslam
