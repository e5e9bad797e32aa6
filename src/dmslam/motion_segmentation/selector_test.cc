#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "dmslam/geometry/two_view.h"
#include "dmslam/motion_segmentation/depth_layers.h"
#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/ransac.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

struct Score {
  double precision = 0, recall = 0;
};

Score ScoreOf(const SyntheticPair& pair, const StaticSelection& selection) {
  int called = 0, right = 0, all = 0;
  for (size_t i = 0; i < pair.truth.size(); ++i) {
    all += pair.truth[i];
    called += selection.is_static[i];
    right += selection.is_static[i] & pair.truth[i];
  }
  return {called == 0 ? 1.0 : right / static_cast<double>(called), right / static_cast<double>(all)};
}

TEST(MatchArrays, OfSmallImagesAreExactToAPartOfAPixel) {
  const SyntheticPair pair = MakeSyntheticPair({}, 1);
  std::vector<uint32_t> order(pair.matches.size());
  std::iota(order.begin(), order.end(), 0U);
  Camera small = pair.camera;
  small.width_px = 320;
  small.height_px = 240;
  for (const bool by_octave : {true, false}) {
    InlierOptions options;
    options.scale_by_octave = by_octave;
    const MatchArrays whole = MakeArrays(pair.matches, order, pair.camera, options);
    const MatchArrays half = MakeArrays(pair.matches, order, small, options);
    for (size_t i = 0; i < order.size(); ++i) {
      EXPECT_FLOAT_EQ(half.bound0[i], 0.25F * whole.bound0[i]);
      EXPECT_FLOAT_EQ(half.bound1[i], 0.25F * whole.bound1[i]);
    }
  }
}

TEST(CountInliers, IsTheSameOnEveryPathAndExactAboveItsBound) {
  SyntheticPairOptions options;
  options.num_moving = 200;
  options.num_mismatches = 77;
  const SyntheticPair pair = MakeSyntheticPair(options, 3);
  std::vector<uint32_t> order(pair.matches.size());
  std::iota(order.begin(), order.end(), 0U);
  const MatchArrays arrays = MakeArrays(pair.matches, order, pair.camera, {});
  Random random(5);
  std::array<Eigen::Matrix3d, kMaxModels> models;
  for (int k = 0; k < 50; ++k) {
    const Range range{static_cast<size_t>(k), arrays.size() - static_cast<size_t>(2 * k)};
    const int solutions = SolveSample(ModelKind::kEssential, arrays, range, random, models);
    for (int m = 0; m < solutions; ++m) {
      const Eigen::Matrix3d& M = models[static_cast<size_t>(m)];
      std::vector<uint8_t> flags(arrays.size(), 0);
      const int count = FlagInliers(M, arrays, range, flags, VectorPath::kBaseline);
      EXPECT_EQ(std::accumulate(flags.begin(), flags.end(), 0), count);
      for (const VectorPath path : VectorPaths()) {
        EXPECT_EQ(CountInliers(M, arrays, range, -1, path), count);
        EXPECT_EQ(CountInliers(M, arrays, range, count - 1, path), count);
        EXPECT_LE(CountInliers(M, arrays, range, count, path), count);
        std::vector<uint8_t> others(arrays.size(), 0);
        EXPECT_EQ(FlagInliers(M, arrays, range, others, path), count);
        EXPECT_EQ(others, flags);
      }
    }
  }
}

class EverySelector : public testing::TestWithParam<std::pair<const char*, ModelKind>> {
 protected:
  std::unique_ptr<StaticSelector> Make() const { return MakeSelector(GetParam().first, GetParam().second); }
};

TEST_P(EverySelector, FindsTheStaticOfARoomWithASmallMover) {
  SyntheticPairOptions options;
  options.num_moving = 100;
  options.num_mismatches = 40;
  const SyntheticPair pair = MakeSyntheticPair(options, 1);
  const StaticSelection selection = Make()->Select(pair.matches, pair.camera, 7);
  ASSERT_TRUE(selection.IsUsable()) << selection.explanation;
  const Score score = ScoreOf(pair, selection);
  const bool paper = std::string(GetParam().first) == "dlrsac-paper";  // as written, it takes whole cells
  if (!paper) {
    EXPECT_GT(score.precision, 0.9);
  }
  EXPECT_GT(score.recall, paper ? 0.3 : 0.85);
  // Movers alone, which is how the judge counts; mismatches, which whole cells contain, come last.
  const auto judged = static_cast<ptrdiff_t>(pair.matches.size()) - options.num_mismatches;
  const auto called = std::accumulate(selection.is_static.begin(), selection.is_static.begin() + judged, 0.0);
  const double right = std::inner_product(selection.is_static.begin(), selection.is_static.begin() + judged,
                                          pair.truth.begin(), 0.0);
  EXPECT_GT(right / called, 0.9);
  EXPECT_EQ(selection.is_static.size(), pair.matches.size());
  EXPECT_NEAR(selection.F.norm(), 1.0, 1e-9);
}

TEST_P(EverySelector, IsDeterministicUnderASeed) {
  SyntheticPairOptions options;
  options.num_moving = 150;
  const SyntheticPair pair = MakeSyntheticPair(options, 2);
  const StaticSelection a = Make()->Select(pair.matches, pair.camera, 3);
  const StaticSelection b = Make()->Select(pair.matches, pair.camera, 3);
  EXPECT_EQ(a.F, b.F);
  EXPECT_EQ(a.is_static, b.is_static);
}

TEST_P(EverySelector, RefusesTooFewMatches) {
  SyntheticPairOptions options;
  options.num_static = 7;
  const SyntheticPair pair = MakeSyntheticPair(options, 3);
  const StaticSelection selection = Make()->Select(pair.matches, pair.camera, 1);
  EXPECT_EQ(selection.refusal, Refusal::kTooFewMatches);
  EXPECT_EQ(selection.num_static, 0);
  EXPECT_EQ(Make()->Select({}, pair.camera, 1).refusal, Refusal::kTooFewMatches);
}

TEST_P(EverySelector, RefusesWhatIsNotFiniteOrOutside) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -40.0, 5000.0}) {
    SyntheticPair pair = MakeSyntheticPair({}, 4);
    pair.matches[100].uv1_px.x() = bad;
    const StaticSelection selection = Make()->Select(pair.matches, pair.camera, 1);
    EXPECT_EQ(selection.refusal, Refusal::kBadInput) << bad;
    EXPECT_NE(selection.explanation.find("100"), std::string::npos);
    EXPECT_EQ(selection.F.norm(), 0.0);
  }
}

TEST_P(EverySelector, RefusesMatchesInOneCell) {
  const SyntheticPair whole = MakeSyntheticPair({}, 10);
  for (const double left : {0.0, 250.0}) {  // a cell, and where four meet
    SyntheticPair pair = whole;
    std::erase_if(pair.matches, [left](const Match& m) {
      return m.uv0_px.x() < left || m.uv0_px.y() < left || m.uv0_px.x() > left + 155 ||
             m.uv0_px.y() > left + 155;
    });
    ASSERT_GE(pair.matches.size(), 16U);
    const StaticSelection selection = Make()->Select(pair.matches, pair.camera, 1);
    EXPECT_EQ(selection.refusal, Refusal::kTooFewCells);
    EXPECT_FALSE(selection.explanation.empty());
    EXPECT_EQ(selection.num_static, 0);
    EXPECT_EQ(selection.F.norm(), 0.0);
  }
}

TEST_P(EverySelector, RefusesIdenticalFrames) {
  SyntheticPair pair = MakeSyntheticPair({}, 5);
  for (Match& match : pair.matches) match.uv1_px = match.uv0_px;
  EXPECT_EQ(Make()->Select(pair.matches, pair.camera, 1).refusal, Refusal::kNoMotion);
}

TEST_P(EverySelector, NeverThrowsForNoise) {
  SyntheticPairOptions options;
  options.num_static = 0;
  options.num_mismatches = 300;
  const SyntheticPair pair = MakeSyntheticPair(options, 6);
  EXPECT_NO_THROW(Make()->Select(pair.matches, pair.camera, 1));
  std::vector<Match> same(50, pair.matches[0]);
  EXPECT_NO_THROW(Make()->Select(same, pair.camera, 1));
}

INSTANTIATE_TEST_SUITE_P(All, EverySelector,
                         testing::Values(std::pair{"dlrsac", ModelKind::kEssential},
                                         std::pair{"dlrsac-paper", ModelKind::kFundamental},
                                         std::pair{"ransac", ModelKind::kFundamental},
                                         std::pair{"ransac", ModelKind::kEssential},
                                         std::pair{"arsac", ModelKind::kFundamental},
                                         std::pair{"arsac", ModelKind::kEssential}));

TEST(Dlrsac, PrefersTheWideMotionToTheOneWithMostMatches) {
  SyntheticPairOptions options;
  options.num_static = 260;
  options.num_moving = 500;  // two thirds of the matches, on a third of the picture
  int ransac_fooled = 0;
  for (const uint64_t seed : {1, 2, 3, 4, 5}) {
    const SyntheticPair pair = MakeSyntheticPair(options, seed);
    const StaticSelection dlrsac = Dlrsac(DlrsacOptions()).Select(pair.matches, pair.camera, seed);
    ASSERT_TRUE(dlrsac.IsUsable()) << dlrsac.explanation;
    EXPECT_GT(ScoreOf(pair, dlrsac).precision, 0.95) << seed;
    const StaticSelection ransac =
        RansacSelector(RansacSelectorOptions()).Select(pair.matches, pair.camera, seed);
    ransac_fooled += ScoreOf(pair, ransac).precision < 0.5 ? 1 : 0;
  }
  EXPECT_GE(ransac_fooled, 4) << "the scene does not tell the methods apart";
}

TEST(Dlrsac, FindsTheMotion) {
  const SyntheticPair pair = MakeSyntheticPair({}, 8);
  const StaticSelection selection = Dlrsac(DlrsacOptions()).Select(pair.matches, pair.camera, 8);
  ASSERT_TRUE(selection.IsUsable());
  double nearest = 1e9;
  for (const Rigid3d& pose : DecomposeEssential(selection.E)) {
    nearest =
        std::min(nearest, AngleBetween(pose.rotation, pair.T_1_0.rotation) +
                              (pose.translation.normalized() - pair.T_1_0.translation.normalized()).norm());
  }
  EXPECT_LT(nearest, 0.05);
}

TEST(Dlrsac, ReportsCellsAndCoupleMatrix) {
  SyntheticPairOptions options;
  options.num_static = 800;
  const SyntheticPair pair = MakeSyntheticPair(options, 9);
  const StaticSelection selection = Dlrsac(DlrsacOptions()).Select(pair.matches, pair.camera, 9);
  ASSERT_EQ(selection.cells.size(), 12U);
  EXPECT_EQ(selection.columns, 4);
  EXPECT_EQ(selection.rows, 3);
  ASSERT_EQ(selection.couple.rows(), 12);
  int matches = 0;
  for (size_t k = 0; k < 12; ++k) {
    matches += selection.cells[k].num_matches;
    const auto i = static_cast<Eigen::Index>(k);
    if (selection.cells[k].num_inliers > 0 && selection.cells[k].state != CellState::kPureRotation) {
      EXPECT_DOUBLE_EQ(selection.couple(i, i), 1.0) << "a cell couples with itself";
    }
  }
  EXPECT_EQ(matches, 800);
  ASSERT_TRUE(selection.leading_cell.has_value());
  EXPECT_TRUE(selection.cells[static_cast<size_t>(*selection.leading_cell)].chosen);
}

TEST(Dlrsac, RefusesACompactSet) {
  DlrsacOptions options;
  options.min_distribution_share = 0.5;
  const SyntheticPair pair = MakeSyntheticPair({}, 11);
  EXPECT_EQ(Dlrsac(options).Select(pair.matches, pair.camera, 1).refusal, Refusal::kDistributionTooSmall);
}

TEST(Dlrsac, RefusesTwoMotionsThatAreEquallyWideAndNumerous) {
  const auto make = [](int num_others) {
    SyntheticPairOptions options;
    options.num_static = 300;
    SyntheticPair pair = MakeSyntheticPair(options, 16);
    options.num_static = num_others;  // as wide as the first, with another motion
    options.rotation = {-0.02, -0.01, 0.02};
    options.translation = {-0.05, 0.15, 0.02};
    const SyntheticPair others = MakeSyntheticPair(options, 17);
    pair.matches.insert(pair.matches.end(), others.matches.begin(), others.matches.end());
    pair.truth.resize(pair.matches.size(), 0);
    return pair;
  };
  const SyntheticPair even = make(300);
  const StaticSelection refused = Dlrsac(DlrsacOptions()).Select(even.matches, even.camera, 1);
  EXPECT_EQ(refused.refusal, Refusal::kAmbiguous) << ToString(refused.refusal);
  EXPECT_FALSE(refused.explanation.empty());
  EXPECT_EQ(refused.E.norm(), 0.0);
  EXPECT_EQ(refused.num_static, 0);
  EXPECT_EQ(refused.is_static, std::vector<uint8_t>(even.matches.size(), 0));

  const SyntheticPair clear = make(100);
  const StaticSelection accepted = Dlrsac(DlrsacOptions()).Select(clear.matches, clear.camera, 1);
  ASSERT_TRUE(accepted.IsUsable()) << accepted.explanation;
  EXPECT_GT(ScoreOf(clear, accepted).precision, 0.9);
  EXPECT_GT(ScoreOf(clear, accepted).recall, 0.9);

  DlrsacOptions unasked;
  unasked.max_rival_share = 0;
  EXPECT_TRUE(Dlrsac(unasked).Select(even.matches, even.camera, 1).IsUsable());
}

/// A static scene in two layers of depth: a desk close to the camera, a wall far behind it.
SyntheticPair DeskBeforeWall(int num_near, int num_far, uint64_t seed) {
  const SyntheticPairOptions options;
  SyntheticPair pair;
  pair.camera = SyntheticCamera();
  pair.T_1_0 = Rigid3d(ExpSo3(options.rotation), options.translation);
  Random random(DeriveSeed(seed, 0, "desk-before-wall"));
  const auto add = [&](int count, double low, double high) {
    for (int k = 0; k < count;) {
      const Eigen::Vector3d ray = pair.camera.Ray({random.Uniform(0, 639), random.Uniform(0, 479)});
      const Eigen::Vector3d point = random.Uniform(low, high) * ray;
      k += synthetic_pair_detail::Add(options, point, Eigen::Vector3d::Zero(), true, &random, &pair) ? 1 : 0;
    }
  };
  add(num_near, 1.2, 2.0);
  add(num_far, 6.0, 6.2);
  return pair;
}

TEST(Dlrsac, RefusesOneMotionInTwoLayersOfEqualStrength) {
  for (const uint64_t seed : {1, 2, 3}) {
    const SyntheticPair even = DeskBeforeWall(300, 300, seed);
    const StaticSelection refused = Dlrsac(DlrsacOptions()).Select(even.matches, even.camera, seed);
    EXPECT_EQ(refused.refusal, Refusal::kAmbiguous) << ToString(refused.refusal);
    EXPECT_NE(refused.explanation.find("depth layer has 0."), std::string::npos) << refused.explanation;
    EXPECT_NE(refused.explanation.find(" 0.50 allowed"), std::string::npos) << refused.explanation;

    for (const bool near : {true, false}) {
      const SyntheticPair clear = DeskBeforeWall(near ? 480 : 120, near ? 120 : 480, seed);
      const StaticSelection accepted = Dlrsac(DlrsacOptions()).Select(clear.matches, clear.camera, seed);
      EXPECT_TRUE(accepted.IsUsable()) << near << ' ' << accepted.explanation;
    }
  }
}

TEST(Dlrsac, RefusesOptionsOutOfRange) {
  DlrsacOptions options;
  options.max_rival_share = 1.5;
  EXPECT_THROW(Dlrsac{options}, InputError);
  EXPECT_NO_THROW(DlrsacOptions().Check());
  EXPECT_NO_THROW(DlrsacOptions::Paper().Check());
}

TEST(Dlrsac, TellsDegenerateCells) {
  const auto share = [](const SyntheticPair& pair, CellState state) {
    const StaticSelection selection = Dlrsac(DlrsacOptions()).Select(pair.matches, pair.camera, 1);
    int found = 0, fitted = 0;
    for (const CellReport& cell : selection.cells) {
      fitted += cell.num_inliers > 0 ? 1 : 0;
      found += cell.state == state ? 1 : 0;
    }
    return found / static_cast<double>(std::max(1, fitted));
  };
  SyntheticPairOptions options;
  options.num_static = 800;
  options.noise_px = 0.3;
  EXPECT_GT(share(MakeSyntheticPair(options, 12), CellState::kGeneral), 0.7);
  // A cell of a plane far away looks as a rotation makes it look, which is the stronger statement.
  options.flat = true;
  const SyntheticPair plane = MakeSyntheticPair(options, 12);
  EXPECT_GT(share(plane, CellState::kPlane) + share(plane, CellState::kPureRotation), 0.7);
  options.translation = {0.1, 0.05, 0.6};  // forwards: each cell grows, which no rotation does
  const SyntheticPair near_plane = MakeSyntheticPair(options, 12);
  EXPECT_GT(share(near_plane, CellState::kPlane), 0.7);
  EXPECT_EQ(share(near_plane, CellState::kGeneral), 0.0);
  options.flat = false;
  options.translation.setZero();
  EXPECT_GT(share(MakeSyntheticPair(options, 12), CellState::kPureRotation), 0.7);
}

TEST(Dlrsac, CollinearCellsDoNotVote) {
  SyntheticPairOptions options;
  options.num_static = 2000;
  SyntheticPair pair = MakeSyntheticPair(options, 13);
  std::erase_if(pair.matches, [](const Match& m) {
    return std::abs(m.uv0_px.y() - 80) > 2 && std::abs(m.uv0_px.y() - 240) > 2 &&
           std::abs(m.uv0_px.y() - 400) > 2;
  });
  DlrsacOptions dlrsac;
  dlrsac.min_cell_matches = 5;
  const StaticSelection selection = Dlrsac(dlrsac).Select(pair.matches, pair.camera, 1);
  for (const CellReport& cell : selection.cells) {
    if (cell.num_inliers > 0) {
      EXPECT_EQ(cell.state, CellState::kCollinear);
    }
  }
  EXPECT_FALSE(selection.leading_cell.has_value());
  EXPECT_FALSE(selection.IsUsable());
}

TEST(Dlrsac, DropsWhatMovesAlongItsEpipolarLines) {
  SyntheticPairOptions options;
  options.num_moving = 150;
  options.rotation.setZero();
  options.translation = {0.08, 0, 0};
  options.mover_motion = {0.4, 0, 0};  // parallel to the camera's way: the epipolar geometry cannot tell
  const SyntheticPair pair = MakeSyntheticPair(options, 14);
  DlrsacOptions without;
  without.layers.enabled = false;
  EXPECT_LT(ScoreOf(pair, Dlrsac(without).Select(pair.matches, pair.camera, 1)).precision, 0.85);
  EXPECT_GT(ScoreOf(pair, Dlrsac(DlrsacOptions()).Select(pair.matches, pair.camera, 1)).precision, 0.98);
}

TEST(Dlrsac, StopsEarlyByEquationFour) {
  const SyntheticPair pair = MakeSyntheticPair({}, 15);
  DlrsacOptions options;
  options.sampling.stop_confidence = 0;
  EXPECT_GT(Dlrsac(options).Select(pair.matches, pair.camera, 1).iterations, 1900);
  options.sampling.stop_confidence = 0.99;
  EXPECT_LT(Dlrsac(options).Select(pair.matches, pair.camera, 1).iterations, 1000);
}

TEST(MakeSelector, RefusesUnknownNames) {
  EXPECT_THROW(MakeSelector("magsac", ModelKind::kEssential), InputError);
}

}  // namespace
}  // namespace dmslam
