#include "dmslam/dynamics/hidden_places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "dmslam/dynamics/testing/poster_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;
using testing::PosterScene;

/// The left half of the wall, of which one point is found.
class HiddenPlacesTest : public ::testing::Test {
 protected:
  HiddenPlacesTest() {
    while (!IsLeft(lonely_) || scene_.point(lonely_).x() > -0.5) ++lonely_;
  }
  bool IsLeft(size_t i) const { return scene_.point(i).x() < 0; }

  /// Whether the match of the lonely point outlives, if so many of its bits are wrong.
  bool Outlives(int wrong_bits, const std::function<bool(size_t)>& found) {
    TrackedFrame frame = scene_.Frame([&](size_t i) { return std::optional(scene_.point(i)); },
                                      [&](size_t i) { return i == lonely_ || found(i); });
    const auto feature = static_cast<size_t>(std::ranges::find(frame.landmarks, MapScene::IdOf(lonely_)) -
                                             frame.landmarks.begin());
    auto features = std::make_shared<FrameFeatures>(*frame.features);
    for (int bit = 0; bit < wrong_bits; ++bit)
      features->set.descriptors[feature].words[bit % 4] ^= 1ULL << (bit / 4);
    frame.features = std::move(features);
    HiddenPlaces({}).DropMatches(scene_.map(), scene_.ExpectAll(frame), LandmarkVotes({}), &frame);
    return frame.landmarks[feature].valid();
  }

  PosterScene scene_;
  size_t lonely_ = 0;
};

TEST_F(HiddenPlacesTest, AMatchWhereNothingElseIsFoundIsDropped) {
  EXPECT_FALSE(Outlives(80, [&](size_t i) { return !IsLeft(i); }));
}

TEST_F(HiddenPlacesTest, AmongManyOthersItIsKept) {
  EXPECT_TRUE(Outlives(80, [](size_t) { return true; }));
}

TEST_F(HiddenPlacesTest, OneThatLooksVeryMuchLikeItsLandmarkIsKept) {
  EXPECT_TRUE(Outlives(39, [&](size_t i) { return !IsLeft(i); }));
}

TEST_F(HiddenPlacesTest, WhatHasNoVoteIsNotMissed) {
  LandmarkEvidence moves;
  moves.motion_belief = 1.0F;
  for (size_t i = 0; i < scene_.size(); ++i) {
    if (IsLeft(i) && i != lonely_) scene_.map().SetEvidence(scene_.map().At(MapScene::IdOf(i)), moves);
  }
  EXPECT_TRUE(Outlives(80, [&](size_t i) { return !IsLeft(i); }));
}

}  // namespace
}  // namespace dmslam
