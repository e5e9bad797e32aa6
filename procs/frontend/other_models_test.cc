#include "frontend/other_models.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"

namespace dmslam {
namespace {

class OtherModelsTest : public testing::Test {
 protected:
  void Hear(CameraId camera, bool same_model = false) {
    CameraInfo info;
    info.camera_id = camera;
    info.camera = TestCamera();
    if (!same_model) info.camera.fx_px *= 1.1;
    models_.Hear(info, TestCamera());
  }
  void Map(CameraId camera) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, 0, camera);
    keyframe.features = std::make_shared<const FrameFeatures>();
    map_.AddKeyframe(keyframe);
  }

  OtherModels models_;
  MapEditor map_{TestCamera(), Pyramid()};
};

TEST_F(OtherModelsTest, OfTwoThatBeginTheHigherNumberGivesWay) {
  EXPECT_EQ(models_.GivesWayTo(map_, 1), std::nullopt);
  Hear(0);
  Hear(2);
  EXPECT_EQ(models_.GivesWayTo(map_, 1), 0);
}

TEST_F(OtherModelsTest, WhoIsMappedDoesNotGiveWayToOneWhoComesLater) {
  Map(1);
  Hear(0);
  EXPECT_EQ(models_.GivesWayTo(map_, 1), std::nullopt);
}

TEST_F(OtherModelsTest, WhoComesLaterGivesWayThoughItsNumberIsLower) {
  Map(2);
  Hear(2);
  EXPECT_EQ(models_.GivesWayTo(map_, 0), 2);
  Map(0);
  EXPECT_EQ(models_.GivesWayTo(map_, 0), std::nullopt) << "both are mapped: by number";
}

TEST_F(OtherModelsTest, ACameraOfTheSameModelAsksNobodyToLeave) {
  Hear(0);
  Hear(0, true);
  EXPECT_EQ(models_.GivesWayTo(map_, 1), std::nullopt);
}

}  // namespace
}  // namespace dmslam
