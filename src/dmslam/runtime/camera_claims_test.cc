#include "dmslam/runtime/camera_claims.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

CameraInfo Info(const std::string& sequence, int64_t utime = 0) {
  CameraInfo info;
  info.utime = utime;
  info.session = 4;
  info.camera = TestCamera();
  info.sequence = sequence;
  return info;
}

TEST(CameraClaims, WhatIsSaidTwiceIsBelieved) {
  CameraClaims claims;
  EXPECT_FALSE(claims.SaidAgain(Info("room", 1), 0));
  EXPECT_TRUE(claims.SaidAgain(Info("room", 2), 100 * kMs));
}

TEST(CameraClaims, OneThatIsForgedIsNot) {
  CameraClaims claims;
  EXPECT_FALSE(claims.SaidAgain(Info("forged"), 0));
  EXPECT_FALSE(claims.SaidAgain(Info("forged"), 1 * kMs)) << "a copy on its way through the network";
  EXPECT_FALSE(claims.SaidAgain(Info("room", 1), 400 * kMs));
  EXPECT_TRUE(claims.SaidAgain(Info("room", 2), 500 * kMs));
}

TEST(CameraClaims, ManyThatDifferDoNotCrowdOutTheTrueOne) {
  CameraClaims claims;
  claims.SaidAgain(Info("room"), 0);
  for (int i = 0; i < 7; ++i) EXPECT_FALSE(claims.SaidAgain(Info("forged " + std::to_string(i)), i * kMs));
  EXPECT_TRUE(claims.SaidAgain(Info("room"), 100 * kMs));
}

TEST(CameraClaims, AFrameConfirmsWhatWasSaidWhereItIsOneThing) {
  CameraClaims claims;
  EXPECT_FALSE(claims.OfFrame(0, 4));
  claims.SaidAgain(Info("room"), 0);
  EXPECT_FALSE(claims.OfFrame(0, 5)) << "of another session";
  EXPECT_EQ(claims.OfFrame(0, 4)->sequence, "room");
  claims.SaidAgain(Info("forged"), 0);
  EXPECT_FALSE(claims.OfFrame(0, 4)) << "which of the two?";
}

}  // namespace
}  // namespace dmslam
