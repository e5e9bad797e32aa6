#include "frontend/sequence_end.h"

#include <gtest/gtest.h>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using Phase = SequenceEnd::Phase;

constexpr int64_t kSecond = 1'000'000'000;

TEST(SequenceEndTest, GoesStepByStep) {
  SequenceEnd end;
  EXPECT_THROW(end.OnGrown(), InvariantError);
  end.OnEndHeard();
  end.OnEndHeard();  // the player repeats it
  EXPECT_TRUE(end.Is(Phase::kGrowingBack));
  EXPECT_FALSE(end.AppliesAllRecords());
  end.OnGrown();
  EXPECT_THROW(end.OnGrown(), InvariantError);
  EXPECT_TRUE(end.Asks(0));
  EXPECT_TRUE(end.AppliesAllRecords());
  end.OnAnswer();
  end.OnAdjusted();
  end.OnRefined();
  EXPECT_TRUE(end.Is(Phase::kJoining));
  end.Tell({});
  EXPECT_TRUE(end.NextPortion(0).empty());
  EXPECT_TRUE(end.Is(Phase::kDone)) << "there was nothing to tell";
}

TEST(SequenceEndTest, AMapperThatDoesNotAnswerIsAskedAgain) {
  SequenceEnd end;
  end.OnEndHeard();
  end.OnGrown();
  end.OnAnswer();
  EXPECT_FALSE(end.IsAnswered()) << "nobody had asked";
  EXPECT_TRUE(end.Asks(kSecond));
  EXPECT_FALSE(end.Asks(2 * kSecond));
  EXPECT_TRUE(end.Asks(12 * kSecond));
  end.OnAnswer();
  EXPECT_TRUE(end.IsAnswered());
  EXPECT_FALSE(end.Asks(30 * kSecond));
}

TEST(SequenceEndTest, TellsInPortionsWithPausesBetween) {
  SequenceEnd end;
  end.OnEndHeard();
  end.OnGrown();
  end.OnAdjusted();
  end.OnRefined();
  FrontendOutput output;
  for (uint32_t frame = 0; frame < 20; ++frame) {
    FramePose pose;
    pose.frame_index = frame;
    output.Add(pose);
  }
  end.Tell(std::move(output));
  uint32_t told = 0;
  int portions = 0;
  for (int64_t now = 0; !end.Is(Phase::kDone); now += 1'000'000) {
    const auto portion = end.NextPortion(now);
    portions += portion.empty() ? 0 : 1;
    for (const FrontendEvent& event : portion) EXPECT_EQ(std::get<FramePose>(event).frame_index, told++);
    ASSERT_LT(now, kSecond);
  }
  EXPECT_EQ(told, 20u);
  EXPECT_EQ(portions, 3);
}

}  // namespace
}  // namespace dmslam
