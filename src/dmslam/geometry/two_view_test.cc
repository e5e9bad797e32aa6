#include "dmslam/geometry/two_view.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "dmslam/geometry/polynomial.h"
#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/geometry/triangulation.h"

namespace dmslam {
namespace {

SyntheticViews PairOf(uint64_t seed, double noise_px = 0.0, double thickness = 4.0) {
  return MakeSyntheticViews(MakeSyntheticScene(
      {.seed = seed, .num_points = 120, .noise_px = noise_px, .step = 0.5, .thickness = thickness}));
}

const Pinhole kCamera = SyntheticScene().camera;

/// Distance of two matrices that are defined up to scale and sign.
double ProjectiveDistance(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::min((a.normalized() - b.normalized()).norm(), (a.normalized() + b.normalized()).norm());
}

Eigen::Matrix3d TrueF(const SyntheticViews& pair) {
  return FundamentalFromEssential(EssentialFromPose(pair.T_cam2_cam1), kCamera, kCamera);
}

template <size_t kN>
std::array<int, kN> FirstIndices(int from = 0) {
  std::array<int, kN> indices;
  std::iota(indices.begin(), indices.end(), from);
  return indices;
}

TEST(Polynomial, CubicRootsAreFound) {
  Random random(1);
  for (int k = 0; k < 500; ++k) {
    std::array<double, 3> truth{random.Uniform(-5, 5), random.Uniform(-5, 5), random.Uniform(-5, 5)};
    const double lead = random.Uniform(0.5, 3);
    std::array<double, 3> roots;
    ASSERT_EQ(RealRootsCubic({lead, -lead * (truth[0] + truth[1] + truth[2]),
                              lead * (truth[0] * truth[1] + truth[0] * truth[2] + truth[1] * truth[2]),
                              -lead * truth[0] * truth[1] * truth[2]},
                             roots),
              3);
    std::sort(truth.begin(), truth.end());
    std::sort(roots.begin(), roots.end());
    const double gap = std::min(truth[1] - truth[0], truth[2] - truth[1]);
    if (gap < 1e-3) continue;
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(roots[i], truth[i], 1e-9);
  }
}

TEST(Polynomial, SturmFindsAllRealRootsOfDegreeTen) {
  Random random(2);
  for (int k = 0; k < 300; ++k) {
    const int pairs = static_cast<int>(random.Below(6));  // Pairs of complex roots.
    std::array<double, 11> c{};
    c[0] = random.Uniform(0.5, 2.0);
    int degree = 0;
    std::vector<double> truth;
    const auto multiply = [&](double square, double linear, double constant) {
      for (int i = 10; i >= 0; --i) {
        const auto n = static_cast<size_t>(i);
        c[n] = constant * c[n] + (i >= 1 ? linear * c[n - 1] : 0.0) + (i >= 2 ? square * c[n - 2] : 0.0);
      }
    };
    for (; degree < 2 * pairs; degree += 2) {
      const double real = random.Uniform(-2, 2), imaginary = random.Uniform(0.2, 2);
      multiply(1.0, -2.0 * real, real * real + imaginary * imaginary);
    }
    for (; degree < 10; ++degree) {
      truth.push_back(-3.0 + 0.6 * degree + random.Uniform(0.0, 0.4));
      multiply(0.0, 1.0, -truth.back());
    }
    std::array<double, 10> roots;
    ASSERT_EQ(RealRootsDegree10(c, roots), static_cast<int>(truth.size()));
    for (size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(roots[i], truth[i], 1e-6);
  }
}

TEST(Fundamental, MinimalEightPointIsExact) {
  for (uint64_t seed = 1; seed <= 100; ++seed) {
    const SyntheticViews pair = PairOf(seed);
    const auto F = FundamentalEightPointMinimal(pair.x1_px, pair.x2_px, FirstIndices<8>(3));
    ASSERT_TRUE(F.has_value());
    EXPECT_NEAR(F->determinant(), 0.0, 1e-15);
    double worst = 0.0;
    for (size_t i = 0; i < pair.x1_px.size(); ++i) {
      worst = std::max(worst, SampsonErrorSquared(*F, pair.x1_px[i], pair.x2_px[i]));
    }
    EXPECT_LT(worst, 1e-6) << "seed " << seed;
  }
}

TEST(Fundamental, LeastSquaresStaysNearTheTruthUnderNoise) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const SyntheticViews pair = PairOf(seed, 0.5), clean = PairOf(seed);
    const auto F = FundamentalEightPoint(pair.x1_px, pair.x2_px);
    ASSERT_TRUE(F.has_value());
    double sum = 0.0;
    for (size_t i = 0; i < clean.x1_px.size(); ++i) {
      sum += SampsonErrorSquared(*F, clean.x1_px[i], clean.x2_px[i]);
    }
    EXPECT_LT(std::sqrt(sum / static_cast<double>(clean.x1_px.size())), 0.35) << "seed " << seed;
  }
}

TEST(Fundamental, WeightsRemoveOutliers) {
  SyntheticViews pair = PairOf(5);
  std::vector<double> weights(pair.x1_px.size(), 1.0);
  for (size_t i = 0; i < 20; ++i) pair.x2_px[i].x() += 40.0, weights[i] = 0.0;
  const auto F = FundamentalEightPoint(pair.x1_px, pair.x2_px, {}, weights);
  ASSERT_TRUE(F.has_value());
  EXPECT_LT(ProjectiveDistance(*F, TrueF(pair)), 1e-7);
}

TEST(Fundamental, DegenerateSamplesGiveNothing) {
  SyntheticViews pair = PairOf(7);
  for (size_t i = 1; i < 8; ++i) pair.x1_px[i] = pair.x1_px[0], pair.x2_px[i] = pair.x2_px[0];
  EXPECT_FALSE(FundamentalEightPointMinimal(pair.x1_px, pair.x2_px, FirstIndices<8>()).has_value());
  EXPECT_FALSE(FundamentalEightPoint(pair.x1_px, pair.x2_px, FirstIndices<7>()).has_value());
}

TEST(Essential, OneOfTheFivePointSolutionsIsTrueAndAllAreEssential) {
  int failures = 0;
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    const SyntheticViews pair = PairOf(seed, 0.0, seed % 3 == 0 ? 0.0 : 4.0);
    std::array<Eigen::Matrix3d, 10> models;
    const int count = EssentialFivePoint(pair.rays1, pair.rays2, FirstIndices<5>(), models);
    double best = 1.0;
    for (int k = 0; k < count; ++k) {
      const Eigen::Matrix3d& E = models[static_cast<size_t>(k)];
      best = std::min(best, ProjectiveDistance(E, EssentialFromPose(pair.T_cam2_cam1)));
      for (size_t i = 0; i < 5; ++i) EXPECT_NEAR(pair.rays2[i].dot(E * pair.rays1[i]), 0.0, 1e-9);
      const Eigen::Vector3d values = E.jacobiSvd().singularValues();
      EXPECT_NEAR(values(2), 0.0, 1e-4);
      EXPECT_NEAR(values(0), values(1), 1e-4);
    }
    if (best > 1e-5) ++failures;
  }
  EXPECT_LE(failures, 3);
}

TEST(Essential, DecompositionHoldsTheTruePose) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    const SyntheticViews pair = PairOf(seed);
    const Eigen::Matrix3d F = TrueF(pair);
    const Eigen::Matrix3d E = EssentialFromFundamental(F, kCamera, kCamera);
    EXPECT_LT(ProjectiveDistance(E, EssentialFromPose(pair.T_cam2_cam1)), 1e-9);
    std::vector<int> all(pair.rays1.size());
    std::iota(all.begin(), all.end(), 0);
    Rigid3d T;
    EXPECT_EQ(PoseFromEssential(E, pair.rays1, pair.rays2, all, T), static_cast<int>(all.size()));
    EXPECT_LT(AngleBetween(T.rotation, pair.T_cam2_cam1.rotation), 1e-7);
    EXPECT_NEAR(T.translation.dot(pair.T_cam2_cam1.translation.normalized()), 1.0, 1e-12);
  }
}

TEST(Essential, ChoosePoseCountsAndTriangulates) {
  const SyntheticViews pair = PairOf(11, 0.3);
  const auto candidates = DecomposeEssential(EssentialFromPose(pair.T_cam2_cam1));
  const auto choice = ChoosePose(candidates, kCamera, pair.x1_px, pair.x2_px);
  ASSERT_TRUE(choice.has_value());
  EXPECT_GT(choice->num_good, static_cast<int>(0.98 * static_cast<double>(pair.x1_px.size())));
  EXPECT_LT(choice->num_good_second, choice->num_good / 2);
  EXPECT_GT(choice->median_parallax_rad, 0.05);
  const double baseline = pair.T_cam2_cam1.translation.norm();
  const SyntheticScene scene =
      MakeSyntheticScene({.seed = 11, .num_points = 120, .noise_px = 0.3, .step = 0.5, .thickness = 4.0});
  for (size_t i = 0; i < pair.points.size(); ++i) {
    if (!choice->good[i]) continue;
    const Eigen::Vector3d truth = scene.T_cam_world[0] * scene.points[static_cast<size_t>(pair.points[i])];
    EXPECT_LT((choice->points_cam1[i] * baseline - truth).norm(), 0.05 * truth.norm());
  }
}

TEST(Essential, ChoosePoseObeysTheMask) {
  const SyntheticViews pair = PairOf(12);
  std::vector<char> mask(pair.x1_px.size(), 0);
  mask[3] = mask[7] = 1;
  const auto candidates = DecomposeEssential(EssentialFromPose(pair.T_cam2_cam1));
  const auto choice = ChoosePose(candidates, kCamera, pair.x1_px, pair.x2_px, mask);
  ASSERT_TRUE(choice.has_value());
  EXPECT_EQ(choice->num_good, 2);
  EXPECT_EQ(std::count(choice->good.begin(), choice->good.end(), 1), 2);
  EXPECT_FALSE(ChoosePose({}, kCamera, pair.x1_px, pair.x2_px).has_value());
}

TEST(Essential, EightPointOnRaysIsExact) {
  const SyntheticViews pair = PairOf(13);
  const auto E = EssentialEightPoint(pair.rays1, pair.rays2);
  ASSERT_TRUE(E.has_value());
  EXPECT_LT(ProjectiveDistance(*E, EssentialFromPose(pair.T_cam2_cam1)), 1e-8);
}

TEST(RelativePose, RefinementReachesTheTruthAlsoOnPlanes) {
  Random random(31);
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    const SyntheticViews pair = PairOf(seed, 0.0, seed % 2 ? 4.0 : 0.0);
    std::vector<int> all(pair.x1_px.size());
    std::iota(all.begin(), all.end(), 0);
    Rigid3d start = pair.T_cam2_cam1;
    start.rotation = ExpSo3(RandomVector(random, 0.003)) * start.rotation;
    start.translation += RandomVector(random, 0.02);
    const Rigid3d T = RefineRelativePose(kCamera, start, pair.x1_px, pair.x2_px, all, {}, 0.0, 20);
    EXPECT_LT(AngleBetween(T.rotation, pair.T_cam2_cam1.rotation), 1e-5) << "seed " << seed;
    EXPECT_LT(AngleBetweenRays(T.translation, pair.T_cam2_cam1.translation), 1e-4) << "seed " << seed;
    EXPECT_NEAR(T.translation.norm(), start.translation.norm(), 1e-12);
  }
}

TEST(RelativePose, RefinementBeatsTheLinearFitUnderNoise) {
  double linear = 0.0, refined = 0.0;
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const SyntheticViews pair = PairOf(seed, 0.7);
    std::vector<int> all(pair.x1_px.size());
    std::iota(all.begin(), all.end(), 0);
    const auto E = EssentialEightPoint(pair.rays1, pair.rays2);
    ASSERT_TRUE(E.has_value());
    Rigid3d start;
    PoseFromEssential(*E, pair.rays1, pair.rays2, all, start);
    const Rigid3d T = RefineRelativePose(kCamera, start, pair.x1_px, pair.x2_px, all);
    linear += AngleBetweenRays(start.translation, pair.T_cam2_cam1.translation);
    refined += AngleBetweenRays(T.translation, pair.T_cam2_cam1.translation);
  }
  EXPECT_LT(refined, 0.7 * linear);
}

TEST(Homography, FourPointsAndLeastSquaresAreExactOnAPlane) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    const SyntheticViews pair = PairOf(seed, 0.0, 0.0);
    const auto linear = HomographyLinear(pair.x1_px, pair.x2_px);
    ASSERT_TRUE(linear.has_value());
    const Eigen::Matrix3d inverse = linear->inverse();
    const auto minimal = HomographyFourPoint(pair.x1_px, pair.x2_px, FirstIndices<4>(static_cast<int>(seed)));
    for (size_t i = 0; i < pair.x1_px.size(); ++i) {
      EXPECT_LT(TransferErrorSquared(*linear, pair.x1_px[i], pair.x2_px[i]) +
                    TransferErrorSquared(inverse, pair.x2_px[i], pair.x1_px[i]),
                1e-12);
    }
    if (minimal) {
      EXPECT_LT(ProjectiveDistance(*minimal, *linear), 1e-4);
    }
  }
}

TEST(Homography, CollinearSampleGivesNothing) {
  SyntheticViews pair = PairOf(3, 0.0, 0.0);
  pair.x1_px[2] = 0.5 * (pair.x1_px[0] + pair.x1_px[1]);
  EXPECT_FALSE(HomographyFourPoint(pair.x1_px, pair.x2_px, FirstIndices<4>()).has_value());
}

TEST(Homography, DecompositionHoldsTheTruePose) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    const SyntheticViews pair = PairOf(seed, 0.0, 0.0);
    const auto H = HomographyLinear(pair.x1_px, pair.x2_px);
    ASSERT_TRUE(H.has_value());
    const auto motions = DecomposeHomography(seed % 2 ? *H : Eigen::Matrix3d(-*H), kCamera, kCamera);
    double best = 10.0;
    for (const PlaneMotion& m : motions) {
      const double direction =
          (m.T_cam2_cam1.translation.normalized() - pair.T_cam2_cam1.translation.normalized()).norm();
      best = std::min(best, direction + AngleBetween(m.T_cam2_cam1.rotation, pair.T_cam2_cam1.rotation));
    }
    EXPECT_LT(best, 1e-5) << "seed " << seed;
    EXPECT_LE(motions.size(), 8u);
  }
}

TEST(Homography, PureRotationIsRecognised) {
  const Rigid3d turn(ExpSo3({0.02, 0.1, -0.03}), Eigen::Vector3d::Zero());
  const Eigen::Matrix3d H = kCamera.K() * turn.rotation.toRotationMatrix() * kCamera.K().inverse();
  const auto motions = DecomposeHomography(H, kCamera, kCamera);
  ASSERT_EQ(motions.size(), 1u);
  EXPECT_LT(AngleBetween(motions[0].T_cam2_cam1.rotation, turn.rotation), 1e-7);
  EXPECT_EQ(motions[0].T_cam2_cam1.translation.norm(), 0.0);
}

TEST(Residuals, SampsonIsTheDistanceForSmallErrors) {
  const SyntheticViews pair = PairOf(21);
  const Eigen::Matrix3d F = TrueF(pair);
  // Against the smallest move of both points that meets the constraint, by a few steps of linearisation.
  for (size_t i = 0; i < 20; ++i) {
    const Eigen::Vector2d a = pair.x1_px[i] + Eigen::Vector2d(0.6, -0.4),
                          b = pair.x2_px[i] + Eigen::Vector2d(-0.5, 0.7);
    Eigen::Vector2d x = a, y = b;
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector2d by = (F * x.homogeneous()).head<2>(),
                            bx = (F.transpose() * y.homogeneous()).head<2>();
      const double value = y.homogeneous().dot(F * x.homogeneous()) + bx.dot(a - x) + by.dot(b - y);
      const double step = value / (bx.squaredNorm() + by.squaredNorm());
      x = a - step * bx;
      y = b - step * by;
    }
    const double exact = (x - a).squaredNorm() + (y - b).squaredNorm();
    EXPECT_NEAR(SampsonErrorSquared(F, a, b), exact, 0.02 * exact + 1e-9);
  }
}

TEST(Triangulation, ExactWithoutNoiseAndNoneBehind) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const SyntheticScene scene = MakeSyntheticScene({.seed = seed});
    const SyntheticViews pair = MakeSyntheticViews(scene);
    for (size_t i = 0; i < pair.points.size(); ++i) {
      const auto p =
          TriangulatePoint(scene.T_cam_world[0], scene.T_cam_world[1], pair.rays1[i], pair.rays2[i]);
      ASSERT_TRUE(p.has_value());
      EXPECT_LT((*p - scene.points[static_cast<size_t>(pair.points[i])]).norm(), 1e-8);
      EXPECT_FALSE(
          TriangulatePoint(scene.T_cam_world[0], scene.T_cam_world[1], -pair.rays1[i], -pair.rays2[i]));
      EXPECT_FALSE(
          TriangulatePoint(scene.T_cam_world[0], scene.T_cam_world[0], pair.rays1[i], pair.rays1[i]));
    }
  }
}

TEST(Triangulation, ParallaxIsTheAngleAtThePoint) {
  EXPECT_NEAR(ParallaxAngle({0, 0, 0}, {1, 0, 0}, {0, 0, 1}), std::atan(1.0), 1e-15);
  EXPECT_NEAR(AngleBetweenRays({1, 0, 0}, {0, 3, 0}), std::acos(0.0), 1e-15);
}

}  // namespace
}  // namespace dmslam
