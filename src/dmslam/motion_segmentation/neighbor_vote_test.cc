#include "dmslam/motion_segmentation/neighbor_vote.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <utility>
#include <vector>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

std::vector<Match> MatchesAt(std::initializer_list<Eigen::Vector2d> places_px) {
  std::vector<Match> matches;
  for (const Eigen::Vector2d& place : places_px) {
    Match match;
    match.uv0_px = place;
    match.uv1_px = {0, 0};  // where it is in the other frame is not asked
    matches.push_back(match);
  }
  return matches;
}

TEST(NeighborShares, AsksTheNearestAndNotTheMatchItself) {
  const auto matches = MatchesAt({{100, 50}, {101, 50}, {103, 50}, {107, 50}, {115, 50}});
  const std::vector<uint8_t> flags = {0, 1, 1, 0, 0};
  EXPECT_EQ(NeighborShares(matches, flags, 1, 60), (std::vector<float>{1, 0, 1, 1, 0}));
  EXPECT_EQ(NeighborShares(matches, flags, 2, 60), (std::vector<float>{1, 0.5F, 0.5F, 1, 0.5F}));
}

TEST(NeighborShares, FewerNeighboursThanAskedAreAllThereAre) {
  const auto matches = MatchesAt({{100, 50}, {101, 50}, {103, 50}});
  EXPECT_EQ(NeighborShares(matches, std::vector<uint8_t>{1, 0, 0}, 10, 60),
            (std::vector<float>{0, 0.5F, 0.5F}));
}

TEST(NeighborShares, NobodyIsAskedFromAfarAndWhoStandsAloneIsBelieved) {
  const auto matches = MatchesAt({{19, 19}, {21, 21}, {80, 19}, {19, 80}});
  EXPECT_EQ(NeighborShares(matches, std::vector<uint8_t>{0, 0, 0, 0}, 10, 20),
            (std::vector<float>{0, 0, 1, 1}));
}

TEST(NeighborShares, ThereAreNeighboursOutsideTheImage) {
  const auto matches = MatchesAt({{-70, -5}, {-72, -5}, {1e6, 1e6}, {1e6 + 1, 1e6}});
  EXPECT_EQ(NeighborShares(matches, std::vector<uint8_t>{1, 0, 0, 1}, 10, 20),
            (std::vector<float>{0, 1, 1, 0}));
}

/// The matches are looked for by places in the image: nobody in reach may be overlooked.
TEST(NeighborShares, AreThoseOfAllPairs) {
  constexpr int kNeighbors = 5;
  constexpr double kReachPx = 60;
  Random random(5);
  std::vector<Match> matches(600);
  std::vector<uint8_t> flags(matches.size());
  for (size_t i = 0; i < matches.size(); ++i) {
    const double x = random.Uniform(-100, 740), y = random.Uniform(-100, 580);
    matches[i].uv0_px = {x, y};
    flags[i] = static_cast<uint8_t>(random.Below(2));
  }
  const std::vector<float> shares = NeighborShares(matches, flags, kNeighbors, kReachPx);
  int compared = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    std::vector<std::pair<double, size_t>> others;
    for (size_t k = 0; k < matches.size(); ++k) {
      if (k != i) others.emplace_back((matches[k].uv0_px - matches[i].uv0_px).norm(), k);
    }
    std::sort(others.begin(), others.end());
    if (others[kNeighbors - 1].first > kReachPx) continue;
    int set = 0;
    for (size_t k = 0; k < kNeighbors; ++k) set += flags[others[k].second];
    EXPECT_EQ(shares[i], static_cast<float>(set) / kNeighbors) << i;
    ++compared;
  }
  EXPECT_GT(compared, 500);
}

}  // namespace
}  // namespace dmslam
