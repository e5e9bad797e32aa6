#include "mapper/camera_requests.h"

#include <gtest/gtest.h>

#include <set>

namespace dmslam {
namespace {

constexpr int64_t kEpoch = 10;

class CameraRequestsTest : public testing::Test {
 protected:
  void Ask(CameraId camera, uint32_t frame, const TurnTime& time, int64_t epoch = kEpoch) {
    requests_.OnTurn(camera, epoch, {frame, time, camera});
  }
  CameraRequests::HasEnded HasEnded() const {
    return [this](CameraId camera) { return ended_.contains(camera); };
  }
  /// Whose turn it is.
  std::optional<CameraId> Next() {
    const auto turn = requests_.TakeTurn(HasEnded(), [](CameraId) { return kEpoch; });
    return turn ? std::optional(turn->camera) : std::nullopt;
  }

  CameraRequests requests_{2};
  std::set<CameraId> ended_;
};

TEST_F(CameraRequestsTest, FramesTakeTurnsByStampAndThenByCamera) {
  EXPECT_EQ(Next(), std::nullopt);
  Ask(0, 5, TurnTime::Of(200));
  EXPECT_EQ(Next(), std::nullopt) << "the other one may be earlier";
  Ask(1, 3, TurnTime::Of(100));
  EXPECT_EQ(Next(), 1U);
  EXPECT_EQ(Next(), std::nullopt) << "its next one is not known";
  Ask(1, 4, TurnTime::Of(200));
  EXPECT_EQ(Next(), 0U);
  Ask(0, 6, TurnTime::AtTheEnd());
  EXPECT_EQ(Next(), 1U) << "what is done at the end comes last";
}

TEST_F(CameraRequestsTest, WhatWasAnsweredIsNotAnsweredAgainUnlessAnotherFrontendAsks) {
  Ask(0, 5, TurnTime::Of(100));
  Ask(1, 5, TurnTime::Of(200));
  EXPECT_EQ(Next(), 0U);
  Ask(0, 5, TurnTime::Of(100));
  EXPECT_EQ(Next(), std::nullopt);
  Ask(0, 5, TurnTime::Of(100), kEpoch + 1);
  EXPECT_EQ(Next(), 0U);
}

TEST_F(CameraRequestsTest, WhoHasEndedSinceHasHadItsAnswer) {
  requests_.OnAdjust(0, 1);
  requests_.OnAdjust(1, 1);
  EXPECT_EQ(requests_.TakeAdjust(HasEnded()).size(), 2U);
  requests_.OnAdjust(1, 2);  // sent while the answer was on its way
  ended_ = {0, 1};
  EXPECT_TRUE(requests_.TakeAdjust(HasEnded()).empty());
}

TEST_F(CameraRequestsTest, WhatAFrontendBeforeAskedForIsVoid) {
  requests_.OnAdjust(0, 1);
  requests_.OnBegin(0);
  requests_.OnAdjust(1, 1);
  EXPECT_TRUE(requests_.TakeAdjust(HasEnded()).empty()) << "the new one still adds to the map";
  requests_.OnAdjust(0, 1);
  EXPECT_EQ(requests_.TakeAdjust(HasEnded()).size(), 2U);
  Ask(0, 105, TurnTime::Of(500));
  requests_.OnBegin(0);
  Ask(1, 3, TurnTime::Of(600));
  EXPECT_EQ(Next(), std::nullopt) << "the new one may go on before that frame";
  Ask(0, 101, TurnTime::Of(400));
  EXPECT_EQ(Next(), 0U);
}

TEST_F(CameraRequestsTest, WhoIsDoneIsNotWaitedFor) {
  Ask(1, 5, TurnTime::Of(200));
  ended_ = {0};
  EXPECT_EQ(Next(), 1U);
  requests_.OnAdjust(1, 1);
  EXPECT_EQ(Next(), std::nullopt) << "nobody is left";
}

TEST_F(CameraRequestsTest, TheMapsAreAdjustedWhenNoCameraAddsToThem) {
  requests_.OnAdjust(1, 7);
  EXPECT_TRUE(requests_.TakeAdjust(HasEnded()).empty());
  ended_ = {0};
  const std::vector<AdjustRequest> requests = requests_.TakeAdjust(HasEnded());
  ASSERT_EQ(requests.size(), 1U) << "who has left without asking hears no answer";
  EXPECT_EQ(requests[0].request, 7U);
  EXPECT_EQ(requests[0].camera_id, 1U);
  EXPECT_FALSE(requests[0].newest_stamp_ns);
  EXPECT_TRUE(requests_.TakeAdjust(HasEnded()).empty()) << "it is answered once";
}

}  // namespace
}  // namespace dmslam
