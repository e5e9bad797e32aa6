#include "dmslam/dynamics/missing_landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "dmslam/dynamics/testing/poster_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;
using testing::PosterScene;

class MissingLandmarksTest : public ::testing::Test {
 protected:
  using Points = std::function<bool(size_t)>;

  /// A frame that finds some points and sees others elsewhere; all others are missing.
  void Judge(
      const Points& found, const Points& moved = [](size_t) { return false; }) {
    const TrackedFrame frame = scene_.Found(found);
    std::vector<LandmarkId> moved_ids;
    for (size_t i = 0; i < scene_.size(); ++i) {
      if (moved(i)) moved_ids.push_back(MapScene::IdOf(i));
    }
    missing_.Judge(scene_.map(), frame, scene_.ExpectAll(frame), moved_ids);
  }
  long GoneOfPoster() const { return std::ranges::count_if(missing_.gone(), PosterScene::IsOfPoster); }
  static bool OfPoster(size_t i) { return PosterScene::OfPoster(i); }
  static bool IsOdd(size_t i) { return i % 2 == 1; }
  /// How far in the image a point of the wall is from the poster's rim, as an angle.
  double FromPoster(size_t i) const {
    return scene_.point(i).head<2>().norm() / 4 - 0.16 * std::sqrt(2.0) / 2;
  }

  PosterScene scene_;
  MissingLandmarks missing_{TestCamera()};
};

TEST_F(MissingLandmarksTest, WhatIsSeenThroughHasGone) {
  Judge([](size_t i) { return !OfPoster(i); });
  EXPECT_GE(GoneOfPoster(), 20);
  EXPECT_EQ(std::ssize(missing_.gone()), GoneOfPoster());
  EXPECT_TRUE(missing_.hidden().empty());
}

TEST_F(MissingLandmarksTest, WhereSomethingOfItsDepthIsSeenItHasNot) {
  Judge([](size_t i) { return !OfPoster(i) || IsOdd(i); });
  EXPECT_EQ(GoneOfPoster(), 0);
}

TEST_F(MissingLandmarksTest, WhatIsFarFromItInTheImageSaysNothing) {
  Judge([&](size_t i) { return !OfPoster(i) && FromPoster(i) > MissingLandmarks::kReachRad; });
  EXPECT_EQ(GoneOfPoster(), 0);
}

TEST_F(MissingLandmarksTest, OneMatchBehindItMayBeWrong) {
  const auto one_behind = [&] {
    size_t nearest = 0;
    for (size_t i = 0; i < PosterScene::kPoster; ++i) {
      if (FromPoster(i) < FromPoster(nearest)) nearest = i;
    }
    return nearest;
  }();
  Judge([&](size_t i) { return i == one_behind; });
  EXPECT_EQ(GoneOfPoster(), 0);
}

TEST_F(MissingLandmarksTest, WhatIsMissingAmongNeighboursThatMoveHasGoneWithThem) {
  const auto moved = [](size_t i) { return OfPoster(i) && IsOdd(i); };
  Judge([](size_t) { return false; }, moved);
  EXPECT_GE(GoneOfPoster(), 8);
  for (const LandmarkId id : missing_.gone()) EXPECT_FALSE(moved(id.number() - 1)) << "it is not missing";
}

TEST_F(MissingLandmarksTest, AmongNeighboursOfWhichAsManyStayItHasNot) {
  Judge([](size_t i) { return OfPoster(i) && i % 3 == 0; },
        [](size_t i) { return OfPoster(i) && i % 3 == 1; });
  EXPECT_EQ(GoneOfPoster(), 0);
}

TEST_F(MissingLandmarksTest, WhatIsMissingBehindSomethingNearerIsHidden) {
  Judge(OfPoster);
  EXPECT_GE(missing_.hidden().size(), 2U);
  EXPECT_TRUE(std::ranges::is_sorted(missing_.hidden()));
  EXPECT_EQ(std::ranges::count_if(missing_.hidden(), PosterScene::IsOfPoster), 0);
  EXPECT_TRUE(missing_.gone().empty());
}

TEST_F(MissingLandmarksTest, BehindSomebodyWhoMovesItIsHiddenToo) {
  Judge([](size_t) { return false; }, OfPoster);
  EXPECT_GE(missing_.hidden().size(), 2U);
  EXPECT_TRUE(missing_.gone().empty());
}

}  // namespace
}  // namespace dmslam
