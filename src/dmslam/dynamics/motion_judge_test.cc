// The frontend's judgement of what moves, one mechanism at a time.
#include "dmslam/dynamics/motion_judge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kNow = 10'000'000'000;

TEST(Votes, WhatIsBelievedToMoveHasNone) {
  Landmark landmark;
  landmark.id = MapScene::IdOf(0);
  const LandmarkVotes votes({});
  EXPECT_TRUE(votes.HasVote(landmark));
  landmark.evidence.motion_belief = 0.1F;
  EXPECT_FALSE(votes.HasVote(landmark));
  EXPECT_TRUE(LandmarkVotes({.motion_belief = false}).HasVote(landmark));
}

TEST(Votes, AStreakElsewhereCostsTheVoteUntilItIsFound) {
  Landmark landmark;
  landmark.id = MapScene::IdOf(0);
  LandmarkVotes votes({});
  for (int sighting = 0; sighting < 3; ++sighting) {
    EXPECT_TRUE(votes.HasVote(landmark)) << sighting;
    votes.OnSeenElsewhere(landmark.id);
  }
  EXPECT_FALSE(votes.HasVote(landmark));
  votes.OnFound(landmark.id);
  EXPECT_TRUE(votes.HasVote(landmark));
}

TEST(Votes, TrustGrowsWithAge) {
  Landmark landmark;
  const LandmarkVotes votes({.young_trust = 0.3, .trusted_age_s = 4.0});
  EXPECT_DOUBLE_EQ(votes.Trust(landmark, 0), 0.3);
  EXPECT_DOUBLE_EQ(votes.Trust(landmark, 2'000'000'000), 0.65);
  EXPECT_DOUBLE_EQ(votes.Trust(landmark, 9'000'000'000), 1.0);
}

TEST(EldersTest, TheOldestDecideAndTheYoungNeverOutweighThem) {
  Elders elders({}, 4.0);
  std::vector<double> ages_s(40, 1.0);
  EXPECT_FALSE(elders.FromAge(ages_s)) << "too few to tell them apart";
  ages_s.resize(100);
  std::iota(ages_s.begin(), ages_s.end(), 0.0);
  EXPECT_DOUBLE_EQ(*elders.FromAge(ages_s), 4.0) << "whoever is trusted is an elder";
  for (double& age : ages_s) age *= 0.01;
  EXPECT_NEAR(*elders.FromAge(ages_s), 0.59, 1e-9) << "the oldest 40 of 100";
  EXPECT_FALSE(elders.Decide(23, 40));
  EXPECT_TRUE(elders.Decide(24, 40));
  EXPECT_TRUE(elders.Admit(7.8));
  EXPECT_FALSE(elders.Admit(7.9));
  EXPECT_DOUBLE_EQ(elders.YoungFactor(40, 200), 0.1);
  EXPECT_DOUBLE_EQ(elders.YoungFactor(40, 10), 1.0);
}

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

/// A wall at depth 4 and a poster, say, of 5 x 5 points before it at depth 2.
class Judgement : public ::testing::Test {
 protected:
  static constexpr size_t kPoster = 300, kPosterPoints = 25;

  Judgement() {
    scene_.AddCloud(kPoster, {0, 0, 4}, {1.6, 1.2, 0.01});
    for (int x = -2; x <= 2; ++x) {
      for (int y = -2; y <= 2; ++y) scene_.AddPoint({0.08 * x, 0.08 * y, 2.0});
    }
    scene_.MapAll();
  }

  static bool OfPoster(size_t point) { return point >= kPoster; }

  std::vector<ExpectedLandmark> ExpectAll(const TrackedFrame& frame) const {
    std::vector<ExpectedLandmark> expected;
    for (size_t i = 0; i < scene_.size(); ++i) {
      const Landmark& landmark = *scene_.map().FindLandmark(MapScene::IdOf(i));
      if (const auto view = PredictView(scene_.map(), landmark, frame.T_cam_world))
        expected.push_back({landmark.id, *view});
    }
    return expected;
  }

  /// What a frame sees where `place` says points are now; those for which `found` says so are matched.
  TrackedFrame Frame(const MapScene::Place& place, const std::function<bool(size_t)>& found) const {
    std::vector<size_t> shown;
    TrackedFrame frame = scene_.See(100, kNow, MapScene::PoseAt(0.1), place, &shown);
    for (size_t feature = 0; feature < shown.size(); ++feature) {
      if (!found(shown[feature])) continue;
      frame.landmarks[feature] = MapScene::IdOf(shown[feature]);
      frame.classes[feature] = FeatureClass::kUsed;
    }
    return frame;
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

  MapScene scene_;
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
    return !judge_.votes().HasVote(*scene_.map().FindLandmark(e.id));
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
