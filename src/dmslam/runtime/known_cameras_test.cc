#include "dmslam/runtime/known_cameras.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

CameraInfo RoomCamera(CameraId camera = 0) {
  CameraInfo info;
  info.session = 4;
  info.camera_id = camera;
  info.camera = TestCamera();
  info.sequence = "room";
  return info;
}

TEST(KnownCameras, OneThatHasFallenSilentIsSaidByOthersFromThenOn) {
  KnownCameras cameras(100 * kMs);
  cameras.Believe(RoomCamera(), true, 0);
  EXPECT_TRUE(cameras.TakeSilent(1'599 * kMs).empty());
  ASSERT_EQ(cameras.TakeSilent(1'600 * kMs).size(), 1u);
  EXPECT_TRUE(cameras.TakeSilent(3'099 * kMs).empty());
  EXPECT_EQ(cameras.TakeSilent(3'100 * kMs).size(), 1u);
}

TEST(KnownCameras, WhoHearsItSaidByAnotherWaits) {
  KnownCameras cameras(0);
  cameras.Believe(RoomCamera(), true, 0);
  cameras.Heard(RoomCamera(), 1'000 * kMs);
  EXPECT_TRUE(cameras.TakeSilent(2'499 * kMs).empty());
  EXPECT_EQ(cameras.TakeSilent(2'500 * kMs).size(), 1u);
}

TEST(KnownCameras, WhoMeansAnotherOneIsContradictedTenTimesASecond) {
  KnownCameras cameras(0);
  cameras.Believe(RoomCamera(), true, 0);
  CameraInfo other = RoomCamera();
  other.camera.fx_px = 400;
  CameraInfo elsewhere = RoomCamera();
  elsewhere.sequence = "hall";
  cameras.Heard(other, 1'000 * kMs);
  ASSERT_EQ(cameras.TakeSilent(1'000 * kMs).size(), 1u);
  cameras.Heard(elsewhere, 1'050 * kMs);
  EXPECT_TRUE(cameras.TakeSilent(1'099 * kMs).empty());
  EXPECT_EQ(cameras.TakeSilent(1'100 * kMs).size(), 1u);
}

TEST(KnownCameras, ThatOfARecordedSessionIsNotRepeated) {
  KnownCameras cameras(0);
  cameras.Believe(RoomCamera(0), false, 0);
  cameras.Believe(RoomCamera(1), true, 0);
  const std::vector<CameraInfo> silent = cameras.TakeSilent(5'000 * kMs);
  ASSERT_EQ(silent.size(), 1u);
  EXPECT_EQ(silent.front().camera_id, 1);
}

TEST(KnownCameras, AFrameConfirmsNothingOfACameraThatIsKnown) {
  KnownCameras cameras(0);
  cameras.SaidAgain(RoomCamera(), 0);
  ASSERT_TRUE(cameras.ClaimOfFrame(0, 4));
  cameras.Believe(RoomCamera(), true, 0);
  cameras.SaidAgain(RoomCamera(), 0);
  EXPECT_FALSE(cameras.ClaimOfFrame(0, 4));
}

}  // namespace
}  // namespace dmslam
