#include "dmslam/initialization/pair_agreement.h"

#include <gtest/gtest.h>

#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

TEST(Agree, KeepsWhatAllPairsCallStatic) {
  PairView a, b;
  for (uint32_t i = 0; i < 200; ++i) {
    Match match;
    match.index0 = i;
    match.uv0_px = {3.0 * i, (i % 7) * 60.0};
    a.matches.push_back(match);
    b.matches.push_back(match);
    a.selection.is_static.push_back(i < 190);
    b.selection.is_static.push_back(i >= 5);
  }
  const PairView* pairs[] = {&a, &b};
  const Agreement agreement = Agree(pairs, SyntheticCamera(), {});
  ASSERT_TRUE(agreement.IsUsable()) << agreement.explanation;
  EXPECT_EQ(agreement.num_static, 185);
  EXPECT_DOUBLE_EQ(agreement.agreement, 185.0 / 200.0);
  EXPECT_EQ(agreement.is_static[2], 0);
  EXPECT_EQ(agreement.is_static[195], 0);
  for (size_t i = 0; i < 60; ++i) b.selection.is_static[i] = 0;
  EXPECT_EQ(Agree(pairs, SyntheticCamera(), {}).refusal, AgreementRefusal::kDisagreement);
}

/// `num_static` matches in a patch that is compact for the whole image, and others all over it.
PairView PatchAmongOthers(uint32_t num_static, uint32_t num_others) {
  PairView pair;
  for (uint32_t i = 0; i < num_static + num_others; ++i) {
    const bool is_static = i < num_static;
    Match match;
    match.index0 = i;
    match.uv0_px = is_static ? Eigen::Vector2d(180.0 + i % 20 * 17.0, 130.0 + i / 20 % 20 * 12.0)
                             : Eigen::Vector2d(i * 37 % 640, i * 53 % 480);
    pair.matches.push_back(match);
    pair.selection.is_static.push_back(is_static);
  }
  return pair;
}

TEST(Agree, APatchIsEnoughWhereNothingElseMovesOtherwise) {
  AgreementOptions options;
  options.dominance.reset();
  const auto refusal = [&](const PairView& pair) {
    const PairView* pairs[] = {&pair, &pair};
    return Agree(pairs, SyntheticCamera(), options).refusal;
  };
  const PairView alone = PatchAmongOthers(400, 20), among_others = PatchAmongOthers(400, 100);
  EXPECT_EQ(refusal(alone), AgreementRefusal::kDistributionTooSmall);
  options.dominance = DominanceOptions{};
  EXPECT_EQ(refusal(alone), AgreementRefusal::kNone);
  EXPECT_EQ(refusal(among_others), AgreementRefusal::kDistributionTooSmall);
}

}  // namespace
}  // namespace dmslam
