// Frames placed when the sequence has ended.
#include "dmslam/refinement/late_placement.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

#include "dmslam/map/replica.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

WaitingFrame Waiting(uint32_t index) { return WaitingFrame(index, index * 33'333'333LL, FeatureSet()); }

TEST(UnplacedFramesTest, TheOldestAreForgotten) {
  UnplacedFrames frames(3);
  for (uint32_t i = 0; i < 5; ++i) frames.Keep(Waiting(i));
  EXPECT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames.TakeNewest().index, 4u);
  frames.PutBack({});
  std::vector<WaitingFrame> older;
  older.push_back(Waiting(1));
  frames.PutBack(std::move(older));
  EXPECT_EQ(frames.TakeNewest().index, 3u);
  EXPECT_EQ(frames.TakeNewest().index, 2u);
  EXPECT_EQ(frames.TakeNewest().index, 1u);
  EXPECT_TRUE(frames.empty());
}

TEST(UnplacedFramesTest, ThoseFromAFrameOnAreTakenInOrder) {
  UnplacedFrames frames(10);
  for (uint32_t i = 0; i < 6; ++i) frames.Keep(Waiting(i));
  const std::deque<WaitingFrame> taken = frames.TakeFrom(4);
  ASSERT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken.front().index, 4u);
  EXPECT_EQ(frames.size(), 4u);
}

TEST(UnplacedFramesTest, WhatWasSetAsideIsTriedAgainInOrder) {
  UnplacedFrames frames(10);
  for (uint32_t i = 0; i < 3; ++i) frames.Keep(Waiting(i));
  while (!frames.empty()) frames.SetAside(frames.TakeNewest());
  frames.ReturnSetAside();
  EXPECT_EQ(frames.TakeNewest().index, 2u);
  EXPECT_EQ(frames.size(), 2u);
}

TEST(PlausibleMotion, IsBoundedInTimeAndDepth) {
  const Rigid3d here = MapScene::PoseAt(0), there = MapScene::PoseAt(0.5);
  EXPECT_TRUE(IsPlausibleMotion(here, there, 0.2, 2.0));
  EXPECT_FALSE(IsPlausibleMotion(here, there, 0.1, 2.0)) << "too fast";
  EXPECT_FALSE(IsPlausibleMotion(here, there, 0.2, 1.0)) << "too far in a small scene";
  const Rigid3d turned(ExpSo3({0, 0.5, 0}), Eigen::Vector3d::Zero());
  EXPECT_TRUE(IsPlausibleMotion(here, turned, 0.2, 1.0));
  EXPECT_FALSE(IsPlausibleMotion(here, turned, 0.1, 1.0));
}

TEST(KeyframesAside, BoundWhatLiesBetweenThem) {
  MapScene scene;
  scene.AddCloud(100, {0, 0, 4}, {1.6, 1.2, 0.5});
  scene.MapAll(40, 0.01, 10, 10 * MapScene::kStepNs);  // 0.3 per second
  const auto agrees = [&](uint32_t index, double x) {
    TrackedFrame frame = scene.See(index, index * MapScene::kStepNs, MapScene::PoseAt(x));
    return AgreesWithKeyframesAside(scene.map(), MapScene::kMap, frame, MapScene::kSession, 4.0);
  };
  EXPECT_TRUE(agrees(30, 0.2));
  EXPECT_TRUE(agrees(70, 0.6)) << "as far as it goes at this speed";
  EXPECT_TRUE(agrees(5, -0.05));
  EXPECT_FALSE(agrees(30, 1.0)) << "and back again within a moment";
  EXPECT_FALSE(agrees(80, 2.0));
  EXPECT_FALSE(agrees(5, -2.0));
}

/// For three seconds 0.3 units per second, four units from the scene.
UsualSpeed SlowCamera(const MapScene& scene, uint32_t first) {
  UsualSpeed usual_speed;
  const Keyframe* reference = scene.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, first));
  for (int frame = 0; frame < 90; ++frame) {
    const PlacedPose pose = PlacedPose::Of(*reference, MapScene::PoseAt(0.01 * frame));
    usual_speed.OnPose(scene.map(), pose, frame * MapScene::kStepNs);
  }
  return usual_speed;
}

TEST(LeftAtUsualSpeed, WhoComesFromFarAwayDoesNot) {
  MapScene scene;
  scene.AddCloud(100, {0, 0, 4}, {1.6, 1.2, 0.5});
  scene.MapAll(12, 0.01, 30, 30 * MapScene::kStepNs);
  const UsualSpeed slow = SlowCamera(scene, 30);
  const auto left = [&](uint32_t index, double x, const UsualSpeed& usual_speed) {
    const TrackedFrame frame = scene.See(index, index * MapScene::kStepNs, MapScene::PoseAt(x));
    return IsLeftAtUsualSpeed(scene.map(), MapScene::kMap, frame, MapScene::kSession, 4.0, usual_speed);
  };
  EXPECT_TRUE(left(29, -0.01, slow));
  EXPECT_TRUE(left(29, -0.2, slow)) << "0.2 s later it may have gone there";
  EXPECT_FALSE(left(29, -0.6, slow));
  EXPECT_TRUE(left(29, -0.6, {})) << "who knows how fast it goes";
  EXPECT_TRUE(left(5, -2.0, slow)) << "no keyframe follows within half a second";
}

/// Frames before the map's first keyframe, which is frame 20.
class GrowingBack : public ::testing::Test {
 protected:
  static constexpr uint32_t kFirst = 20;
  static constexpr int64_t kFrameNs = 33'333'333;

  GrowingBack() : relocalizer_(nullptr), search_({}, TestCamera()), placement_(MapScene::kSession, 0, 0, {}) {
    scene_.AddCloud(400, {0, 0, 4}, {1.6, 1.2, 0.5});
    scene_.MapAll(1, 0.0, kFirst, kFirst * kFrameNs);
  }

  TrackedFrame Frame(uint32_t index, double x, const MapScene::Place& place = {}) const {
    TrackedFrame frame = scene_.See(index, index * kFrameNs, MapScene::PoseAt(x), place);
    frame.T_cam_world = Rigid3d();
    return frame;
  }
  TrackingReport Place(TrackedFrame* frame) {
    const LatePlacement::Found found =
        placement_.Place(scene_.map(), late_map_, {&search_, relocalizer_, {}}, frame);
    jumped_ = found.jumped;
    return found.report;
  }
  std::vector<LatePlacement::Placed> GoOnFrom(const TrackedFrame& frame, const TrackingReport& report,
                                              const std::optional<LatePlacement::Before>& before = {}) {
    const PlacedPose pose = *PlacedPose::Of(search_.Reference(scene_.map()), frame.T_cam_world);
    return placement_.GoOnFrom(scene_.map(), late_map_, search_, {frame, report, pose, jumped_}, before);
  }
  static LatePlacement::Before Tracked(uint32_t index, double x) {
    return {index, index * kFrameNs, MapScene::PoseAt(x)};
  }
  /// Places the frame; the indices of those that may be told.
  std::vector<uint32_t> Told(uint32_t index, double x, const MapScene::Place& place = {},
                             const std::optional<LatePlacement::Before>& before = {}) {
    TrackedFrame frame = Frame(index, x, place);
    const TrackingReport report = Place(&frame);
    EXPECT_TRUE(report.HasPose()) << index << ": " << report.reason;
    std::vector<uint32_t> told;
    if (!report.HasPose()) return told;
    for (const LatePlacement::Placed& placed : GoOnFrom(frame, report, before)) {
      told.push_back(placed.frame.index);
      const double own_x = placed.frame.index == index ? x : -0.02 * (kFirst - placed.frame.index);
      EXPECT_NEAR(placed.frame.T_cam_world.Center().x(), own_x, 5e-3);
    }
    return told;
  }
  /// What stands before the rest leaves a corner, or a few points all over the image.
  MapScene::Place Corner() const {
    return [this](size_t i) -> std::optional<Eigen::Vector3d> {
      const Eigen::Vector3d& p = scene_.point(i);
      return p.x() > 0.8 && p.y() > 0.4 ? std::optional(p) : std::nullopt;
    };
  }
  MapScene::Place Few() const {
    return [this](size_t i) { return i % 10 == 0 ? std::optional(scene_.point(i)) : std::nullopt; };
  }

  LateMap late_map_ = LateMap::kGrows;
  MapScene scene_;
  Relocalizer relocalizer_;
  PoseSearch search_;
  bool jumped_ = false;  ///< the frame placed last was recognised
  LatePlacement placement_;
};

TEST_F(GrowingBack, FramesArePlacedFromTheOneAfterThem) {
  for (uint32_t index = kFirst - 1; index > 10; --index) {
    const double x = -0.02 * (kFirst - index);
    TrackedFrame frame = Frame(index, x);
    const TrackingReport report = Place(&frame);
    ASSERT_TRUE(report.HasPose()) << index << ": " << report.reason;
    EXPECT_LT((frame.T_cam_world.Center() - Eigen::Vector3d(x, 0, 0)).norm(), 2e-3);
    GoOnFrom(frame, report);
  }
}

TEST_F(GrowingBack, AKeyframeFarAheadIsEnoughWhereTheCameraHardlyMoved) {
  EXPECT_EQ(Told(1, -0.38 / 19), std::vector<uint32_t>{1}) << "0.6 s before it";
}

TEST_F(GrowingBack, AFrameTooFarFromItsNeighbourIsNotBelieved) {
  TrackedFrame frame = Frame(kFirst - 1, -0.02);
  const TrackingReport report = Place(&frame);
  ASSERT_TRUE(report.HasPose());
  GoOnFrom(frame, report);
  TrackedFrame leap = Frame(kFirst - 2, -0.02);
  leap.stamp_ns = frame.stamp_ns - 1'000'000;  // the same place, but hardly any time between: as if it flew
  TrackedFrame near = Frame(kFirst - 2, -0.08);
  near.stamp_ns = leap.stamp_ns;
  EXPECT_TRUE(Place(&leap).HasPose());
  EXPECT_FALSE(Place(&near).HasPose()) << "0.06 units in a thousandth of a second";
}

TEST_F(GrowingBack, TheNeighbourMovesWithTheMap) {
  TrackedFrame frame = Frame(kFirst - 1, -0.02);
  const TrackingReport report = Place(&frame);
  ASSERT_TRUE(report.HasPose());
  GoOnFrom(frame, report);
  const Rigid3d shift(Eigen::Quaterniond::Identity(), {-3.0, 0, 0});
  const KeyframeId id = KeyframeId::Make(MapScene::kSession, kFirst);
  scene_.map().SetPose(scene_.map().At(id), scene_.map().FindKeyframe(id)->T_cam_world * shift);
  for (size_t i = 0; i < scene_.size(); ++i)
    scene_.map().SetPosition(scene_.map().At(MapScene::IdOf(i)), scene_.point(i) + Eigen::Vector3d(3, 0, 0));
  placement_.OnMapChanged(scene_.map());
  TrackedFrame next = Frame(kFirst - 2, -0.04);
  ASSERT_TRUE(Place(&next).HasPose());
  EXPECT_LT((next.T_cam_world.Center() - Eigen::Vector3d(2.96, 0, 0)).norm(), 3e-3);
}

TEST_F(GrowingBack, WhereTheMapStandsAChangeOfItEndsTheWayThatLedThroughFrames) {
  for (const LateMap late_map : {LateMap::kGrows, LateMap::kStands}) {
    placement_.Forget();
    late_map_ = late_map;
    EXPECT_EQ(Told(19, -0.02), std::vector<uint32_t>{19});
    EXPECT_EQ(Told(18, -0.04, Few()), std::vector<uint32_t>{});
    placement_.OnMapChanged(scene_.map());
    const bool leads_on = late_map == LateMap::kGrows;
    EXPECT_EQ(Told(17, -0.06), leads_on ? (std::vector<uint32_t>{18, 17}) : std::vector<uint32_t>{17});
  }
}

TEST_F(GrowingBack, WhatIsSeenInACornerIsToldBetweenWhatIsWellSeen) {
  EXPECT_EQ(Told(19, -0.02), std::vector<uint32_t>{19});
  EXPECT_EQ(Told(18, -0.04), std::vector<uint32_t>{18});
  TrackedFrame hidden = Frame(17, -0.06, Corner());
  EXPECT_FALSE(Place(&hidden).HasPose());
  EXPECT_EQ(Told(16, -0.08), (std::vector<uint32_t>{17, 16})) << "the motion led through it";
  EXPECT_EQ(Told(15, -0.10), std::vector<uint32_t>{15}) << "each is told once";
}

TEST_F(GrowingBack, WhereNothingBoundsTheWayOnlyWhatIsWellSeenIsTold) {
  EXPECT_EQ(Told(19, -0.02), std::vector<uint32_t>{19});
  EXPECT_EQ(Told(18, -0.04), std::vector<uint32_t>{18});
  EXPECT_EQ(Told(17, -0.06, Few()), std::vector<uint32_t>{}) << "as it might drift for ever";
  EXPECT_EQ(Told(16, -0.08, Few()), std::vector<uint32_t>{});
  EXPECT_EQ(Told(15, -0.10), (std::vector<uint32_t>{17, 16, 15}));
}

TEST_F(GrowingBack, AWayThatLeadsToATrackedFrameIsBelieved) {
  EXPECT_EQ(Told(19, -0.02), std::vector<uint32_t>{19});
  EXPECT_EQ(Told(18, -0.04), std::vector<uint32_t>{18});
  EXPECT_EQ(Told(17, -0.06, Few(), Tracked(16, -1.5)), std::vector<uint32_t>{}) << "far from where it leads";
  EXPECT_EQ(Told(16, -0.08, Few(), Tracked(15, -0.10)), (std::vector<uint32_t>{17, 16}));
}

TEST(LatePlacement, WhatIsProvenToBeNoPersonConfirmsAFrame) {
  for (const uint32_t keyframes : {2u, 280u}) {  // of the last moment, or of longer than people stand
    MapScene scene;
    scene.AddCloud(200, {0, 0, 4}, {1.6, 1.2, 0.5});
    scene.MapAll(keyframes, 0.0, 20, 20 * MapScene::kStepNs);
    Relocalizer relocalizer(nullptr);
    PoseSearch search({}, TestCamera());
    LatePlacement placement(MapScene::kSession, 0, 0, {});
    TrackedFrame frame = scene.See(19, 19 * MapScene::kStepNs, MapScene::PoseAt(0));
    const auto [report, jumped] =
        placement.Place(scene.map(), LateMap::kGrows, {&search, relocalizer, {}}, &frame);
    ASSERT_TRUE(report.HasPose()) << report.reason;
    const PlacedPose pose = *PlacedPose::Of(search.Reference(scene.map()), frame.T_cam_world);
    const auto told =
        placement.GoOnFrom(scene.map(), LateMap::kGrows, search, {frame, report, pose, jumped}, std::nullopt);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told.front().confirmed, keyframes == 280u);
  }
}

/// Keyframes that were placed late have gone off with somebody who walks: the next one is not placed there.
TEST(GrowingBackFast, FasterThanTheCameraWasItIsNotFollowed) {
  MapScene scene;
  scene.AddCloud(400, {0, 0, 4}, {1.6, 1.2, 0.5});
  scene.MapAll(12, 0.1, 20, 20 * MapScene::kStepNs);
  Relocalizer relocalizer(nullptr);
  PoseSearch search({}, TestCamera());
  const auto is_placed = [&](const UsualSpeed& usual_speed) {
    LatePlacement placement(MapScene::kSession, 0, 0, {});
    TrackedFrame frame = scene.See(19, 19 * MapScene::kStepNs, MapScene::PoseAt(-0.1));
    return placement.Place(scene.map(), LateMap::kGrows, {&search, relocalizer, usual_speed}, &frame)
        .report.HasPose();
  };
  EXPECT_FALSE(is_placed(SlowCamera(scene, 20)));
  EXPECT_TRUE(is_placed({})) << "who knows how fast it goes";
}

/// A camera that moves as fast before the map's first keyframe as after it.
TEST(GrowingBackFast, TheMotionLeadsOnOverFramesThatShowNothing) {
  constexpr int64_t kFrameNs = MapScene::kStepNs;
  MapScene scene;
  scene.AddCloud(400, {0, 0, 4}, {1.6, 1.2, 0.5});
  scene.MapAll(12, 0.1, 20, 20 * kFrameNs);
  Relocalizer relocalizer(nullptr);
  PoseSearch search({}, TestCamera());
  LatePlacement placement(MapScene::kSession, 0, 0, {});
  const auto see = [&](uint32_t index) {
    return scene.See(index, index * kFrameNs, MapScene::PoseAt(0.1 * (index - 20.0)));
  };
  for (const uint32_t index : {19u, 18u}) {
    TrackedFrame frame = see(index);
    const auto [report, jumped] =
        placement.Place(scene.map(), LateMap::kGrows, {&search, relocalizer, {}}, &frame);
    ASSERT_TRUE(report.HasPose()) << index << ": " << report.reason;
    const PlacedPose pose = *PlacedPose::Of(search.Reference(scene.map()), frame.T_cam_world);
    placement.GoOnFrom(scene.map(), LateMap::kGrows, search, {frame, report, pose, jumped}, std::nullopt);
  }
  for (const uint32_t index : {17u, 16u, 15u}) {
    TrackedFrame dark(index, index * kFrameNs,
                      MakeFrameFeatures({}, scene.map().camera(), scene.map().pyramid()));
    EXPECT_FALSE(
        placement.Place(scene.map(), LateMap::kGrows, {&search, relocalizer, {}}, &dark).report.HasPose());
  }
  TrackedFrame again = see(14);
  const auto [report, jumped] =
      placement.Place(scene.map(), LateMap::kGrows, {&search, relocalizer, {}}, &again);
  ASSERT_TRUE(report.HasPose()) << report.reason;
  EXPECT_NEAR(again.T_cam_world.Center().x(), -0.6, 5e-3);
}

/// Frame 330 shows what six keyframes saw eleven seconds after frame 0, and follows none of them.
TrackingReport PlacedWhere(bool map_is_old) {
  MapScene scene;
  scene.AddCloud(400, {0, 0, 4}, {1.6, 1.2, 0.5});
  scene.MapAll(6, 0.05, 300, 300 * MapScene::kStepNs);
  if (map_is_old) {
    Keyframe before;
    before.id = KeyframeId::Make(MapScene::kSession, 0);
    before.map_id = MapScene::kMap;
    before.features = MakeFrameFeatures({}, scene.map().camera(), scene.map().pyramid());
    scene.map().AddKeyframe(std::move(before));
  }
  Replica map(TestCamera(), Pyramid());
  map.Apply(scene.map().TakeDelta(MapEvent::kMapped, {}, {}));
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  Relocalizer relocalizer(std::make_shared<const Vocabulary>(
      LoadOrbVocabulary(std::string(source == nullptr ? "." : source) + "/data/vocabulary.dmv")));
  relocalizer.Update(map);
  PoseSearch search({}, TestCamera());
  LatePlacement placement(MapScene::kSession, 0, 0, {});
  TrackedFrame frame = scene.See(330, 330 * MapScene::kStepNs, MapScene::PoseAt(0.3));
  return placement.Place(map, LateMap::kGrows, {&search, relocalizer, {}}, &frame).report;
}

TEST(RecognisedLate, APlaceThatMayBeAPersonIsNotBelieved) {
  EXPECT_TRUE(PlacedWhere(false).HasPose()) << "nothing can be proven yet";
  EXPECT_FALSE(PlacedWhere(true).HasPose()) << "what was seen for 0.2 s may be a person";
}

}  // namespace
}  // namespace dmslam
