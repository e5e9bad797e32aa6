#include "dmslam/place_recognition/bow.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

template <typename Visit>
void ForEachCommonWord(const BowVector& a, const BowVector& b, Visit visit) {
  size_t i = 0;
  size_t j = 0;
  while (i < a.size() && j < b.size()) {
    const WordIndex word_a = a[i].word;
    const WordIndex word_b = b[j].word;
    if (word_a == word_b) visit(a[i].weight, b[j].weight);
    i += word_a <= word_b;
    j += word_b <= word_a;
  }
}

std::span<const NodeFeature> RunAt(const FeatureVector& features, size_t begin) {
  size_t end = begin;
  while (end < features.size() && features[end].node == features[begin].node) ++end;
  return std::span(features).subspan(begin, end - begin);
}

bool Usable(const BowMatchSide& side, uint32_t feature) {
  return side.usable.empty() || side.usable[feature] != 0;
}

struct Nearest {
  uint32_t feature = 0;
  int distance = 257;
  int second = 257;
};

Nearest FindNearest(const Descriptor& wanted, const BowMatchSide& side,
                    std::span<const NodeFeature> candidates) {
  Nearest nearest;
  for (const NodeFeature& candidate : candidates) {
    if (!Usable(side, candidate.feature)) continue;
    const int distance = HammingDistance(wanted, side.features->descriptors[candidate.feature]);
    if (distance < nearest.distance) {
      nearest = {candidate.feature, distance, nearest.distance};
    } else if (distance < nearest.second) {
      nearest.second = distance;
    }
  }
  return nearest;
}

bool Accept(const Nearest& nearest, const BowMatchOptions& options) {
  if (nearest.distance > options.max_distance) return false;
  return options.max_ratio >= 1.0 || nearest.distance < options.max_ratio * nearest.second;
}

void MatchUnderNode(const BowMatchSide& a, std::span<const NodeFeature> run_a, const BowMatchSide& b,
                    std::span<const NodeFeature> run_b, const BowMatchOptions& options,
                    std::vector<BowMatch>& matches) {
  for (const NodeFeature& item : run_a) {
    if (!Usable(a, item.feature)) continue;
    const Nearest nearest = FindNearest(a.features->descriptors[item.feature], b, run_b);
    if (!Accept(nearest, options)) continue;
    if (options.mutual) {
      const Nearest back = FindNearest(b.features->descriptors[nearest.feature], a, run_a);
      if (back.feature != item.feature) continue;
    }
    matches.push_back({item.feature, nearest.feature, nearest.distance});
  }
}

/// Of several matches to the same feature of the second image, the nearest stays (ties: the lower first
/// feature).
void KeepOnePerFeature(std::vector<BowMatch>& matches) {
  std::sort(matches.begin(), matches.end(), [](const BowMatch& x, const BowMatch& y) {
    return std::tie(x.b, x.distance, x.a) < std::tie(y.b, y.distance, y.a);
  });
  const auto end = std::unique(matches.begin(), matches.end(),
                               [](const BowMatch& x, const BowMatch& y) { return x.b == y.b; });
  matches.erase(end, matches.end());
}

constexpr int kTurnBins = 32;

int TurnBin(const BowMatchSide& a, const BowMatchSide& b, const BowMatch& match) {
  const int turn = a.features->keypoints[match.a].angle - b.features->keypoints[match.b].angle;
  return ((turn + 256) % 256) * kTurnBins / 256;
}

/// Keeps the matches in the window of three adjacent bins of turn that holds most.
void KeepCommonTurn(const BowMatchSide& a, const BowMatchSide& b, std::vector<BowMatch>& matches) {
  std::array<int, kTurnBins> counts{};
  for (const BowMatch& match : matches) ++counts[static_cast<size_t>(TurnBin(a, b, match))];
  int best_bin = 0;
  int best_count = -1;
  for (int bin = 0; bin < kTurnBins; ++bin) {
    const auto at = [&](int offset) {
      return counts[static_cast<size_t>((bin + offset + kTurnBins) % kTurnBins)];
    };
    const int count = at(-1) + at(0) + at(1);
    if (count > best_count) {
      best_count = count;
      best_bin = bin;
    }
  }
  std::erase_if(matches, [&](const BowMatch& match) {
    const int away = (TurnBin(a, b, match) - best_bin + kTurnBins) % kTurnBins;
    return away > 1 && away < kTurnBins - 1;
  });
}

void CheckSide(const BowMatchSide& side) {
  DMSLAM_CHECK(side.features != nullptr && side.nodes != nullptr,
               "both features and direct index are needed");
  DMSLAM_CHECK(side.usable.empty() || side.usable.size() == side.features->size(), "one flag per feature");
  for (const NodeFeature& item : *side.nodes) {
    DMSLAM_CHECK(item.feature < side.features->size(), "direct index of another image");
  }
}

}  // namespace

double L1Score(const BowVector& a, const BowVector& b) {
  double score = 0;
  ForEachCommonWord(a, b, [&](float x, float y) { score += static_cast<double>(std::min(x, y)); });
  return score;
}

size_t CountCommonWords(const BowVector& a, const BowVector& b) {
  size_t count = 0;
  ForEachCommonWord(a, b, [&](float, float) { ++count; });
  return count;
}

void ForEachCommonNode(
    const FeatureVector& a, const FeatureVector& b,
    const std::function<void(std::span<const NodeFeature>, std::span<const NodeFeature>)>& visit) {
  size_t i = 0;
  size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (a[i].node < b[j].node) {
      i += RunAt(a, i).size();
    } else if (b[j].node < a[i].node) {
      j += RunAt(b, j).size();
    } else {
      const auto run_a = RunAt(a, i);
      const auto run_b = RunAt(b, j);
      visit(run_a, run_b);
      i += run_a.size();
      j += run_b.size();
    }
  }
}

void BowMatchOptions::Check() const {
  if (max_distance < 0 || max_distance > 256) throw InputError("match: max_distance must lie in 0..256 bits");
  if (!(max_ratio > 0.0 && max_ratio <= 1.0)) throw InputError("match: max_ratio must lie in (0, 1]");
}

std::vector<BowMatch> MatchByNodes(const BowMatchSide& a, const BowMatchSide& b,
                                   const BowMatchOptions& options) {
  options.Check();
  CheckSide(a);
  CheckSide(b);
  std::vector<BowMatch> matches;
  ForEachCommonNode(*a.nodes, *b.nodes,
                    [&](auto run_a, auto run_b) { MatchUnderNode(a, run_a, b, run_b, options, matches); });
  KeepOnePerFeature(matches);
  if (options.check_orientation) KeepCommonTurn(a, b, matches);
  std::sort(matches.begin(), matches.end());
  return matches;
}

}  // namespace dmslam
