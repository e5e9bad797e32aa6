#include "dmslam/features/matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "dmslam/features/testing/allocation_counter.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

Descriptor RandomDescriptor(Random* random) {
  return {{random->Next(), random->Next(), random->Next(), random->Next()}};
}

/// The descriptor with its first `count` bits turned over.
Descriptor WithFlippedBits(Descriptor descriptor, int count) {
  for (int i = 0; i < count; ++i) descriptor.words[static_cast<size_t>(i / 64)] ^= 1ULL << (i % 64);
  return descriptor;
}

/// An image's features with their pixels and index.
struct Image {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  std::vector<Eigen::Vector2d> uv_px;
  FeatureGrid grid;

  void Add(double x, double y, int octave, int angle, const Descriptor& descriptor) {
    keypoints.push_back({static_cast<uint16_t>(x * 16), static_cast<uint16_t>(y * 16),
                         static_cast<uint8_t>(octave), static_cast<uint8_t>(angle)});
    descriptors.push_back(descriptor);
    uv_px.emplace_back(x, y);
  }
  void Index() { grid.Build(uv_px, keypoints, 640, 480); }
  MatchSide Side() const { return {keypoints, descriptors, uv_px}; }
};

/// `count` random features, and the same ones moved by (8, -5), turned by 10 steps, with some bits flipped.
std::pair<Image, Image> RandomPair(int count, uint64_t seed) {
  Random random(DeriveSeed(seed, 0, "matcher test"));
  Image a, b;
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(20, 600), y = random.Uniform(20, 460);
    const int octave = static_cast<int>(random.Below(8)), angle = static_cast<int>(random.Below(256));
    const Descriptor descriptor = RandomDescriptor(&random);
    a.Add(x, y, octave, angle, descriptor);
    b.Add(x + 8, y - 5, octave, angle + 10, WithFlippedBits(descriptor, static_cast<int>(random.Below(40))));
  }
  a.Index();
  b.Index();
  return {a, b};
}

TEST(FeatureGrid, FindsWhatExhaustiveSearchFinds) {
  Random random(3);
  Image image;
  for (int i = 0; i < 500; ++i) {
    image.Add(random.Uniform(0, 640), random.Uniform(0, 480), static_cast<int>(random.Below(8)), 0, {});
    if (i % 50 == 0) image.uv_px.back() += Eigen::Vector2d(-700, 300);  // undistorted to outside
  }
  image.Index();
  std::vector<uint32_t> found;
  for (int query = 0; query < 200; ++query) {
    const Eigen::Vector2d center(random.Uniform(-100, 740), random.Uniform(-100, 580));
    const double radius = random.Uniform(0, 150);
    image.grid.FindInRadius(center, radius, 2, 5, &found);
    std::vector<uint32_t> expected;
    for (uint32_t i = 0; i < 500; ++i) {
      const int octave = image.keypoints[i].octave;
      if ((image.uv_px[i] - center).norm() <= radius && octave >= 2 && octave <= 5) expected.push_back(i);
    }
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
  }
  image.grid.FindInRadius(image.uv_px[0], 1.0, 0, 7, &found);  // one outside the image
  EXPECT_NE(std::find(found.begin(), found.end(), 0U), found.end());
}

TEST(FeatureGrid, ListsAndBatchesAreTheSameInTheSameOrderOnEveryPath) {
  Random random(4);
  Image image;
  for (int i = 0; i < 1500; ++i) {  // half of them crowded
    const double spread = i % 2 == 0 ? 640 : 90;
    image.Add(random.Uniform(0, spread), random.Uniform(0, 0.75 * spread), static_cast<int>(random.Below(8)),
              0, {});
  }
  image.Index();
  std::vector<uint32_t> expected, list(1500 + FeatureGrid::kSlack), batched;
  size_t most = 0;
  for (int query = 0; query < 300; ++query) {
    const Eigen::Vector2d center(random.Uniform(-20, 660), random.Uniform(-20, 500));
    const double radius = random.Uniform(0, query % 3 == 0 ? 200 : 40);
    const int least = static_cast<int>(random.Below(8)), last = least + static_cast<int>(random.Below(4));
    image.grid.FindInRadius(center, radius, least, last, &expected);
    most = std::max(most, expected.size());
    for (const VectorPath path : VectorPaths()) {
      const size_t count = image.grid.CollectInRadius(center, radius, least, last, list.data(), path);
      EXPECT_EQ(std::vector<uint32_t>(list.begin(), list.begin() + static_cast<ptrdiff_t>(count)), expected);
    }
    batched.clear();
    image.grid.ForEachBatchInRadius(center, radius, least, last, [&](std::span<uint32_t> batch) {
      EXPECT_FALSE(batch.empty());
      EXPECT_LE(batch.size(), FeatureGrid::kBatch);
      batched.insert(batched.end(), batch.begin(), batch.end());
      std::fill(batch.begin(), batch.end(), 0U);  // who is given it may write there
    });
    EXPECT_EQ(batched, expected);
  }
  EXPECT_GT(most, FeatureGrid::kBatch);
}

TEST(FeatureGrid, QueriesThatAskForNothing) {
  Image image;
  std::vector<uint32_t> found = {1};
  image.Index();
  image.grid.FindInRadius({10, 10}, 100, 0, 7, &found);
  EXPECT_TRUE(found.empty());
  image.Add(10, 10, 0, 0, {});
  image.Index();
  FeatureGrid().FindInRadius({10, 10}, 100, 0, 7, &found);
  EXPECT_TRUE(found.empty());
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    image.grid.FindInRadius({10, 10}, bad, 0, 7, &found);
    EXPECT_TRUE(found.empty());
    image.grid.FindInRadius({std::numeric_limits<double>::quiet_NaN(), 10}, 5, 0, 7, &found);
    EXPECT_TRUE(found.empty());
  }
  image.grid.FindInRadius({10, 10}, 0.0, 0, 0, &found);
  EXPECT_EQ(found.size(), 1U);
}

TEST(Hamming, CountsFromNoneToAll) {
  Descriptor a, b;
  EXPECT_EQ(HammingDistance(a, b), 0);
  for (int bit = 0; bit < 256; ++bit) {
    b.words[static_cast<size_t>(bit / 64)] |= uint64_t{1} << (bit % 64);
    EXPECT_EQ(HammingDistance(a, b), bit + 1);
  }
}

TEST(Hamming, PathsAgree) {
  Random random(4);
  std::vector<Descriptor> descriptors;
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i < 100; ++i) {
    descriptors.push_back(RandomDescriptor(&random));
    indices.push_back(random.Below(i + 1));
  }
  for (const HammingKernels* kernels : UsableHammingKernels()) {
    for (const int count : {0, 1, 4, 99, 100}) {
      const auto n = static_cast<size_t>(count);
      std::vector<uint16_t> indexed(n), ranged(n);
      kernels->to_indexed(descriptors[7], descriptors.data(), indices.data(), count, indexed.data());
      kernels->to_range(descriptors[7], descriptors.data(), count, ranged.data());
      for (size_t i = 0; i < n; ++i) {
        EXPECT_EQ(indexed[i], HammingDistance(descriptors[7], descriptors[indices[i]]));
        EXPECT_EQ(ranged[i], HammingDistance(descriptors[7], descriptors[i]));
      }
    }
    for (const int limit : {0, 60, 120, 128, 135, 256}) {
      std::vector<uint32_t> near = indices, expected;
      std::vector<uint16_t> distances(100);
      const int kept =
          kernels->keep_near(descriptors[7], descriptors.data(), near.data(), 100, limit, distances.data());
      for (const uint32_t index : indices) {
        if (HammingDistance(descriptors[7], descriptors[index]) <= limit) expected.push_back(index);
      }
      near.resize(static_cast<size_t>(kept));
      EXPECT_EQ(near, expected) << limit;
      for (size_t i = 0; i < near.size(); ++i)
        EXPECT_EQ(distances[i], HammingDistance(descriptors[7], descriptors[near[i]]));
    }
  }
}

TEST(FeatureMatcher, FindsTrueMatchesInAWindow) {
  const auto [a, b] = RandomPair(400, 1);
  std::vector<FeatureMatch> matches;
  FeatureMatcher().MatchWindow(a.Side(), b.Side(), b.grid, {}, &matches);
  EXPECT_EQ(matches.size(), 400U);
  for (const FeatureMatch& m : matches) {
    EXPECT_EQ(m.index0, m.index1);
    EXPECT_EQ(m.distance, HammingDistance(a.descriptors[m.index0], b.descriptors[m.index1]));
  }
  EXPECT_TRUE(std::is_sorted(matches.begin(), matches.end()));

  WindowMatchOptions narrow;
  narrow.window_px = 9.0;  // the move is 9.4 px
  FeatureMatcher().MatchWindow(a.Side(), b.Side(), b.grid, narrow, &matches);
  EXPECT_TRUE(matches.empty());
  std::vector<Eigen::Vector2d> predicted = a.uv_px;
  for (Eigen::Vector2d& uv : predicted) uv += Eigen::Vector2d(8, -5);
  FeatureMatcher().MatchWindow(a.Side(), b.Side(), b.grid, narrow, &matches, predicted);
  EXPECT_EQ(matches.size(), 400U);
}

TEST(FeatureMatcher, AsksForNeighbouringOctaves) {
  auto [a, b] = RandomPair(8, 2);
  for (size_t i = 0; i < 8; ++i) {
    a.keypoints[i].octave = 3;
    b.keypoints[i].octave = static_cast<uint8_t>(i);
  }
  b.Index();
  std::vector<FeatureMatch> matches;
  FeatureMatcher().MatchWindow(a.Side(), b.Side(), b.grid, {}, &matches);
  ASSERT_EQ(matches.size(), 3U);
  EXPECT_EQ(matches[0].index0, 2U);
  EXPECT_EQ(matches[2].index0, 4U);
  WindowMatchOptions finest_only;
  finest_only.max_octave0 = 2;
  FeatureMatcher().MatchWindow(a.Side(), b.Side(), b.grid, finest_only, &matches);
  EXPECT_TRUE(matches.empty());
}

TEST(FeatureMatcher, RefusesWhatIsNotClearlyBest) {
  Random random(5);
  const Descriptor d = RandomDescriptor(&random);
  Image a, b;
  a.Add(100, 100, 0, 0, d);
  b.Add(102, 100, 0, 0, WithFlippedBits(d, 18));
  b.Add(104, 100, 0, 0, WithFlippedBits(d, 20));
  b.Index();
  FeatureMatcher matcher;
  std::vector<FeatureMatch> matches;
  MatchOptions options{.max_distance = 50, .max_ratio = 0.9};
  matcher.MatchAll(a.Side(), b.Side(), options, &matches);
  EXPECT_TRUE(matches.empty()) << "18 is not below 0.9 * 20";
  options.max_ratio = 0.91;
  matcher.MatchAll(a.Side(), b.Side(), options, &matches);
  EXPECT_EQ(matches, (std::vector<FeatureMatch>{{0, 0, 18}}));
  options.max_distance = 17;
  matcher.MatchAll(a.Side(), b.Side(), options, &matches);
  EXPECT_TRUE(matches.empty());
}

TEST(FeatureMatcher, TiesGoToTheSmallerIndex) {
  const Descriptor d{};
  Image a, b;
  for (int i = 0; i < 3; ++i) a.Add(100 + i, 100, 0, 0, d);
  for (int i = 0; i < 3; ++i) b.Add(130 - 20 * i, 100, 0, 0, d);  // the later, the earlier in the grid
  b.Index();
  const MatchOptions options{.max_distance = 50, .max_ratio = 1.0};
  std::vector<FeatureMatch> matches;
  FeatureMatcher matcher;
  matcher.MatchAll(a.Side(), b.Side(), options, &matches);
  EXPECT_EQ(matches, (std::vector<FeatureMatch>{{0, 0, 0}}));
  matcher.MatchWindow(a.Side(), b.Side(), b.grid, {.match = options}, &matches);
  EXPECT_EQ(matches, (std::vector<FeatureMatch>{{0, 0, 0}}));
  EXPECT_EQ(matcher.FindMatch(d, {{110, 100}, 100.0}, b.Side(), b.grid, 50, 1.0)->index1, 0U);
}

TEST(FeatureMatcher, MutualAsksTheSecondImageToo) {
  Random random(6);
  const Descriptor d = RandomDescriptor(&random);
  Image a, b;
  a.Add(100, 100, 0, 0, WithFlippedBits(d, 10));  // its best is b0, and the ratio test holds
  a.Add(110, 100, 0, 0, d);                       // b0's best is this one, which itself fails the ratio test
  b.Add(105, 100, 0, 0, d);
  b.Add(115, 100, 0, 0, d);
  b.descriptors[1].words[3] ^= 7;
  b.Index();
  MatchOptions options{.max_distance = 50, .max_ratio = 0.8, .check_orientation = false, .mutual = true};
  const std::vector<uint8_t> only_first = {1, 0};
  MatchSide side_b = b.Side();
  side_b.usable = only_first;
  std::vector<FeatureMatch> matches;
  FeatureMatcher().MatchAll(a.Side(), side_b, options, &matches);
  EXPECT_EQ(matches, (std::vector<FeatureMatch>{{1, 0, 0}})) << "two want the same: the nearer one gets it";
  options.mutual = false;
  options.max_distance = 10;
  MatchSide side_a = a.Side();
  side_a.usable = only_first;
  FeatureMatcher().MatchAll(side_a, side_b, options, &matches);
  EXPECT_EQ(matches, (std::vector<FeatureMatch>{{0, 0, 10}}));
}

TEST(FeatureMatcher, MatchesWithinGroupsOnly) {
  const auto [a, b] = RandomPair(300, 7);
  std::vector<GroupedFeature> groups_a, groups_b;
  for (uint32_t i = 0; i < 300; ++i) {
    groups_a.push_back({i % 17, i});
    groups_b.push_back({i % 5 == 0 ? 100 + i % 3 : i % 17, i});
  }
  std::sort(groups_a.begin(), groups_a.end());
  std::sort(groups_b.begin(), groups_b.end());
  std::vector<FeatureMatch> matches;
  FeatureMatcher().MatchGroups(a.Side(), groups_a, b.Side(), groups_b, {}, &matches);
  EXPECT_EQ(matches.size(), 240U);
  for (const FeatureMatch& m : matches) {
    EXPECT_EQ(m.index0, m.index1);
    EXPECT_NE(m.index0 % 5, 0U);
  }
  FeatureMatcher().MatchGroups(a.Side(), {}, b.Side(), groups_b, {}, &matches);
  EXPECT_TRUE(matches.empty());
}

TEST(FeatureMatcher, FindsTheFeatureOfAProjection) {
  Random random(8);
  const Descriptor d = RandomDescriptor(&random);
  Image b;
  b.Add(200, 200, 2, 0, WithFlippedBits(d, 12));
  b.Add(203, 200, 3, 0, WithFlippedBits(d, 13));  // the same corner one octave up: no rival
  b.Add(260, 200, 2, 0, d);                       // out of reach
  b.Add(201, 201, 5, 0, d);                       // of another octave
  b.Index();
  FeatureMatcher matcher;
  const SearchArea area{{201, 200}, 10.0, 2, 3};
  const auto nearest = matcher.FindNearest(d, area, b.Side(), b.grid);
  ASSERT_TRUE(nearest);
  EXPECT_EQ(nearest->index, 0U);
  EXPECT_EQ(nearest->distance, 12);
  EXPECT_EQ(nearest->second_distance, 13);
  EXPECT_EQ(nearest->second_octave, 3);
  EXPECT_EQ(matcher.FindMatch(d, area, b.Side(), b.grid, 50, 0.8)->index1, 0U);
  EXPECT_FALSE(matcher.FindMatch(d, area, b.Side(), b.grid, 11, 0.8));
  b.Add(206, 200, 2, 0, WithFlippedBits(d, 14));  // a rival of the same octave, but third best
  b.Index();
  EXPECT_TRUE(matcher.FindMatch(d, area, b.Side(), b.grid, 50, 0.8));
  b.keypoints[1].octave = 2;
  EXPECT_FALSE(matcher.FindMatch(d, area, b.Side(), b.grid, 50, 0.8));
  EXPECT_FALSE(matcher.FindNearest(d, {{400, 400}, 20.0}, b.Side(), b.grid));
}

TEST(KeepConsistentTurns, KeepsTheThreeFullestBins) {
  std::vector<Keypoint> from(200), to(200);
  std::vector<FeatureMatch> matches;
  for (uint32_t i = 0; i < 200; ++i) {
    // 100 by 0 steps, 60 by a quarter, 20 by a half, 20 spread over the rest.
    const uint32_t turn = i < 100 ? 0 : i < 160 ? 64 : i < 180 ? 128 : 10 * (i - 180) + 6;
    from[i].angle = static_cast<uint8_t>(i * 7);
    to[i].angle = static_cast<uint8_t>(i * 7 + turn);
    matches.push_back({i, i, 0});
  }
  KeepConsistentTurns(from, to, &matches);
  size_t kept = 0;
  for (const FeatureMatch& m : matches) kept += m.index0 < 180 ? 1 : 0;
  EXPECT_EQ(kept, 180U);
  EXPECT_LT(matches.size(), 187U);
  std::vector<FeatureMatch> none;
  KeepConsistentTurns(from, to, &none);
  EXPECT_TRUE(none.empty());
}

TEST(KeepConsistentTurns, DropsSparseSecondBins) {
  std::vector<Keypoint> from(105), to(105);
  std::vector<FeatureMatch> matches;
  for (uint32_t i = 0; i < 105; ++i) {
    to[i].angle = i < 100 ? 255 : 128;  // 255 is a turn of -1: the bin of no turn
    matches.push_back({i, i, 0});
  }
  KeepConsistentTurns(from, to, &matches);
  EXPECT_EQ(matches.size(), 100U);
}

TEST(FeatureMatcher, AllocatesNothingInTheSteadyState) {
  auto [a, b] = RandomPair(600, 9);
  std::vector<GroupedFeature> groups;
  for (uint32_t i = 0; i < 600; ++i) groups.push_back({i / 30, i});
  FeatureMatcher matcher;
  std::vector<FeatureMatch> matches;
  const auto work = [&] {
    b.Index();
    matcher.MatchWindow(a.Side(), b.Side(), b.grid, {}, &matches);
    matcher.MatchAll(a.Side(), b.Side(), {}, &matches);
    matcher.MatchGroups(a.Side(), groups, b.Side(), groups, {}, &matches);
    matcher.FindMatch(a.descriptors[0], {{300, 200}, 50.0}, b.Side(), b.grid, 50, 0.8);
  };
  work();
  const size_t before = testing::NumAllocations();
  work();
  EXPECT_EQ(testing::NumAllocations(), before);
}

}  // namespace
}  // namespace dmslam
