#include "dmslam/initialization/candidate_map.h"

#include <gtest/gtest.h>

#include <deque>

#include "dmslam/geometry/two_view.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

/// A room seen by a reference frame and by views of it that the test moves; some matches of each are wrong.
class CandidateBuilderTest : public ::testing::Test {
 protected:
  CandidateBuilderTest() {
    Random random(5);
    for (int k = 0; k < 300; ++k) {
      const Eigen::Vector3d ray = camera_.Ray({random.Uniform(150, 490), random.Uniform(100, 380)});
      points_.push_back(random.Uniform(2.0, 5.0) * ray);
    }
  }

  const ReferenceView& AddView(double since_reference_s, const Rigid3d& T_k_0) {
    Random random(DeriveSeed(11, views_.size(), "view"));
    ReferenceView view;
    view.since_reference_s = since_reference_s;
    for (size_t k = 0; k < points_.size(); ++k) {
      const bool wrong = random.Uniform(0, 1) < 0.1;
      Match match;
      match.index0 = match.index1 = static_cast<uint32_t>(k);
      match.uv0_px = *camera_.Project(points_[k]);
      match.uv1_px = wrong ? Eigen::Vector2d(random.Uniform(0, 639), random.Uniform(0, 479))
                           : *camera_.Project(T_k_0 * points_[k]);
      view.pair.matches.push_back(match);
    }
    return views_.emplace_back(std::move(view));
  }
  CandidateMap MapOf(const ReferenceView& last, const Rigid3d& T_last_0) const {
    return {.points = points_,
            .use = std::vector<uint8_t>(points_.size(), 1),
            .placed = {{&last, T_last_0, 1.0}}};
  }

  Camera camera_ = SyntheticCamera();
  CandidateBuilder builder_{{}, camera_, {}};
  std::vector<Eigen::Vector3d> points_;
  std::deque<ReferenceView> views_;
};

/// The hand turns far to one side and comes back: half way the camera is nowhere near the mean of both ends.
TEST_F(CandidateBuilderTest, AViewOfAnUnevenHandIsPlacedFromTheOneBeside) {
  const Rigid3d T_last(ExpSo3({0, 0.01, 0}), {-0.2, 0, 0});
  const Rigid3d T_beside(ExpSo3({0.05, -0.25, 0.45}), {0.1, 0, 0}),
      T_there(ExpSo3({0.05, -0.3, 0.5}), {0.12, 0, 0});
  CandidateMap candidate = MapOf(AddView(0.6, T_last), T_last);
  const ReferenceView& beside = AddView(0.27, T_beside);
  candidate.placed.push_back({&beside, T_beside, 1.0});
  builder_.PlaceView(AddView(0.3, T_there), &candidate);
  ASSERT_EQ(candidate.placed.size(), 3U);
  EXPECT_GT(candidate.placed.back().consistent_share, 0.85);
  EXPECT_LT(AngleBetween(candidate.placed.back().T_k_0.rotation, T_there.rotation), 0.005);
}

TEST_F(CandidateBuilderTest, AViewThatShowsOtherPlacesAgreesWithFewPoints) {
  const Rigid3d T_last(ExpSo3({0, 0.01, 0}), {-0.2, 0, 0});
  CandidateMap candidate = MapOf(AddView(0.6, T_last), T_last);
  const ReferenceView& there = AddView(0.3, T_last);
  for (Eigen::Vector3d& point : candidate.points) point.z() *= point.x() > 0 ? 1.5 : 0.7;
  builder_.PlaceView(there, &candidate);
  ASSERT_EQ(candidate.placed.size(), 2U);
  EXPECT_LT(candidate.placed.back().consistent_share, 0.5);
}

/// A wall with a picture before it, under hardly any parallax: noise puts half of the wall behind the
/// cameras. Nothing that a motion leaves there counts against it more than how far from infinity it is seen.
TEST(CandidateCost, WhatNoiseBringsBehindTheCamerasLiesAtInfinity) {
  const Camera camera = SyntheticCamera();
  const Rigid3d T_last(ExpSo3({0, 0.01, 0}), {-0.02, 0, 0});
  Random random(3);
  ReferenceView view;
  view.since_reference_s = 0.5;
  for (int k = 0; k < 400; ++k) {
    const double depth = k % 4 == 0 ? 2.0 : 60.0;
    const Eigen::Vector3d point = depth * camera.Ray({random.Uniform(150, 490), random.Uniform(100, 380)});
    Match match;
    match.index0 = match.index1 = static_cast<uint32_t>(k);
    match.uv0_px = *camera.Project(point);
    const double dx = 0.5 * random.Gaussian(), dy = 0.5 * random.Gaussian();
    match.uv1_px = *camera.Project(T_last * point) + Eigen::Vector2d(dx, dy);
    view.pair.matches.push_back(match);
  }
  const std::vector<uint8_t> all(view.pair.matches.size(), 1);
  const CandidateBuilder builder({}, camera, {});
  Refused refused;
  const TwoViewModel truth{EssentialFromPose(T_last), T_last.rotation.toRotationMatrix(), T_last.translation};
  const auto candidate = builder.Build(view, {}, all, truth, &refused);
  ASSERT_TRUE(candidate) << refused.text;
  EXPECT_LT(candidate->NumPoints(), 350)
      << "the noise puts nothing behind the cameras: the test shows nothing";
  EXPECT_LT(candidate->cost, 0.1);
}

}  // namespace
}  // namespace dmslam
