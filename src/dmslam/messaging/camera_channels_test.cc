#include "dmslam/messaging/camera_channels.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

TEST(CameraChannels, TheFirstCamerasNamesStay) {
  EXPECT_EQ(ChannelOfCamera("DMSLAM_FRONTEND_KEYFRAME", 0), "DMSLAM_FRONTEND_KEYFRAME");
  EXPECT_EQ(OfCamera("frontend", 0), "frontend");
  EXPECT_EQ(StreamOfCamera(StreamId::kFrontend, 0), StreamId::kFrontend);
  const CameraChannel split = SplitCamera("DMSLAM_FRONTEND_KEYFRAME");
  EXPECT_EQ(split.channel, "DMSLAM_FRONTEND_KEYFRAME");
  EXPECT_EQ(split.camera, 0U);
}

TEST(CameraChannels, OthersHaveTheirNumberBehindTheProcess) {
  for (const CameraId camera : {1U, 9U, 15U}) {
    for (const char* channel : {"DMSLAM_FRONTEND_KEYFRAME", "DMSLAM_PLAYER_FRAME", "DMSLAM_FRONTEND_HEAD"}) {
      const std::string of_camera = ChannelOfCamera(channel, camera);
      EXPECT_NE(of_camera, channel);
      EXPECT_EQ(SplitCamera(of_camera).channel, channel);
      EXPECT_EQ(SplitCamera(of_camera).camera, camera);
    }
  }
  EXPECT_EQ(ChannelOfCamera("DMSLAM_FRONTEND_KEYFRAME", 1), "DMSLAM_FRONTEND1_KEYFRAME");
  EXPECT_EQ(OfCamera("FRONTEND", 12), "FRONTEND12");
  EXPECT_EQ(OwnerName("frontend12"), "FRONTEND12");
  EXPECT_NE(StreamOfCamera(StreamId::kFrontend, 1), StreamOfCamera(StreamId::kPlayer, 1));
  EXPECT_NE(StreamOfCamera(StreamId::kFrontend, 1), StreamOfCamera(StreamId::kFrontend, 2));
}

TEST(CameraChannels, TheMapIsOfNoCamera) {
  EXPECT_EQ(ChannelOfCamera("DMSLAM_MAPPER_MAP", 1), "DMSLAM_MAPPER_MAP");
  EXPECT_EQ(SplitCamera("DMSLAM_MAPPER1_MAP").channel, "DMSLAM_MAPPER1_MAP");
  EXPECT_EQ(StreamOfCamera(StreamId::kMap, 3), StreamId::kMap);
}

}  // namespace
}  // namespace dmslam
