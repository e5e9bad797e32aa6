#include "frontend/refused_images.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

using Consequence = RefusedImages::Consequence;

const ImageProblem kUnreadable{ImageProblem::Kind::kUnreadable, ""};
const ImageProblem kOtherSize{ImageProblem::Kind::kOtherSize, ""};

TEST(RefusedImagesTest, TheFirstOneIsToldTheOthersAreCounted) {
  RefusedImages refused;
  EXPECT_EQ(refused.Count(kUnreadable, false), Consequence::kWarn);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(refused.Count(kUnreadable, false), Consequence::kNone);
  EXPECT_EQ(refused.bad(), 10);
}

TEST(RefusedImagesTest, WhereNoneHasFittedTheCameraIsAnotherOne) {
  RefusedImages refused;
  EXPECT_EQ(refused.Count(kOtherSize, false), Consequence::kWarn);
  EXPECT_EQ(refused.Count(kUnreadable, false), Consequence::kNone);
  EXPECT_EQ(refused.Count(kOtherSize, false), Consequence::kNone);
  EXPECT_EQ(refused.Count(kOtherSize, false), Consequence::kOtherCamera);
  EXPECT_EQ(refused.bad(), 3);
}

TEST(RefusedImagesTest, WhereOneHasFittedOthersCostTheirPlaceAlone) {
  RefusedImages refused;
  refused.Count(kOtherSize, false);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(refused.Count(kOtherSize, true), Consequence::kNone);
  EXPECT_EQ(refused.bad(), 10);
}

}  // namespace
}  // namespace dmslam
