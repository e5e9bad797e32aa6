// What gives a map of two views and what refuses one; initializer_test.cc has the same on whole pipelines.
#include "dmslam/initialization/two_view_reconstruction.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>
#include <string>

#include "dmslam/geometry/two_view.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

/// What a selector without faults says of a pair.
StaticSelection TrueSelection(const SyntheticPair& pair, ModelKind kind) {
  const Eigen::Vector3d& t = pair.T_1_0.translation;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  const Eigen::Matrix3d E = cross * pair.T_1_0.rotation.toRotationMatrix();
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = pair.camera.fx_px, K(1, 1) = pair.camera.fy_px;
  K(0, 2) = pair.camera.cx_px, K(1, 2) = pair.camera.cy_px;
  const Eigen::Matrix3d F = K.inverse().transpose() * E * K.inverse();
  StaticSelection selection;
  selection.kind = kind;
  selection.F = F.normalized();
  if (kind == ModelKind::kEssential) selection.E = E.normalized();
  selection.is_static = pair.truth;
  selection.num_static = std::accumulate(pair.truth.begin(), pair.truth.end(), 0);
  return selection;
}

TwoViewReconstruction OfTheTruth(const SyntheticPair& pair, const ReconstructionOptions& options = {}) {
  return ReconstructFromStatic(pair.matches, TrueSelection(pair, ModelKind::kEssential), pair.camera,
                               options);
}

void ExpectTrueMotion(const SyntheticPair& pair, const TwoViewReconstruction& map, double tolerance) {
  EXPECT_NEAR(map.T_1_0.translation.norm(), 1.0, 1e-9);
  EXPECT_LT((map.T_1_0.translation - pair.T_1_0.translation.normalized()).norm(), tolerance);
  EXPECT_LT(AngleBetween(map.T_1_0.rotation, pair.T_1_0.rotation), tolerance);
}

/// In units of the translation: the points lie where both cameras see them.
void ExpectSeenByBoth(const SyntheticPair& pair, const TwoViewReconstruction& map, double tolerance_px) {
  for (size_t i = 0; i < pair.matches.size(); ++i) {
    if (!map.has_point[i]) continue;
    const auto uv0 = pair.camera.Project(map.points_cam0[i]);
    const auto uv1 = pair.camera.Project(map.T_1_0 * map.points_cam0[i]);
    ASSERT_TRUE(uv0 && uv1) << i;
    EXPECT_LT((*uv0 - pair.matches[i].uv0_px).norm(), tolerance_px) << i;
    EXPECT_LT((*uv1 - pair.matches[i].uv1_px).norm(), tolerance_px) << i;
  }
}

SyntheticPair ExactPair(int num_moving = 0) {
  SyntheticPairOptions options;
  options.noise_px = 0;
  options.num_moving = num_moving;
  return MakeSyntheticPair(options, 31);
}

TEST(ReconstructFromStatic, EitherModelGivesMotionAndPointsOfWhatIsStatic) {
  SyntheticPair pair = ExactPair(100);
  for (size_t i = 0; i < 50; ++i) pair.truth[i] = 0;  // a selector may leave out what fits
  for (const ModelKind kind : {ModelKind::kEssential, ModelKind::kFundamental}) {
    const TwoViewReconstruction map =
        ReconstructFromStatic(pair.matches, TrueSelection(pair, kind), pair.camera, {});
    ASSERT_TRUE(map.IsUsable()) << map.explanation;
    ExpectTrueMotion(pair, map, 1e-6);
    ExpectSeenByBoth(pair, map, 1e-4);
    EXPECT_EQ(map.has_point, pair.truth);
    EXPECT_EQ(map.num_points, 450);
    EXPECT_GT(map.parallax_rad, map.median_parallax_rad) << "the 50th largest of 450";
    EXPECT_FALSE(map.from_homography);
  }
}

TEST(ReconstructFromStatic, EachGateNamesItsReason) {
  const SyntheticPair pair = ExactPair();
  ReconstructionOptions options;
  options.min_points = 500;
  EXPECT_TRUE(OfTheTruth(pair, options).IsUsable());
  options.min_points = 501;
  const TwoViewReconstruction few = OfTheTruth(pair, options);
  EXPECT_EQ(few.refusal, ReconstructionRefusal::kTooFewPoints);
  EXPECT_NE(few.explanation.find("500 points"), std::string::npos) << few.explanation;

  options = {};
  options.min_parallax_rad = OfTheTruth(pair).parallax_rad * 1.01;
  const TwoViewReconstruction narrow = OfTheTruth(pair, options);
  EXPECT_EQ(narrow.refusal, ReconstructionRefusal::kParallaxTooSmall);
  EXPECT_NE(narrow.explanation.find("parallax"), std::string::npos) << narrow.explanation;
}

/// A camera that hardly moves sees the same whether it goes this way or that.
TEST(ReconstructFromStatic, TwoPosesThatExplainTheSameAreAmbiguous) {
  SyntheticPairOptions scene;
  scene.translation *= 1e-4;
  const SyntheticPair pair = MakeSyntheticPair(scene, 32);
  const TwoViewReconstruction map = OfTheTruth(pair);
  EXPECT_EQ(map.refusal, ReconstructionRefusal::kAmbiguous) << ToString(map.refusal);
  EXPECT_NE(map.explanation.find("a second pose explains"), std::string::npos) << map.explanation;
  ReconstructionOptions options;
  options.max_runner_up = 1.0;
  EXPECT_EQ(OfTheTruth(pair, options).refusal, ReconstructionRefusal::kParallaxTooSmall);
}

TEST(ReconstructFromStatic, APointMayErrAsAskedAndOneOfACoarseLevelMore) {
  SyntheticPairOptions scene;
  scene.noise_px = 4;
  SyntheticPair pair = MakeSyntheticPair(scene, 33);
  const int fine = OfTheTruth(pair).num_points;
  ReconstructionOptions generous;
  generous.max_reprojection_squared_px = 36;
  EXPECT_GT(OfTheTruth(pair, generous).num_points, 400);
  for (Match& match : pair.matches) match.octave1 = 6;  // in one of the frames
  const int coarse = OfTheTruth(pair).num_points;
  EXPECT_LT(fine, 300);
  EXPECT_GT(coarse, 400);
}

TEST(ReconstructFromStatic, WhatTheSelectorRefusesItSaysInItsWords) {
  const SyntheticPair pair = ExactPair();
  StaticSelection refused = TrueSelection(pair, ModelKind::kEssential);
  refused.refusal = Refusal::kTooFewCells;
  refused.explanation = "3 cells";
  const TwoViewReconstruction map = ReconstructFromStatic(pair.matches, refused, pair.camera, {});
  EXPECT_EQ(map.refusal, ReconstructionRefusal::kNoModel);
  EXPECT_EQ(map.explanation, "3 cells");
  EXPECT_EQ(map.has_point, std::vector<uint8_t>(pair.matches.size(), 0));
}

TEST(ReconstructBaseline, MismatchesHaveNoPoints) {
  SyntheticPairOptions options;
  options.num_mismatches = 200;
  const SyntheticPair pair = MakeSyntheticPair(options, 34);
  const TwoViewReconstruction map = ReconstructBaseline(pair.matches, pair.camera, {}, 1);
  ASSERT_TRUE(map.IsUsable()) << map.explanation;
  ExpectTrueMotion(pair, map, 0.2);
  ExpectSeenByBoth(pair, map, 2.0);
  const auto mismatches = map.has_point.begin() + options.num_static;
  EXPECT_GT(std::accumulate(map.has_point.begin(), mismatches, 0), 350);
  EXPECT_LT(std::accumulate(mismatches, map.has_point.end(), 0), 20);
}

TEST(ReconstructBaseline, WhatIsOffTheModelHasNoPoint) {
  const SyntheticPair pair = MakeSyntheticPair({}, 38);
  HomographyOrFundamentalOptions options;
  const int usual = ReconstructBaseline(pair.matches, pair.camera, options, 1).num_points;
  options.sigma_px = 0.1;
  const int strict = ReconstructBaseline(pair.matches, pair.camera, options, 1).num_points;
  EXPECT_LT(strict, usual / 2);
}

TEST(ReconstructBaseline, AHomographyGivesTheMotionBeforeAPlane) {
  SyntheticPairOptions scene;
  scene.flat = true;
  scene.noise_px = 0.1;
  scene.translation = {0.4, 0.05, 0.02};
  scene.num_mismatches = 200;
  const SyntheticPair pair = MakeSyntheticPair(scene, 35);
  HomographyOrFundamentalOptions options;
  const TwoViewReconstruction map = ReconstructBaseline(pair.matches, pair.camera, options, 1);
  ASSERT_TRUE(map.IsUsable()) << map.explanation;
  EXPECT_TRUE(map.from_homography);
  ExpectTrueMotion(pair, map, 0.1);
  ExpectSeenByBoth(pair, map, 2.0);
  options.homography_share = 1.0;
  EXPECT_FALSE(ReconstructBaseline(pair.matches, pair.camera, options, 1).from_homography);
}

/// A plane far off: the runner-up may explain more of it than of a fundamental matrix's points.
TEST(ReconstructBaseline, AHomographysRunnerUpHasABoundOfItsOwn) {
  SyntheticPairOptions scene;
  scene.flat = true;
  scene.translation *= 0.1;
  const SyntheticPair pair = MakeSyntheticPair(scene, 39);
  HomographyOrFundamentalOptions options;
  options.reconstruction.min_parallax_rad = 0;
  for (const double bound : {1.0, 0.01}) {
    options.max_runner_up_homography = bound;
    const TwoViewReconstruction map = ReconstructBaseline(pair.matches, pair.camera, options, 1);
    EXPECT_TRUE(map.from_homography);
    EXPECT_EQ(map.refusal == ReconstructionRefusal::kAmbiguous, bound < 1) << map.explanation;
  }
}

TEST(ReconstructBaseline, TheSeedDecidesTheSamples) {
  const SyntheticPair pair = MakeSyntheticPair({}, 36);
  const auto translation = [&](uint64_t seed) {
    return ReconstructBaseline(pair.matches, pair.camera, {}, seed).T_1_0.translation;
  };
  EXPECT_EQ(translation(1), translation(1));
  EXPECT_NE(translation(1), translation(2));
}

TEST(ReconstructBaseline, EightMatchesAreTheLeast) {
  SyntheticPairOptions scene;
  scene.num_static = 8;
  scene.noise_px = 0;
  const SyntheticPair pair = MakeSyntheticPair(scene, 37);
  HomographyOrFundamentalOptions options;
  options.reconstruction.min_points = 4;
  options.reconstruction.max_runner_up = options.max_runner_up_homography = 1.0;
  options.reconstruction.min_parallax_rad = 0;
  EXPECT_TRUE(ReconstructBaseline(pair.matches, pair.camera, options, 1).IsUsable());
  const TwoViewReconstruction fewer =
      ReconstructBaseline(std::span(pair.matches).first(7), pair.camera, options, 1);
  EXPECT_EQ(fewer.refusal, ReconstructionRefusal::kNoModel);
  EXPECT_EQ(fewer.has_point.size(), 7U);
}

TEST(ReconstructionRefusal, EachHasAName) {
  std::set<std::string_view> names;
  for (const auto refusal :
       {ReconstructionRefusal::kNone, ReconstructionRefusal::kNoModel, ReconstructionRefusal::kAmbiguous,
        ReconstructionRefusal::kTooFewPoints, ReconstructionRefusal::kParallaxTooSmall}) {
    names.insert(ToString(refusal));
  }
  EXPECT_EQ(names.size(), 5U);
  EXPECT_FALSE(names.contains("unknown"));
}

}  // namespace
}  // namespace dmslam
