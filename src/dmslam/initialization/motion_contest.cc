#include "dmslam/initialization/motion_contest.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {
namespace {

struct Width {
  double spread_px = 0;
  double score = 0;  ///< D times number
};

/// Of the support, but for what `without` has.
Width WidthOf(const Contender& contender, const Contender* without) {
  const std::vector<Match>& matches = contender.candidate.last().pair.matches;
  std::vector<Eigen::Vector2d> points;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (contender.support[k] && !(without && without->support[k])) points.push_back(matches[k].uv0_px);
  }
  const double spread = Spread(points);
  return {spread, spread * spread * static_cast<double>(points.size())};
}

}  // namespace

ContestResult DecideContest(std::vector<Contender> contenders, const ContestOptions& options,
                            double diagonal_px) {
  ContestResult result;
  if (contenders.empty()) {
    result.refused = {WaitReason::kNoReconstruction, "no motion explains the views"};
    return result;
  }
  const auto widest =
      std::max_element(contenders.begin(), contenders.end(), [](const Contender& a, const Contender& b) {
        return WidthOf(a, nullptr).score < WidthOf(b, nullptr).score;
      });
  const Width own = WidthOf(*widest, nullptr);
  for (const Contender& other : contenders) {
    if (&other == &*widest) continue;
    result.rival_share = std::max(result.rival_share, WidthOf(other, &*widest).score / own.score);
  }
  char text[128];
  if (own.spread_px < options.min_distribution_share * diagonal_px) {
    std::snprintf(text, sizeof(text), "the widest motion spreads over %.0f px", own.spread_px);
    result.refused = {WaitReason::kDistributionTooSmall, text};
  } else if (result.rival_share > options.max_rival_share) {
    std::snprintf(text, sizeof(text), "another motion is %.2f times as wide and numerous",
                  result.rival_share);
    result.refused = {WaitReason::kNoReconstruction, text};
  } else {
    result.winner = std::move(*widest);
  }
  return result;
}

}  // namespace dmslam
