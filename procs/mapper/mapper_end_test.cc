#include "mapper/mapper_end.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

using Step = MapperEnd::Step;

TEST(MapperEndTest, TheEndIsAnnouncedWhenAllIsAppliedAndThenNothingFollows) {
  MapperEnd end;
  EXPECT_EQ(end.TakeStep(false, true), Step::kNone);
  EXPECT_FALSE(end.HasBegun());
  EXPECT_EQ(end.TakeStep(true, true), Step::kApplyAnswer);
  EXPECT_TRUE(end.HasBegun());
  EXPECT_EQ(end.TakeStep(true, true), Step::kApplyAnswer) << "there may be several";
  EXPECT_EQ(end.TakeStep(true, false), Step::kAnnounce);
  EXPECT_FALSE(end.IsCompleting());
  EXPECT_EQ(end.TakeStep(true, true), Step::kComplete) << "what comes after that is too late";
  EXPECT_TRUE(end.IsCompleting());
}

TEST(MapperEndTest, AFrontendThatComesBackDoesNotUndoIt) {
  MapperEnd end;
  EXPECT_EQ(end.TakeStep(true, true), Step::kApplyAnswer);
  EXPECT_EQ(end.TakeStep(false, false), Step::kAnnounce);
  EXPECT_EQ(end.TakeStep(false, false), Step::kComplete);
}

TEST(MapperEndTest, WithAMapThatIsCompleteItBeginsAtTheEnd) {
  MapperEnd end;
  end.Complete();
  EXPECT_TRUE(end.HasBegun());
  EXPECT_TRUE(end.IsCompleting());
}

TEST(MapperEndTest, WhoLacksTheMapIsWaitedForUnlessItWasCompleteAtTheBeginning) {
  MapperEnd end;
  EXPECT_FALSE(end.GivesUp(INT64_MAX));
  end.WaitUntil(500);
  EXPECT_FALSE(end.GivesUp(499));
  EXPECT_TRUE(end.GivesUp(500));
  EXPECT_FALSE(end.HasBegun()) << "first the map is said again";
}

}  // namespace
}  // namespace dmslam
