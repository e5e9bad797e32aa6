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

}  // namespace
}  // namespace dmslam
