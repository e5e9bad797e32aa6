#include "dmslam/dynamics/seen_through.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/projection.h"

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;
constexpr double kWallDepth = 4.0, kPersonDepth = 2.0;

/// A wall of 9 x 7 landmarks, seen by every keyframe, and a person of 3 x 3 landmarks in front of it. The
/// camera stands still; while the person is there, it hides the wall behind it.
class StandingPerson : public testing::Test {
 protected:
  StandingPerson() : map_(TestCamera(), Pyramid()) {}

  static bool OnPerson(const Eigen::Vector2d& uv_px) {
    return std::abs(uv_px.x() - 320) <= 70 && std::abs(uv_px.y() - 240) <= 70;
  }

  /// Pixels where landmarks are: a grid of 60 px.
  static std::vector<Eigen::Vector2d> Pixels() {
    std::vector<Eigen::Vector2d> pixels;
    for (int column = -4; column <= 4; ++column) {
      for (int row = -3; row <= 3; ++row) pixels.emplace_back(320 + 60.0 * column, 240 + 60.0 * row);
    }
    return pixels;
  }

  KeyframeId AddKeyframe(uint32_t index, double seconds) {
    FeatureSet features;
    for (const Eigen::Vector2d& pixel : Pixels()) {
      Keypoint keypoint;
      keypoint.x_q4 = static_cast<uint16_t>(16 * pixel.x());
      keypoint.y_q4 = static_cast<uint16_t>(16 * pixel.y());
      features.keypoints.push_back(keypoint);
      features.descriptors.emplace_back();
    }
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, index);
    keyframe.map_id = 1;
    keyframe.stamp_ns = static_cast<int64_t>(seconds * kSecond);
    keyframe.features = MakeFrameFeatures(features, map_.camera(), map_.pyramid());
    const KeyframeId id = keyframe.id;
    map_.AddKeyframe(std::move(keyframe));
    return id;
  }

  /// One landmark for each pixel at that depth.
  std::vector<LandmarkId> AddLandmarks(double depth, KeyframeId newest, bool person_only) {
    std::vector<LandmarkId> ids(Pixels().size());
    for (size_t i = 0; i < ids.size(); ++i) {
      if (person_only && !OnPerson(Pixels()[i])) continue;
      Landmark landmark;
      landmark.id = ids[i] = LandmarkId::Make(1, next_++);
      landmark.map_id = 1;
      landmark.p_world =
          depth * Eigen::Vector3d((Pixels()[i].x() - 320) / 500, (Pixels()[i].y() - 240) / 500, 1);
      landmark.reference = landmark.first_keyframe = newest;
      map_.AddLandmark(std::move(landmark));
    }
    return ids;
  }

  void See(KeyframeId keyframe, const std::vector<LandmarkId>& wall, const std::vector<LandmarkId>& person) {
    for (size_t i = 0; i < wall.size(); ++i) {
      const LandmarkId id = !person.empty() && person[i].valid() ? person[i] : wall[i];
      if (map_.FindLandmark(id) != nullptr)
        map_.SetObservation(map_.At(keyframe), static_cast<uint16_t>(i), map_.At(id));
    }
  }

  static int CountLeft(const Map& map, const std::vector<LandmarkId>& ids) {
    return static_cast<int>(std::count_if(ids.begin(), ids.end(), [&](LandmarkId id) {
      return id.valid() && map.FindLandmark(id) != nullptr;
    }));
  }

  MapEditor map_;
  uint32_t next_ = 1;
};

TEST_F(StandingPerson, IsRemovedWhereTheWallWasSeenBefore) {
  const KeyframeId before = AddKeyframe(0, 0), before_too = AddKeyframe(10, 0.4);
  const auto wall = AddLandmarks(kWallDepth, before_too, false);
  See(before, wall, {});
  See(before_too, wall, {});
  const KeyframeId with = AddKeyframe(60, 2), with_too = AddKeyframe(70, 2.4);
  const auto person = AddLandmarks(kPersonDepth, with_too, true);
  See(with, wall, person);
  See(with_too, wall, person);
  EXPECT_EQ(RemoveSeenThrough(map_, map_.At(with_too)), 9);
  EXPECT_EQ(CountLeft(map_, person), 0);
  EXPECT_EQ(CountLeft(map_, wall), 63);
}

TEST_F(StandingPerson, StaysWhileNobodySawWhatIsBehind) {
  const KeyframeId with = AddKeyframe(60, 2), with_too = AddKeyframe(70, 2.4);
  const auto wall = AddLandmarks(kWallDepth, with_too, false);
  const auto person = AddLandmarks(kPersonDepth, with_too, true);
  See(with, wall, person);
  See(with_too, wall, person);
  EXPECT_EQ(RemoveSeenThrough(map_, map_.At(with_too)), 0);
  EXPECT_EQ(CountLeft(map_, person), 9);
}

TEST_F(StandingPerson, GoesAtTheEndWhenTheWallWasSeenAfter) {
  const KeyframeId with = AddKeyframe(60, 2), with_too = AddKeyframe(70, 2.4);
  const KeyframeId after = AddKeyframe(120, 4), after_too = AddKeyframe(130, 4.4);
  const auto wall = AddLandmarks(kWallDepth, after_too, false);
  const auto person = AddLandmarks(kPersonDepth, with_too, true);
  See(with, wall, person);
  See(with_too, wall, person);
  See(after, wall, {});
  See(after_too, wall, {});
  EXPECT_GE(RemoveUnproven(map_, 1, 0), 9);
  EXPECT_EQ(CountLeft(map_, person), 0);
}

// Nothing is proven within two seconds: that a landmark is not says nothing against it.
TEST_F(StandingPerson, AMapTooShortToProveAnythingIsNotEmptied) {
  const std::vector<KeyframeId> all = {AddKeyframe(0, 0), AddKeyframe(10, 0.4), AddKeyframe(60, 2)};
  const auto wall = AddLandmarks(kWallDepth, all.back(), false);
  for (const KeyframeId id : all) See(id, wall, {});
  constexpr uint64_t kManyBefore = 1000;
  EXPECT_EQ(RemoveUnproven(map_, 1, kManyBefore), 0);
}

// Within six seconds little is seen for longer than people stand: the rest is not theirs for that.
TEST_F(StandingPerson, AMapThatIsHardlyOlderThanPeopleStandIsNotEmptied) {
  const std::vector<KeyframeId> all = {AddKeyframe(0, 0), AddKeyframe(10, 0.4), AddKeyframe(60, 5.6),
                                       AddKeyframe(70, 6)};
  const auto proven = AddLandmarks(kWallDepth, all.back(), true);
  const auto young = AddLandmarks(kWallDepth, all.back(), false);
  const std::vector<LandmarkId> none(young.size());
  See(all[0], none, proven);
  See(all[1], none, proven);
  See(all[2], young, proven);
  See(all[3], young, proven);
  constexpr uint64_t kManyBefore = 1000;
  RemoveUnproven(map_, 1, kManyBefore);
  EXPECT_EQ(CountLeft(map_, proven), 9);
  EXPECT_GE(CountLeft(map_, young), 54);
}

TEST_F(StandingPerson, FurnitureIsProvenByTime) {
  const KeyframeId early = AddKeyframe(0, 0), early_too = AddKeyframe(10, 0.4);
  const KeyframeId late = AddKeyframe(300, 10), late_too = AddKeyframe(310, 10.4);
  const auto wall = AddLandmarks(kWallDepth, late_too, false);
  const auto cupboard = AddLandmarks(kPersonDepth, late_too, true);
  for (const KeyframeId id : {early, early_too, late, late_too}) See(id, wall, cupboard);
  const KeyframeId odd =
      AddKeyframe(400, 13);  // sees the wall where the cupboard stands, for whatever reason
  See(odd, wall, {});
  EXPECT_EQ(RemoveSeenThrough(map_, map_.At(late_too)), 0);
  EXPECT_EQ(CountLeft(map_, cupboard), 9);
}

/// Somebody stands where a cupboard of the same depth is seen at other times: nothing looks through him.
TEST_F(StandingPerson, InFrontOfFurnitureStaysOnlyWhileMoreKeyframesSeeTheFurniture) {
  const auto left = [this](const std::vector<double>& others_s) {
    map_ = MapEditor(TestCamera(), Pyramid());
    std::vector<KeyframeId> others, with;
    uint32_t index = 0;
    for (const double seconds : others_s) others.push_back(AddKeyframe(index++, seconds));
    for (const double seconds : {20.0, 20.5, 21.0, 21.5}) with.push_back(AddKeyframe(index++, seconds));
    const auto wall = AddLandmarks(kWallDepth, with.back(), false);
    const auto cupboard = AddLandmarks(kPersonDepth, with.back(), true);
    const auto person = AddLandmarks(kPersonDepth, with.back(), true);
    for (const KeyframeId id : others) See(id, wall, cupboard);
    for (const KeyframeId id : with) See(id, wall, person);
    constexpr uint64_t kManyBefore = 1000;  // so somebody must have stood
    RemoveUnproven(map_, 1, kManyBefore);
    EXPECT_EQ(CountLeft(map_, cupboard), 9);
    return CountLeft(map_, person);
  };
  EXPECT_EQ(left({0, 0.4, 10, 10.4}), 0);
  EXPECT_EQ(left({0, 0.4, 10, 10.4, 11}), 9);
}

}  // namespace
}  // namespace dmslam
