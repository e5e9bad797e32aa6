#include "dmslam/initialization/pair_agreement.h"

#include <algorithm>

#include "dmslam/camera/image_scale.h"
#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {
namespace {

struct Overlap {
  int common = 0;  // matched in both pairs
  int both = 0;    // static in both
  int either = 0;  // static in one at least
};

/// Walks through two lists sorted by index0 and calls visit(i, k) where they name the same feature.
template <typename Visit>
void ForEachCommon(const PairView& a, const PairView& b, Visit visit) {
  size_t i = 0, k = 0;
  while (i < a.matches.size() && k < b.matches.size()) {
    if (a.matches[i].index0 < b.matches[k].index0) {
      ++i;
    } else if (a.matches[i].index0 > b.matches[k].index0) {
      ++k;
    } else {
      visit(i++, k++);
    }
  }
}

Overlap Compare(const PairView& a, const PairView& b) {
  Overlap overlap;
  ForEachCommon(a, b, [&](size_t i, size_t k) {
    const bool in_a = a.selection.is_static[i] != 0, in_b = b.selection.is_static[k] != 0;
    ++overlap.common;
    overlap.both += in_a && in_b;
    overlap.either += in_a || in_b;
  });
  return overlap;
}

void SetRefusal(AgreementRefusal refusal, std::string explanation, Agreement* agreement) {
  if (agreement->refusal != AgreementRefusal::kNone) return;  // the first reason stands
  agreement->refusal = refusal;
  agreement->explanation = std::move(explanation);
}

/// Of the image's diagonal, for the root of D, where the static matches are `share` of all.
double MinDistributionShare(double share, const AgreementOptions& options) {
  const bool dominates = options.dominance && share >= options.dominance->min_share;
  return dominates ? std::min(options.dominance->min_distribution_share, options.min_distribution_share)
                   : options.min_distribution_share;
}

void CompareAll(std::span<const PairView* const> pairs, const AgreementOptions& options,
                Agreement* agreement) {
  for (size_t a = 0; a < pairs.size(); ++a) {
    for (size_t b = a + 1; b < pairs.size(); ++b) {
      const Overlap overlap = Compare(*pairs[a], *pairs[b]);
      if (overlap.common < options.min_common) {
        SetRefusal(AgreementRefusal::kTooFewCommon,
                   "two pairs have only " + std::to_string(overlap.common) + " features in common",
                   agreement);
      }
      const double jaccard = overlap.either == 0 ? 0.0 : overlap.both / static_cast<double>(overlap.either);
      agreement->agreement = std::min(agreement->agreement, jaccard);
    }
  }
  if (agreement->agreement < options.min_agreement) {
    SetRefusal(AgreementRefusal::kDisagreement,
               "the pairs' static sets overlap by " + std::to_string(agreement->agreement), agreement);
  }
}

}  // namespace

std::string_view ToString(AgreementRefusal refusal) {
  switch (refusal) {
    case AgreementRefusal::kNone:
      return "none";
    case AgreementRefusal::kSelectionRefused:
      return "selection refused";
    case AgreementRefusal::kTooFewCommon:
      return "too few common features";
    case AgreementRefusal::kDisagreement:
      return "disagreement";
    case AgreementRefusal::kTooFewStatic:
      return "too few static matches";
    case AgreementRefusal::kDistributionTooSmall:
      return "distribution too small";
  }
  return "unknown";
}

Agreement Agree(std::span<const PairView* const> pairs, const Camera& camera,
                const AgreementOptions& options) {
  Agreement agreement;
  const PairView& last = *pairs.back();
  agreement.is_static = last.selection.is_static;
  for (const PairView* pair : pairs) {
    if (pair->selection.IsUsable()) continue;
    SetRefusal(AgreementRefusal::kSelectionRefused, pair->selection.explanation, &agreement);
    return agreement;
  }
  CompareAll(pairs, options, &agreement);
  for (size_t p = 0; p + 1 < pairs.size(); ++p) {
    ForEachCommon(*pairs[p], last, [&](size_t i, size_t k) {
      if (!pairs[p]->selection.is_static[i]) agreement.is_static[k] = 0;
    });
  }
  std::vector<Eigen::Vector2d> points;
  for (size_t k = 0; k < last.matches.size(); ++k) {
    if (agreement.is_static[k]) points.push_back(last.matches[k].uv0_px);
  }
  agreement.num_static = static_cast<int>(points.size());
  agreement.distribution_px = Spread(points);
  const double share = agreement.num_static / std::max(1.0, static_cast<double>(last.matches.size()));
  if (agreement.num_static < options.min_static) {
    SetRefusal(AgreementRefusal::kTooFewStatic,
               std::to_string(agreement.num_static) + " matches are static in all pairs", &agreement);
  }
  if (agreement.distribution_px < MinDistributionShare(share, options) * DiagonalPx(camera)) {
    SetRefusal(AgreementRefusal::kDistributionTooSmall,
               "the static matches spread over " + std::to_string(agreement.distribution_px) + " px",
               &agreement);
  }
  return agreement;
}

}  // namespace dmslam
