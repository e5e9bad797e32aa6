// Which frames become a pair, and what is made of it; initializer_test.cc has the same on scenes.
#include "dmslam/initialization/two_frame_initializer.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

constexpr int64_t kFrameNs = 33'333'333;

/// A row of things that look like nothing else, some of which a frame shows.
class ThingsTest : public ::testing::Test {
 protected:
  ThingsTest() : things_(500) {
    Random random(3);
    for (Descriptor& descriptor : things_) {
      for (uint64_t& word : descriptor.words) word = random.Next();
    }
  }

  /// Shows `count` of the things, in order or in the opposite one.
  InitializerFrame Frame(uint32_t index, size_t first, size_t count, bool backwards = false) const {
    auto features = std::make_shared<FrameFeatures>();
    for (size_t k = 0; k < count; ++k) {
      const size_t thing = backwards ? first + count - 1 - k : first + k;
      const Eigen::Vector2d uv(20.0 * static_cast<double>(1 + thing % 30),
                               20.0 * static_cast<double>(1 + thing / 30));
      features->set.keypoints.push_back(
          {static_cast<uint16_t>(16 * uv.x()), static_cast<uint16_t>(16 * uv.y()), 0, 0});
      features->set.descriptors.push_back(things_[thing]);
      features->uv_px.push_back(uv);
    }
    const Camera camera = SyntheticCamera();
    features->grid.Build(features->uv_px, features->set.keypoints, camera.width_px, camera.height_px);
    return {index, index * kFrameNs, features};
  }
  TwoFrameInitializer Make(const TwoFrameOptions& options = {}, uint64_t seed = 1) {
    return {options, SyntheticCamera(),
            [this](std::span<const Match> matches, uint64_t pair_seed) {
              seeds_.push_back(pair_seed);
              return Reconstruct(matches);
            },
            seed};
  }
  /// A point for every other match, told apart by its depth; or a refusal.
  TwoViewReconstruction Reconstruct(std::span<const Match> matches) const {
    TwoViewReconstruction map;
    map.T_1_0.translation = {1, 0, 0};
    map.median_parallax_rad = 0.05;
    map.has_point.resize(matches.size());
    map.points_cam0.resize(matches.size());
    for (size_t i = 0; i < matches.size(); i += 2) {
      map.has_point[i] = 1;
      map.points_cam0[i] = {0, 0, 1.0 + matches[i].index0};
    }
    if (refuse_) {
      map.refusal = ReconstructionRefusal::kAmbiguous;
      map.explanation = "two poses";
    }
    return map;
  }
  size_t num_pairs() const { return seeds_.size(); }

  std::vector<Descriptor> things_;
  bool refuse_ = false;
  std::vector<uint64_t> seeds_;  ///< of the pairs that were to be reconstructed
};

TEST_F(ThingsTest, AMapIsMadeOfThePointsOfAPair) {
  TwoFrameInitializer initializer = Make();
  const InitializerReport first = initializer.AddFrame(Frame(0, 0, 200));
  EXPECT_EQ(first.wait, WaitReason::kTooFewFrames);
  EXPECT_FALSE(first.result);
  const InitializerReport report = initializer.AddFrame(Frame(1, 0, 200, true));
  EXPECT_EQ(report.wait, WaitReason::kNone);
  EXPECT_EQ(report.num_matches, 200);
  ASSERT_TRUE(report.result);
  const FirstMap& map = *report.result;
  EXPECT_EQ(map.frame0.index, 0U);
  EXPECT_EQ(map.frame1.index, 1U);
  EXPECT_EQ(map.T_1_0.translation.x(), 1.0);
  EXPECT_EQ(map.median_parallax_rad, 0.05);
  EXPECT_EQ(map.num_views, 2);
  EXPECT_EQ(map.matches.size(), 200U);
  ASSERT_EQ(map.points.size(), 100U);
  for (size_t k = 0; k < map.points.size(); ++k) {
    EXPECT_EQ(map.points[k].feature0, 2 * k) << "sorted";
    EXPECT_EQ(map.points[k].feature1, 199 - 2 * k) << "the same thing";
    EXPECT_EQ(map.points[k].p_world.z(), 1.0 + static_cast<double>(2 * k));
  }
}

TEST_F(ThingsTest, TheReferenceStaysUntilAPairGivesAMapAndThenTheNextFrameIsIt) {
  TwoFrameInitializer initializer = Make();
  refuse_ = true;
  initializer.AddFrame(Frame(0, 0, 200));
  for (const uint32_t index : {1U, 2U}) {
    const InitializerReport report = initializer.AddFrame(Frame(index, 0, 200));
    EXPECT_EQ(report.wait, WaitReason::kNoReconstruction);
    EXPECT_EQ(report.reason, "two poses");
    EXPECT_EQ(report.num_matches, 200);
    EXPECT_FALSE(report.result);
  }
  refuse_ = false;
  const InitializerReport report = initializer.AddFrame(Frame(3, 0, 200));
  ASSERT_TRUE(report.result);
  EXPECT_EQ(report.result->frame0.index, 0U);
  EXPECT_EQ(initializer.AddFrame(Frame(4, 0, 200)).wait, WaitReason::kTooFewFrames);
  ASSERT_TRUE(initializer.AddFrame(Frame(5, 0, 200)).result);
  EXPECT_EQ(num_pairs(), 4U);
}

TEST_F(ThingsTest, AFrameThatShowsTooLittleOfTheReferenceBecomesTheReference) {
  TwoFrameInitializer initializer = Make();
  initializer.AddFrame(Frame(0, 0, 200));
  EXPECT_EQ(initializer.AddFrame(Frame(1, 101, 200)).wait, WaitReason::kTooFewMatches) << "99 of them";
  EXPECT_EQ(num_pairs(), 0U);
  const InitializerReport report = initializer.AddFrame(Frame(2, 201, 200));
  ASSERT_TRUE(report.result) << report.reason;
  EXPECT_EQ(report.num_matches, 100);
  EXPECT_EQ(report.result->frame0.index, 1U);
}

TEST_F(ThingsTest, AFrameOfTooFewFeaturesEndsTheReferenceAndIsNone) {
  TwoFrameInitializer initializer = Make();
  initializer.AddFrame(Frame(0, 0, 99));
  EXPECT_FALSE(initializer.AddFrame(Frame(1, 0, 200)).result);
  EXPECT_EQ(initializer.AddFrame(Frame(2, 0, 99)).wait, WaitReason::kTooFewFeatures);
  EXPECT_EQ(initializer.AddFrame(Frame(2, 0, 99)).wait, WaitReason::kTooFewFeatures) << "without one, too";
  EXPECT_EQ(initializer.AddFrame(Frame(3, 0, 100)).wait, WaitReason::kTooFewFrames);
  const InitializerReport report = initializer.AddFrame(Frame(4, 0, 200));
  ASSERT_TRUE(report.result) << report.reason;
  EXPECT_EQ(report.result->frame0.index, 3U);
  EXPECT_EQ(num_pairs(), 1U);
}

TEST_F(ThingsTest, FramesNearerThanAskedAreNoPairAndChangeNothing) {
  TwoFrameOptions options;
  options.min_gap_s = 0.09;
  TwoFrameInitializer initializer = Make(options);
  for (const uint32_t index : {0U, 1U, 2U}) {
    EXPECT_EQ(initializer.AddFrame(Frame(index, 0, 200)).wait, WaitReason::kTooFewFrames);
  }
  EXPECT_EQ(num_pairs(), 0U);
  const InitializerReport report = initializer.AddFrame(Frame(3, 0, 200));
  ASSERT_TRUE(report.result);
  EXPECT_EQ(report.result->frame0.index, 0U);
}

TEST_F(ThingsTest, EachFrameHasASeedOfItsOwnThatFollowsFromTheGivenOne) {
  refuse_ = true;
  for (const uint64_t seed : {1, 1, 2}) {
    TwoFrameInitializer initializer = Make({}, seed);
    for (uint32_t index = 0; index < 4; ++index) initializer.AddFrame(Frame(index, 0, 200));
  }
  ASSERT_EQ(num_pairs(), 9U);
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(seeds_[k], seeds_[3 + k]);
  EXPECT_EQ(std::set(seeds_.begin(), seeds_.end()).size(), 6U);
}

/// The room is far off but for a few things: ORB-SLAM2's measure, the 50th largest, is content.
TEST(ReconstructByPaper, AsksForAMeanParallax) {
  const auto pair_of = [](double far) {
    SyntheticPairOptions options;
    options.noise_px = 0.02;
    options.translation = {0.2, 0.02, 0.05};
    options.num_static = 0;
    SyntheticPair pair = MakeSyntheticPair(options, 41);
    Random random(42);
    for (int k = 0; k < 500;) {
      const double x = random.Uniform(0, 639), y = random.Uniform(0, 479);
      const double depth = random.Uniform(2.0, 4.0) * (k % 5 == 0 ? 1.0 : far);
      k += synthetic_pair_detail::Add(options, depth * pair.camera.Ray({x, y}), Eigen::Vector3d::Zero(), true,
                                      &random, &pair)
               ? 1
               : 0;
    }
    return pair;
  };
  const SyntheticPair near = pair_of(1.0), far = pair_of(20.0);
  const TwoViewReconstruction map = ReconstructByPaper(near.camera)(near.matches, 1);
  EXPECT_TRUE(map.IsUsable()) << map.explanation;
  const TwoViewReconstruction refused = ReconstructByPaper(far.camera)(far.matches, 1);
  EXPECT_EQ(refused.refusal, ReconstructionRefusal::kParallaxTooSmall) << ToString(refused.refusal);
  EXPECT_GT(refused.parallax_rad, ReconstructionOptions().min_parallax_rad);
  EXPECT_NE(refused.explanation.find("mean parallax"), std::string::npos) << refused.explanation;
}

TEST(ReconstructByPaper, RefusesWhatItsSelectorRefuses) {
  SyntheticPairOptions options;
  options.num_static = 7;
  const SyntheticPair pair = MakeSyntheticPair(options, 43);
  const TwoViewReconstruction map = ReconstructByPaper(pair.camera)(pair.matches, 1);
  EXPECT_EQ(map.refusal, ReconstructionRefusal::kNoModel);
  EXPECT_FALSE(map.explanation.empty());
}

/// A pair whose keypoints err as those of a coarse level do.
TEST(ReconstructByRansac, GoesByTheGivenPyramid) {
  SyntheticPairOptions options;
  options.noise_px = 1.0;
  SyntheticPair pair = MakeSyntheticPair(options, 44);
  for (Match& match : pair.matches) match.octave0 = match.octave1 = 4;
  const auto points = [&](double scale_factor) {
    Pyramid pyramid;
    pyramid.scale_factor = scale_factor;
    return ReconstructByRansac(pair.camera, pyramid)(pair.matches, 1).num_points;
  };
  EXPECT_GT(points(2.0), points(1.05) + 20);
}

}  // namespace
}  // namespace dmslam
