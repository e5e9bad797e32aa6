#include "dmslam/place_recognition/bow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "dmslam/place_recognition/places_test_util.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using places_test::SmallVocabulary;
using places_test::SyntheticWorld;

BowVector RandomBow(Random& random, size_t words) {
  BowVector bow;
  double sum = 0;
  for (WordIndex word = 0; bow.size() < words; word += 1 + random.Below(5)) {
    bow.push_back({word, static_cast<float>(random.Uniform(0.1, 1.0))});
    sum += static_cast<double>(bow.back().weight);
  }
  for (WordWeight& item : bow) item.weight = static_cast<float>(static_cast<double>(item.weight) / sum);
  return bow;
}

TEST(L1Score, HasTheScoresProperties) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const BowVector a = RandomBow(random, 100);
    const BowVector b = RandomBow(random, 1 + random.Below(150));
    EXPECT_NEAR(L1Score(a, a), 1.0, 1e-6);
    EXPECT_EQ(L1Score(a, b), L1Score(b, a));
    EXPECT_GE(L1Score(a, b), 0.0);
    EXPECT_LE(L1Score(a, b), 1.0 + 1e-6);
    EXPECT_EQ(L1Score(a, {}), 0.0);
  }
}

TEST(L1Score, EqualsItsDefinition) {
  Random random(2);
  const BowVector a = RandomBow(random, 100);
  const BowVector b = RandomBow(random, 100);
  std::map<WordIndex, double> difference;
  for (const WordWeight& item : a) difference[item.word] += static_cast<double>(item.weight);
  for (const WordWeight& item : b) difference[item.word] -= static_cast<double>(item.weight);
  double norm = 0;
  for (const auto& [word, value] : difference) norm += std::abs(value);
  EXPECT_NEAR(L1Score(a, b), 1.0 - 0.5 * norm, 1e-6);
}

/// Two views of the same 150 corners: the second in another order, disturbed, turned by `turn`.
class MatchByNodesTest : public testing::Test {
 protected:
  static constexpr size_t kCorners = 150;

  MatchByNodesTest() {
    SyntheticWorld world(400, 7);
    const auto seen_in = [&](int disturbance) {
      const std::vector<Descriptor> image = world.Image(20, kCorners, disturbance);
      return std::pmr::vector<Descriptor>(image.begin(), image.end());
    };
    a_.descriptors = seen_in(0);
    b_.descriptors = seen_in(6);
    std::reverse(b_.descriptors.begin(), b_.descriptors.end());
    Random random(4);
    for (size_t i = 0; i < kCorners; ++i)
      a_.keypoints.push_back({.angle = static_cast<uint8_t>(random.Next())});
    for (size_t i = 0; i < kCorners; ++i) {
      b_.keypoints.push_back({.angle = static_cast<uint8_t>(a_.keypoints[kCorners - 1 - i].angle + 77)});
    }
    const Vocabulary vocabulary = SmallVocabulary();
    nodes_a_ = vocabulary.Transform(a_.descriptors, 1).nodes;
    nodes_b_ = vocabulary.Transform(b_.descriptors, 1).nodes;
  }

  FeatureSet a_, b_;
  FeatureVector nodes_a_, nodes_b_;
};

TEST_F(MatchByNodesTest, FindsTheSameCorners) {
  const auto matches = MatchByNodes({&a_, &nodes_a_}, {&b_, &nodes_b_});
  EXPECT_GT(matches.size(), kCorners * 8 / 10);
  for (const BowMatch& match : matches) {
    EXPECT_EQ(match.a, kCorners - 1 - match.b);
    EXPECT_EQ(match.distance, HammingDistance(a_.descriptors[match.a], b_.descriptors[match.b]));
  }
  EXPECT_TRUE(std::ranges::is_sorted(matches));
}

TEST_F(MatchByNodesTest, LeavesOutWhatIsNotUsable) {
  std::vector<uint8_t> usable(kCorners, 1);
  for (size_t i = 0; i < kCorners; i += 2) usable[i] = 0;
  for (const BowMatch& match : MatchByNodes({&a_, &nodes_a_, usable}, {&b_, &nodes_b_})) {
    EXPECT_EQ(match.a % 2, 1U);
  }
  EXPECT_FALSE(MatchByNodes({&a_, &nodes_a_, usable}, {&b_, &nodes_b_}).empty());
}

TEST_F(MatchByNodesTest, DropsMatchesThatTurnOtherwise) {
  for (size_t i = 0; i < 8; ++i) b_.keypoints[i].angle = static_cast<uint8_t>(b_.keypoints[i].angle + 128);
  for (const BowMatch& match : MatchByNodes({&a_, &nodes_a_}, {&b_, &nodes_b_})) EXPECT_GE(match.b, 8U);
  MatchOptions without;
  without.check_orientation = false;
  const auto all = MatchByNodes({&a_, &nodes_a_}, {&b_, &nodes_b_}, without);
  EXPECT_TRUE(std::ranges::any_of(all, [](const BowMatch& match) { return match.b < 8; }));
}

TEST_F(MatchByNodesTest, EachFeatureMatchesAtMostOnce) {
  // Three equal corners on one side: at most one of them may keep the match, with and without the mutual
  // check.
  a_.descriptors[1] = a_.descriptors[0];
  a_.descriptors[2] = a_.descriptors[0];
  const Vocabulary vocabulary = SmallVocabulary();
  nodes_a_ = vocabulary.Transform(a_.descriptors, 1).nodes;
  for (const bool mutual : {true, false}) {
    MatchOptions options;
    options.mutual = mutual;
    std::map<uint32_t, int> uses;
    for (const BowMatch& match : MatchByNodes({&a_, &nodes_a_}, {&b_, &nodes_b_}, options)) ++uses[match.b];
    for (const auto& [feature, count] : uses) EXPECT_EQ(count, 1) << feature;
  }
}

TEST_F(MatchByNodesTest, RefusesWhatDoesNotBelongTogether) {
  std::vector<uint8_t> short_flags(3, 1);
  EXPECT_THROW(MatchByNodes({&a_, &nodes_a_, short_flags}, {&b_, &nodes_b_}), InvariantError);
  FeatureSet short_set;
  EXPECT_THROW(MatchByNodes({&short_set, &nodes_a_}, {&b_, &nodes_b_}), InvariantError);
}

}  // namespace
}  // namespace dmslam
