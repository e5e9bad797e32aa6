#include "frontend/last_words.h"

#include <gtest/gtest.h>

#include <utility>

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

TEST(LastWordsTest, AreToldInPortionsWithPausesBetween) {
  FrontendOutput output;
  for (uint32_t frame = 0; frame < 20; ++frame) {
    FramePose pose;
    pose.frame_index = frame;
    output.Add(pose);
  }
  LastWords words(std::move(output));
  uint32_t told = 0;
  int portions = 0;
  for (int64_t now = 0; !words.AreTold(); now += 1'000'000) {
    const auto portion = words.NextPortion(now);
    portions += portion.empty() ? 0 : 1;
    for (const FrontendEvent& event : portion) EXPECT_EQ(std::get<FramePose>(event).frame_index, told++);
    ASSERT_LT(now, kSecond);
  }
  EXPECT_EQ(told, 20u);
  EXPECT_EQ(portions, 3);
}

TEST(LastWordsTest, WhoHasNothingToSayHasSaidIt) {
  LastWords words((FrontendOutput()));
  EXPECT_TRUE(words.NextPortion(0).empty());
  EXPECT_TRUE(words.AreTold());
}

}  // namespace
}  // namespace dmslam
