#include "dmslam/place_recognition/bow.h"

#include <algorithm>

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

MatchSide SideOf(const BowMatchSide& side) {
  DMSLAM_CHECK(side.features != nullptr && side.nodes != nullptr,
               "both features and direct index are needed");
  for (const GroupedFeature& item : *side.nodes) {
    DMSLAM_CHECK(item.feature < side.features->size(), "direct index of another image");
  }
  return {side.features->keypoints, side.features->descriptors, {}, side.usable};
}

}  // namespace

double L1Score(const BowVector& a, const BowVector& b) {
  double score = 0;
  ForEachCommonWord(a, b, [&](float x, float y) { score += static_cast<double>(std::min(x, y)); });
  return score;
}

std::vector<BowMatch> MatchByNodes(const BowMatchSide& a, const BowMatchSide& b,
                                   const MatchOptions& options) {
  std::vector<FeatureMatch> found;
  FeatureMatcher matcher;
  matcher.MatchGroups(SideOf(a), *a.nodes, SideOf(b), *b.nodes, options, &found);
  std::vector<BowMatch> matches;
  matches.reserve(found.size());
  for (const FeatureMatch& match : found) matches.push_back({match.index0, match.index1, match.distance});
  return matches;
}

}  // namespace dmslam
