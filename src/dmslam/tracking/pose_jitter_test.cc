#include "dmslam/tracking/pose_jitter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr double kFrameS = 1.0 / 30, kDepth = 2.0;
constexpr int64_t kFrameNs = 33'333'333;

Eigen::Vector3d Normal3(Random& random) {
  const double x = random.Gaussian(), y = random.Gaussian(), z = random.Gaussian();
  return {x, y, z};
}

/// A camera in a hand, at frame `frame`.
Rigid3d TrueWorldCam(int frame) {
  const double t = frame * kFrameS;
  return {ExpSo3({0.1 * std::sin(t), 0.2 * std::cos(1.2 * t), 0}),
          {0.3 * std::sin(t), 0.2 * std::cos(1.5 * t), 0.2 * std::sin(0.8 * t)}};
}

void Tell(int frame, const Rigid3d& T_world_cam, PoseJitter* jitter, MapId map = 1) {
  jitter->OnPose(frame * kFrameNs, map, T_world_cam.Inverse(), kDepth);
}

TEST(PoseJitterTest, ACameraThatMovesItselfHasNone) {
  PoseJitter jitter;
  for (int frame = 0; frame < 90; ++frame) {
    Tell(frame, TrueWorldCam(frame), &jitter);
    EXPECT_EQ(jitter.Covariance(kDepth), Matrix6d::Zero()) << frame;
  }
}

TEST(PoseJitterTest, IsNoSmallerThanErrorsThatLast) {
  // Errors of a twentieth of the depth, of a memory of a quarter of a second: a pose that follows other
  // things.
  constexpr double kSigma = 0.05, kKept = 0.87;
  PoseJitter jitter;
  Random random(3);
  Eigen::Vector3d shift = Eigen::Vector3d::Zero(), turn = shift;
  double position = 0, rotation = 0;
  constexpr int kFrames = 900;
  for (int frame = 0; frame < kFrames; ++frame) {
    const double fresh = kSigma * std::sqrt(1 - kKept * kKept);
    shift = kKept * shift + fresh * kDepth * Normal3(random);
    turn = kKept * turn + fresh * Normal3(random);
    const Rigid3d truth = TrueWorldCam(frame);
    Tell(frame, Rigid3d(ExpSo3(turn) * truth.rotation, truth.translation + shift), &jitter);
    if (frame < 30) continue;
    const Matrix6d covariance = jitter.Covariance(kDepth);
    position += shift.squaredNorm() / covariance(3, 3) / 3 / (kFrames - 30);
    rotation += turn.squaredNorm() / covariance(0, 0) / 3 / (kFrames - 30);
  }
  EXPECT_LT(position, 1.6);
  EXPECT_GT(position, 0.3);
  EXPECT_LT(rotation, 1.6);
  EXPECT_GT(rotation, 0.3);
}

TEST(PoseJitterTest, IsForgottenAfterASecond) {
  PoseJitter jitter({.gain = 0.5});
  std::vector<double> sigmas;
  for (int frame = 0; frame < 100; ++frame) {
    Rigid3d told = TrueWorldCam(frame);
    if (frame == 20) told.translation.x() += 0.1 * kDepth;
    Tell(frame, told, &jitter);
    sigmas.push_back(std::sqrt(jitter.Covariance(kDepth)(3, 3)) / kDepth);
  }
  EXPECT_NEAR(sigmas[20], 0.05, 0.005);
  EXPECT_NEAR(sigmas[21], 0.1, 0.01) << "and back";
  EXPECT_NEAR(sigmas[81], 0.1 * std::exp(-1.0), 0.01) << "the square has fallen by e twice";
}

TEST(PoseJitterTest, OfCorrectionsAndOtherMapsThereIsNone) {
  const Rigid3d moved(ExpSo3({0, 0.2, 0}), {1, 0, 0});
  PoseJitter jitter;
  for (int frame = 0; frame < 60; ++frame) {
    if (frame == 20) jitter.OnMapMoved();
    const Rigid3d T = TrueWorldCam(frame);
    Tell(frame, frame < 20 ? T : frame < 40 ? moved * T : moved * moved * T, &jitter, frame < 40 ? 1 : 2);
    EXPECT_EQ(jitter.Covariance(kDepth), Matrix6d::Zero()) << frame;
  }
}

/// Poses that err by `sigma` (of the depth, and radians), each on its own, and what is beyond a covariance
/// that says `told` of them, as a share of the whole.
double ShareBeyond(double sigma, double told) {
  PoseJitter jitter;
  Random random(5);
  for (int frame = 0; frame < 60; ++frame) {
    const Rigid3d truth = TrueWorldCam(frame);
    Tell(frame,
         Rigid3d(ExpSo3(sigma * Normal3(random)) * truth.rotation,
                 truth.translation + sigma * kDepth * Normal3(random)),
         &jitter);
  }
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << Eigen::Vector3d::Constant(told * told),
      Eigen::Vector3d::Constant(told * told * kDepth * kDepth);
  return jitter.Beyond(covariance, kDepth).trace() / jitter.Covariance(kDepth).trace();
}

TEST(PoseJitterTest, WhatThePoseIsToldToErrByAccountsForIt) {
  EXPECT_EQ(ShareBeyond(0.02, 0.0), 1) << "nothing was told";
  EXPECT_EQ(ShareBeyond(0.02, 0.1), 0) << "more was told than poses show";
  const double most = ShareBeyond(0.05, 0.02);
  EXPECT_GT(most, 0.7) << "less was told";
  EXPECT_LT(most, 1);
}

TEST(PoseJitterTest, FramesThatAreMissing) {
  PoseJitter jitter;
  for (int frame = 0; frame < 90; frame += frame % 5 == 0 ? 2 : 1) {
    Tell(frame, TrueWorldCam(frame), &jitter);
    EXPECT_EQ(jitter.Covariance(kDepth), Matrix6d::Zero()) << frame;
  }
}

}  // namespace
}  // namespace dmslam
