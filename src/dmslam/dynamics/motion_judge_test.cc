// The frontend's judgement of what moves, one mechanism at a time.
#include "dmslam/dynamics/motion_judge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "dmslam/dynamics/testing/poster_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;
using testing::PosterScene;

constexpr int64_t kNow = PosterScene::kNow;

TEST(EvidenceCounterTest, WhatIsFoundWasVisible) {
  EvidenceCounter counter;
  counter.OnFound(MapScene::IdOf(1));
  counter.OnVisible(MapScene::IdOf(0));
  counter.OnMoved(MapScene::IdOf(0));
  const FrameEvidence evidence = counter.Take(kNow, 1);
  ASSERT_EQ(evidence.items.size(), 2u);
  EXPECT_EQ(evidence.items[0].landmark, MapScene::IdOf(0));
  EXPECT_EQ(evidence.items[0].visible, 1);
  EXPECT_EQ(evidence.items[0].moved, 1);
  EXPECT_EQ(evidence.items[1].visible, 1);
  EXPECT_EQ(evidence.items[1].found, 1);
  EXPECT_TRUE(counter.Take(kNow, 1).items.empty());
}

class Judgement : public ::testing::Test {
 protected:
  static constexpr size_t kPoster = PosterScene::kPoster, kPosterPoints = PosterScene::kPosterPoints;

  static bool OfPoster(size_t point) { return PosterScene::OfPoster(point); }
  std::vector<ExpectedLandmark> ExpectAll(const TrackedFrame& frame) const { return scene_.ExpectAll(frame); }
  TrackedFrame Frame(const MapScene::Place& place, const std::function<bool(size_t)>& found) const {
    return scene_.Frame(place, found);
  }

  FrameEvidence JudgedAndBelieved(TrackedFrame frame, int times = 1) {
    const std::vector<ExpectedLandmark> expected = ExpectAll(frame);
    for (int i = 0; i < times; ++i) {
      judge_.Judge(scene_.map(), expected, {}, &frame);
      judge_.Believe(scene_.map(), expected, frame);
    }
    return judge_.TakeEvidence(kNow, 1);
  }

  /// Of the poster's landmarks: how many are said to have moved, and to have been visible.
  struct Counts {
    int moved = 0, visible = 0, found = 0;
  };
  static Counts OfPoster(const FrameEvidence& evidence) {
    Counts counts;
    for (const FrameEvidence::Item& item : evidence.items) {
      if (item.landmark < MapScene::IdOf(kPoster)) continue;
      counts.moved += item.moved;
      counts.visible += item.visible;
      counts.found += item.found;
    }
    return counts;
  }

  PosterScene scene_;
  MotionJudge judge_{{}, TestCamera()};
};

TEST_F(Judgement, WhatIsFoundInItsPlaceHasNotMoved) {
  const FrameEvidence evidence = JudgedAndBelieved(
      Frame([&](size_t i) { return std::optional(scene_.point(i)); }, [](size_t) { return true; }));
  EXPECT_EQ(OfPoster(evidence).found, static_cast<int>(kPosterPoints));
  EXPECT_EQ(OfPoster(evidence).moved, 0);
}

TEST_F(Judgement, WhatIsSeenBesideItsPlaceHasMovedAndLosesItsVote) {
  const auto place = [&](size_t i) {
    return std::optional<Eigen::Vector3d>(scene_.point(i) + Eigen::Vector3d(OfPoster(i) ? 0.06 : 0, 0, 0));
  };
  TrackedFrame frame = Frame(place, [](size_t i) { return !OfPoster(i); });
  const std::vector<ExpectedLandmark> expected = ExpectAll(frame);
  judge_.Judge(scene_.map(), expected, {}, &frame);
  EXPECT_GE(std::count(frame.classes.begin(), frame.classes.end(), FeatureClass::kMoving), 20);
  const FrameEvidence evidence = JudgedAndBelieved(frame, 3);
  EXPECT_GE(OfPoster(evidence).moved, 3 * 20);
  const auto voteless = std::count_if(expected.begin(), expected.end(), [&](const ExpectedLandmark& e) {
    return !judge_.votes().HasVote(*e.landmark);
  });
  EXPECT_GE(voteless, 20);
  EXPECT_LE(voteless, static_cast<long>(kPosterPoints));
}

TEST_F(Judgement, WhatIsMissingWhileTheWallBehindItIsSeenHasGone) {
  const auto place = [&](size_t i) { return OfPoster(i) ? std::nullopt : std::optional(scene_.point(i)); };
  const Counts counts = OfPoster(JudgedAndBelieved(Frame(place, [](size_t) { return true; })));
  EXPECT_GE(counts.moved, 20) << "the wall is seen through its place";
}

TEST_F(Judgement, WhatIsMissingBehindSomethingNearerIsHiddenAndNothingIsSaid) {
  // The wall around the poster is missing; the poster itself is seen.
  const auto near_poster = [&](size_t i) {
    return !OfPoster(i) && std::abs(scene_.point(i).x()) < 0.6 && std::abs(scene_.point(i).y()) < 0.6;
  };
  const auto place = [&](size_t i) { return near_poster(i) ? std::nullopt : std::optional(scene_.point(i)); };
  const FrameEvidence evidence = JudgedAndBelieved(Frame(place, [](size_t) { return true; }));
  int hidden = 0;
  for (size_t i = 0; i < kPoster; ++i) {
    if (!near_poster(i)) continue;
    const auto item = std::find_if(evidence.items.begin(), evidence.items.end(),
                                   [&](const auto& e) { return e.landmark == MapScene::IdOf(i); });
    if (item == evidence.items.end()) {
      ++hidden;
    } else {
      EXPECT_EQ(item->moved, 0) << i;
    }
  }
  EXPECT_GE(hidden, 2);
}

TEST_F(Judgement, AMatchWhereNothingElseIsFoundMustLookLikeItsLandmark) {
  // A walker hides the left half: of all that should be seen there one match is found, with 60 wrong bits.
  const auto left = [&](size_t i) { return scene_.point(i).x() < 0; };
  const auto place = [&](size_t i) { return std::optional(scene_.point(i)); };
  const auto flipped = [](TrackedFrame* frame, size_t feature) {
    auto features = std::make_shared<FrameFeatures>(*frame->features);
    for (int bit = 0; bit < 60; ++bit) features->set.descriptors[feature].words[bit % 4] ^= 1ULL << (bit / 4);
    frame->features = features;
  };
  const size_t lonely = 7;
  ASSERT_LT(lonely, kPoster);
  for (const bool hidden : {false, true}) {
    const size_t point = [&] {
      size_t i = lonely;
      while (!left(i) || scene_.point(i).x() > -0.5) ++i;
      return i;
    }();
    TrackedFrame frame = Frame(place, [&](size_t i) { return i == point || !hidden || !left(i); });
    const auto feature =
        static_cast<size_t>(std::find(frame.landmarks.begin(), frame.landmarks.end(), MapScene::IdOf(point)) -
                            frame.landmarks.begin());
    ASSERT_LT(feature, frame.landmarks.size());
    flipped(&frame, feature);
    judge_.DropMatchesOfHiddenPlaces(scene_.map(), ExpectAll(frame), &frame);
    EXPECT_EQ(frame.landmarks[feature].valid(), !hidden);
  }
}

}  // namespace
}  // namespace dmslam
