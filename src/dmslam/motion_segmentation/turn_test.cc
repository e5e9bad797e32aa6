// How far the camera has turned between two frames, roughly.
#include "dmslam/motion_segmentation/turn.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// Points seen before and after the turn; the first `wrong` of them have moved besides, together.
std::vector<Match> MatchesAfter(const Eigen::Quaterniond& R_1_0, size_t number, size_t wrong) {
  const Camera camera = TestCamera();
  Random random(5);
  std::vector<Match> matches;
  while (matches.size() < number) {
    Match match;
    match.uv0_px = {random.Uniform(0, camera.width_px), random.Uniform(0, camera.height_px)};
    const auto uv1 = camera.Project(R_1_0 * camera.Ray(match.uv0_px));
    if (!uv1) continue;
    match.uv1_px = *uv1 + Eigen::Vector2d(random.Gaussian(), random.Gaussian());
    if (matches.size() < wrong) match.uv1_px += Eigen::Vector2d(60, 10);
    matches.push_back(match);
  }
  return matches;
}

TEST(FitTurn, FindsTheTurnOfMost) {
  const Eigen::Quaterniond R_1_0 = ExpSo3({0.05, 0.4, -0.1});
  const auto found = FitTurn(MatchesAfter(R_1_0, 300, 100), TestCamera(), Eigen::Quaterniond::Identity());
  EXPECT_LT(AngleBetween(found, R_1_0), 0.01);
}

TEST(FitTurn, WithoutMatchesTheStartStays) {
  const Eigen::Quaterniond start = ExpSo3({0.0, 0.2, 0.0});
  EXPECT_LT(AngleBetween(FitTurn({}, TestCamera(), start), start), 1e-12);
}

TEST(Turned, SaysWherePointsLieAndWhichAreBehind) {
  const Camera camera = TestCamera();
  const Eigen::Quaterniond R_1_0 = ExpSo3({0.0, 0.3, 0.0});
  const std::vector<Eigen::Vector2d> centre = {{camera.cx_px, camera.cy_px}};
  EXPECT_NEAR(Turned(centre, camera, R_1_0).front().x(), camera.cx_px + camera.fx_px * std::tan(0.3), 1e-9);
  EXPECT_FALSE(Turned(centre, camera, ExpSo3({0.0, 3.0, 0.0})).front().allFinite());
}

}  // namespace
}  // namespace dmslam
