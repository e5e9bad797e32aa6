#include "dmslam/map/may_drop.h"

#include <gtest/gtest.h>

#include <utility>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"

namespace dmslam {
namespace {

void AddKeyframe(uint32_t frame, CameraId camera, MapId map_id, MapEditor* map) {
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(1, frame, camera);
  keyframe.camera_id = camera;
  keyframe.map_id = map_id;
  keyframe.features = MakeFrameFeatures({}, map->camera(), map->pyramid());
  map->AddKeyframe(std::move(keyframe));
}

TEST(MayDrop, NotAMapInWhichAnotherCameraHasAKeyframe) {
  MapEditor map(TestCamera(), Pyramid());
  AddKeyframe(1, 0, 1, &map);
  AddKeyframe(2, 0, 1, &map);
  AddKeyframe(3, 2, 2, &map);
  EXPECT_TRUE(MayDrop(map, 1, 0)) << "the other camera is in another map";
  EXPECT_FALSE(MayDrop(map, 1, 2)) << "all of it is the first camera's";
  AddKeyframe(4, 2, 1, &map);
  EXPECT_FALSE(MayDrop(map, 1, 0));
  EXPECT_FALSE(MayDrop(map, 1, 2));
  EXPECT_TRUE(MayDrop(map, 2, 2));
}

TEST(MayDrop, NotAMapThatWasJoinedWithAnother) {
  MapEditor map(TestCamera(), Pyramid());
  for (const uint32_t frame : {1U, 2U, 3U}) AddKeyframe(frame, 0, 1, &map);
  ASSERT_TRUE(MayDrop(map, 1, 0));
  map.AddLoopEdge(map.At(KeyframeId::Make(1, 1, 0)), map.At(KeyframeId::Make(1, 3, 0)));
  EXPECT_FALSE(MayDrop(map, 1, 0));
}

}  // namespace
}  // namespace dmslam
