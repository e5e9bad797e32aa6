#include "collector/heard_frames.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

constexpr uint32_t kSession = 1;  ///< the scene's

FramePose PoseOf(uint32_t frame, TrackingState state = TrackingState::kTracking) {
  FramePose pose;
  pose.frame_index = frame;
  pose.stamp_ns = frame * 10;
  pose.state = state;
  return pose;
}

TEST(HeardFramesTest, EachFrameCountsOnce) {
  HeardFrames frames(1);
  EXPECT_EQ(frames.newest_stamp_ns(), std::nullopt);
  for (const uint32_t frame : {3, 4, 4, 6}) frames.Hear(PoseOf(frame));
  frames.Hear(PoseOf(2, TrackingState::kLocalizedLater));
  frames.Hear(PoseOf(9, TrackingState::kLocalizedLater));
  EXPECT_EQ(frames.count(), 3);
  EXPECT_EQ(frames.newest_stamp_ns(), 60);
}

TEST(HeardFramesTest, EachCameraHasFramesOfItsOwn) {
  HeardFrames frames(2);
  frames.Hear(PoseOf(4));
  FramePose other = PoseOf(2);
  other.camera_id = 1;
  frames.Hear(other);
  EXPECT_EQ(frames.count(), 2);
}

TEST(HeardFramesTest, AMapIsNewerThatHasAKeyframeBehindWhatWasHeard) {
  const WallScene scene(4, 3);
  MapEditor map(TestCamera(), Pyramid());
  HeardFrames frames(1);
  EXPECT_TRUE(frames.ReachAsFarAs(map, kSession));
  scene.AddKeyframe(map, 3, 0);
  EXPECT_FALSE(frames.ReachAsFarAs(map, kSession)) << "nothing was heard";
  EXPECT_TRUE(frames.ReachAsFarAs(map, kSession + 1)) << "it is a saved map's";
  frames.Hear(PoseOf(2));
  EXPECT_FALSE(frames.ReachAsFarAs(map, kSession));
  frames.Hear(PoseOf(3));
  EXPECT_TRUE(frames.ReachAsFarAs(map, kSession));
}

}  // namespace
}  // namespace dmslam
