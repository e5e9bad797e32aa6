#include "frontend/unaccepted_keyframes.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

TEST(UnacceptedKeyframesTest, TheMapperAcceptsThemInOrder) {
  UnacceptedKeyframes keyframes;
  for (const int64_t seq : {3, 7, 8}) keyframes.OnPublished(seq);
  keyframes.OnAccepted(std::nullopt);
  keyframes.OnAccepted(2);
  EXPECT_EQ(keyframes.size(), 3U);
  keyframes.OnAccepted(7);
  EXPECT_EQ(keyframes.size(), 1U);
  keyframes.OnAccepted(100);
  EXPECT_EQ(keyframes.size(), 0U);
}

TEST(UnacceptedKeyframesTest, AreTooManyUntilTheMapperCatchesUp) {
  UnacceptedKeyframes keyframes;
  for (size_t seq = 1; seq < kMostUnacceptedKeyframes; ++seq)
    keyframes.OnPublished(static_cast<int64_t>(seq));
  EXPECT_FALSE(keyframes.AreTooMany());
  keyframes.OnPublished(kMostUnacceptedKeyframes);
  EXPECT_TRUE(keyframes.AreTooMany());
  keyframes.OnAccepted(1);
  EXPECT_FALSE(keyframes.AreTooMany());
}

}  // namespace
}  // namespace dmslam
