#include "dmslam/initialization/plane_motions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "dmslam/initialization/candidate_map.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

const Rigid3d kMotion(ExpSo3({-0.01, 0.12, 0.0}), {0.17, 0.01, -0.3});

/// Matches of points on a pinboard that stands askew, of which `off_plane` lie elsewhere, under kMotion.
MatchArrays Pinboard(double off_plane) {
  const Camera camera = SyntheticCamera();
  Random random(5);
  std::vector<Match> matches;
  while (matches.size() < 300) {
    const Eigen::Vector3d ray = camera.Ray({random.Uniform(250, 450), random.Uniform(100, 350)});
    const double on_board_m = 1.0 / Eigen::Vector3d(0.15, 0.02, 0.4).dot(ray);
    const double depth_m = random.Uniform(0, 1) < off_plane ? random.Uniform(1.2, 6.0) : on_board_m;
    const auto uv = camera.Project(kMotion * (depth_m * ray));
    if (!uv) continue;
    Match match;
    match.index0 = match.index1 = static_cast<uint32_t>(matches.size());
    match.uv0_px = *camera.Project(ray) + 0.4 * Eigen::Vector2d(random.Gaussian(), random.Gaussian());
    match.uv1_px = *uv + 0.4 * Eigen::Vector2d(random.Gaussian(), random.Gaussian());
    matches.push_back(match);
  }
  std::vector<uint32_t> order(matches.size());
  for (uint32_t k = 0; k < order.size(); ++k) order[k] = k;
  return MakeArrays(matches, order, camera, InlierOptions());
}

Rigid3d Normalized(Rigid3d T) {
  T.translation.normalize();
  return T;
}

TEST(PlaneMotions, APlaneHasTwoAndOneOfThemIsTheCameras) {
  for (const double off_plane : {0.0, 0.2}) {
    const MatchArrays arrays = Pinboard(off_plane);
    const std::vector<Rigid3d> motions = PlaneMotions(arrays, std::vector<uint8_t>(arrays.size(), 1));
    ASSERT_EQ(motions.size(), 2U) << off_plane;
    const auto is_true = [](const Rigid3d& T) {
      return CandidateBuilder::SameMotion(T, Normalized(kMotion));
    };
    EXPECT_EQ(std::count_if(motions.begin(), motions.end(), is_true), 1) << off_plane;
  }
}

TEST(PlaneMotions, ARoomHasNone) {
  const MatchArrays arrays = Pinboard(0.9);
  EXPECT_TRUE(PlaneMotions(arrays, std::vector<uint8_t>(arrays.size(), 1)).empty());
}

TEST(PlaneMotions, OnlyWhatIsFlaggedCounts) {
  const MatchArrays arrays = Pinboard(0.0);
  EXPECT_TRUE(PlaneMotions(arrays, std::vector<uint8_t>(arrays.size(), 0)).empty());
}

}  // namespace
}  // namespace dmslam
