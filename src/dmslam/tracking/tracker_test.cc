// Tracking in a small map: each mechanism fails its test when it is taken out.
#include "dmslam/tracking/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>

#include "dmslam/dynamics/proven.h"
#include "dmslam/map/replica.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kFrameNs = 33'333'333;
constexpr int64_t kStartNs = 10'000'000'000;
constexpr double kStep = 0.01;  // of the camera, per frame [map units]

double ErrorAt(const Rigid3d& T_cam_world, double x) {
  return (T_cam_world.Center() - Eigen::Vector3d(x, 0, 0)).norm();
}

/// A wall and, before it, a group of people who were mapped half a second ago.
class Tracking : public ::testing::Test {
 protected:
  static constexpr size_t kWall = 260, kPeople = 360;

  explicit Tracking(bool motion_belief = true) {
    scene_.AddCloud(kWall, {0, 0, 4}, {1.5, 1.1, 0.3}, 0);  // many seconds old
    scene_.AddCloud(kPeople, {0, 0, 3}, {0.9, 0.8, 0.1}, kStartNs - 500'000'000);
    scene_.MapAll(4, 0.05, 0, kStartNs);
    Tracker::Setup setup;
    setup.camera = TestCamera();
    setup.options.dynamics.vote.motion_belief = motion_belief;
    tracker_.emplace(setup);
    tracker_->BeginAt(*scene_.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, 0)));
  }

  static bool IsPerson(size_t i) { return i >= kWall; }
  /// Hides the wall and most people.
  static bool AllButAPerson(size_t i) { return !IsPerson(i) || i % 8 != 0; }
  static double CameraAt(uint32_t frame) { return kStep * frame; }

  /// The frame in which people have gone by `walked`; `hidden`: points that are not seen.
  TrackedFrame Frame(uint32_t frame, double walked, const std::function<bool(size_t)>& hidden = {}) const {
    return scene_.See(frame, kStartNs + frame * kFrameNs, MapScene::PoseAt(CameraAt(frame)),
                      [&](size_t i) -> std::optional<Eigen::Vector3d> {
                        if (hidden && hidden(i)) return std::nullopt;
                        return scene_.point(i) + Eigen::Vector3d(IsPerson(i) ? walked : 0.0, 0, 0);
                      });
  }
  TrackingResult Track(TrackedFrame frame) { return tracker_->Track(scene_.map(), {}, std::move(frame)); }

  MapScene scene_;
  std::optional<Tracker> tracker_;
};

TEST_F(Tracking, FollowsTheCamera) {
  for (uint32_t frame = 1; frame < 20; ++frame) {
    const TrackingResult result = Track(Frame(frame, 0.0));
    ASSERT_TRUE(result.pose) << result.report.reason;
    EXPECT_LT(ErrorAt(result.frame.T_cam_world, CameraAt(frame)), 2e-3);
    EXPECT_GT(result.report.num_static, 350);
  }
}

class WithoutBelief : public Tracking {
 protected:
  WithoutBelief() : Tracking(false) {}
};

/// People walk off together from frame 5 on. The largest error from frame `from` on: while they have gone a
/// few pixels only, nobody can tell their motion from the camera's, and `unknown` frames may say so.
double WalkAway(const std::function<TrackingResult(uint32_t, double)>& track, uint32_t from = 12,
                int unknown = 0) {
  double worst = 0;
  for (uint32_t frame = 1; frame < 25; ++frame) {
    const double walked = frame < 5 ? 0.0 : 0.006 * (frame - 4);
    const TrackingResult result = track(frame, walked);
    const bool may_be_unknown = frame >= 5 && frame < from;
    if (!result.pose && !(may_be_unknown && unknown-- > 0)) return 1.0;
    if (frame >= from) worst = std::max(worst, ErrorAt(result.frame.T_cam_world, kStep * frame));
  }
  return worst;
}

TEST_F(Tracking, AGroupOfYoungLandmarksDoesNotCarryTheCameraAway) {
  EXPECT_LT(WalkAway([&](uint32_t frame, double walked) { return Track(Frame(frame, walked)); }), 2e-3);
}

TEST_F(WithoutBelief, TheyWouldWereAllLandmarksEqual) {
  EXPECT_GT(WalkAway([&](uint32_t frame, double walked) { return Track(Frame(frame, walked)); }), 0.1);
}

TEST_F(Tracking, WhatWalksIsReportedAsMoved) {
  WalkAway([&](uint32_t frame, double walked) { return Track(Frame(frame, walked)); });
  int moved = 0, wall_moved = 0;
  for (const FrameEvidence::Item& item : tracker_->TakeEvidence(0, 1).items)
    (IsPerson(item.landmark.number() - 1) ? moved : wall_moved) += item.moved;
  EXPECT_GT(moved, 300);
  EXPECT_LT(wall_moved, moved / 10);
}

/// The camera sets off while hardly anything of the room is seen: the motion before does not tell where it
/// is.
TEST_F(Tracking, AWeakPoseIsNotToldButLeadsTheSearchOn) {
  for (uint32_t frame = 1; frame < 6; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  const auto camera_at = [](uint32_t frame) { return CameraAt(frame) + 0.002 * (frame - 5) * (frame - 5); };
  const auto frame_at = [&](uint32_t frame, size_t wall_points) {
    const auto place = [&](size_t i) {
      return i < wall_points ? std::optional(scene_.point(i)) : std::nullopt;
    };
    TrackedFrame seen =
        scene_.See(frame, kStartNs + frame * kFrameNs, MapScene::PoseAt(camera_at(frame)), place);
    seen.T_cam_world = Rigid3d();  // nobody tells the tracker
    return seen;
  };
  for (uint32_t frame = 6; frame < 18; ++frame) {
    const TrackingResult result = Track(frame_at(frame, 12));
    EXPECT_FALSE(result.pose);
    EXPECT_STRNE(result.report.reason, "");
    EXPECT_LT(ErrorAt(result.frame.T_cam_world, camera_at(frame)), 0.05) << frame;
  }
  const TrackingResult again = Track(frame_at(18, kWall));
  ASSERT_TRUE(again.pose) << again.report.reason;
  EXPECT_FALSE(again.relocalized);
  EXPECT_LT(ErrorAt(again.frame.T_cam_world, camera_at(18)), 5e-3);
}

TEST_F(Tracking, InlierThatLieInOneCornerAreNotBelieved) {
  ASSERT_TRUE(Track(Frame(1, 0.0)).pose);
  const auto in_corner = [&](size_t i) { return scene_.point(i).x() > -0.75 || scene_.point(i).y() > -0.1; };
  const TrackingResult result = Track(Frame(2, 0.0, in_corner));
  EXPECT_FALSE(result.pose);
}

TEST_F(Tracking, LostForLongItIsNotLedByAnOldPose) {
  for (uint32_t frame = 1; frame < 4; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  EXPECT_FALSE(Track(Frame(200, 0.0)).pose) << "without a vocabulary nothing else finds it";
}

/// The picture is blurred by the turn: no descriptor says by itself which landmark it shows.
TEST_F(Tracking, WhoTurnedAwayTooFastIsFoundWhereItWas) {
  for (uint32_t frame = 1; frame < 4; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  const Rigid3d turned =
      Rigid3d(ExpSo3({0, 0.1, 0}), Eigen::Vector3d::Zero()) * MapScene::PoseAt(CameraAt(9));
  FeatureSet features = scene_.See(9, 0, turned).features->set;
  Random random(4);
  for (Descriptor& descriptor : features.descriptors) {
    for (int flips = 0; flips < 100; ++flips)
      descriptor.words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
  }
  const MapEditor& map = scene_.map();
  const TrackingResult result = Track(TrackedFrame(
      9, kStartNs + 9 * kFrameNs, MakeFrameFeatures(std::move(features), map.camera(), map.pyramid())));
  ASSERT_TRUE(result.pose) << result.report.reason;
  EXPECT_LT(ErrorAt(result.frame.T_cam_world, CameraAt(9)), 5e-3);
  EXPECT_LT(AngleBetween(result.frame.T_cam_world.rotation, turned.rotation), 2e-3);
}

TEST_F(Tracking, WhoHidesTheRoomIsNotTheRoom) {
  for (uint32_t frame = 1; frame < 4; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  const TrackingResult result = Track(Frame(4, 0.0, AllButAPerson));
  EXPECT_FALSE(result.pose) << "dozens of landmarks agree, and none of those that have stood for long";
  EXPECT_GT(result.report.num_static, 30);
  EXPECT_TRUE(Track(Frame(5, 0.0)).pose) << "it was followed meanwhile";
}

TEST_F(Tracking, WhereMuchIsSeenAPoseNeedsNothingThatHasStoodForLong) {
  for (uint32_t frame = 1; frame < 4; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  const TrackingResult result = Track(Frame(4, 0.0, [](size_t i) { return !IsPerson(i); }));
  ASSERT_TRUE(result.pose) << result.report.reason;
  EXPECT_EQ(result.report.num_old, 0);
  EXPECT_LT(ErrorAt(result.frame.T_cam_world, CameraAt(4)), 2e-3);
}

TEST_F(Tracking, WhatWasDoubtedIsNoConcernOfTheNextMap) {
  for (uint32_t frame = 1; frame < 4; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  Track(Frame(4, 0.0, AllButAPerson));
  ASSERT_TRUE(tracker_->IsUndecided());
  tracker_->BeginAt(*scene_.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, 0)));
  EXPECT_FALSE(tracker_->IsUndecided());
  EXPECT_TRUE(tracker_->TakeEvidence(0, 1).items.empty()) << "nor is what was seen of the landmarks there";
}

TEST_F(Tracking, WhoHidesTheRoomForLongIsFollowedNoFarther) {
  for (uint32_t frame = 1; frame < 4; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  const std::optional<int64_t> believed_ns = tracker_->last_tracked_ns();
  for (uint32_t frame = 4; frame < 33; ++frame) {
    EXPECT_FALSE(Track(Frame(frame, 0.0, AllButAPerson)).pose);
    EXPECT_TRUE(tracker_->IsUndecided()) << "within a second the room may be seen again";
  }
  for (uint32_t frame = 33; frame < 36; ++frame) EXPECT_FALSE(Track(Frame(frame, 0.0, AllButAPerson)).pose);
  EXPECT_FALSE(tracker_->IsUndecided());
  EXPECT_EQ(tracker_->last_tracked_ns(), believed_ns) << "it is lost, from where it was believed last";
}

TEST_F(Tracking, FewMatchesThatLieAnywhereAreChance) {
  for (uint32_t frame = 1; frame < 4; ++frame) ASSERT_TRUE(Track(Frame(frame, 0.0)).pose);
  const auto most = [](size_t i) { return i % 12 != 0; };
  Random random(1);
  const auto scattered = [&](uint32_t frame, double by) {
    return scene_.See(frame, kStartNs + frame * kFrameNs, MapScene::PoseAt(CameraAt(frame)),
                      [&](size_t i) -> std::optional<Eigen::Vector3d> {
                        if (most(i)) return std::nullopt;
                        const Eigen::Vector3d off(random.Uniform(-by, by), random.Uniform(-by, by), 0);
                        return scene_.point(i) + off;
                      });
  };
  EXPECT_TRUE(Track(scattered(4, 0.0)).pose) << "few that are where they should be are enough";
  const TrackingResult result = Track(scattered(5, 0.014));
  EXPECT_FALSE(result.pose) << result.report.mean_chi2 << " over " << result.report.num_static;
}

/// A map so young that people who stood while it was made are older than the wall.
class InAYoungMap : public ::testing::Test {
 protected:
  static constexpr size_t kPeople = 360, kWall = 260;

  void Start(const Eigen::Vector3d& people_half) {
    scene_.AddCloud(kPeople, {0, 0, 3}, people_half, kStartNs - 900'000'000);
    scene_.AddCloud(kWall, {0, 0, 4}, {1.5, 1.1, 0.3}, kStartNs - 500'000'000);
    scene_.MapAll(4, 0.05, 0, kStartNs);
    Tracker::Setup setup;
    setup.camera = TestCamera();
    tracker_.emplace(setup);
    tracker_->BeginAt(*scene_.map().FindKeyframe(KeyframeId::Make(MapScene::kSession, 0)));
  }
  TrackingResult Track(uint32_t frame, double walked) {
    const auto place = [&](size_t i) -> std::optional<Eigen::Vector3d> {
      return scene_.point(i) + Eigen::Vector3d(i < kPeople ? walked : 0.0, 0, 0);
    };
    return tracker_->Track(
        scene_.map(), {},
        scene_.See(frame, kStartNs + frame * kFrameNs, MapScene::PoseAt(kStep * frame), place));
  }

  MapScene scene_;
  std::optional<Tracker> tracker_;
};

TEST_F(InAYoungMap, TheWiderMotionIsTheCameras) {
  Start({0.4, 0.4, 0.1});
  EXPECT_LT(WalkAway([&](uint32_t frame, double walked) { return Track(frame, walked); }, 16, 1), 4e-3);
}

TEST_F(InAYoungMap, NumbersCountToo) {
  Start({1.1, 0.8, 0.1});  // as wide as the wall in the image, and more of them: the wall moves
  EXPECT_GT(WalkAway([&](uint32_t frame, double walked) { return Track(frame, walked); }), 0.05);
}

/// A camera that was lost for a second, in a map whose keyframes span `map_s`.
class Recovering : public ::testing::Test {
 protected:
  static constexpr uint32_t kLost = 5, kFound = 35;

  /// `until`: the first frame that is not shown.
  void Start(double map_s, uint32_t until = kFound) {
    scene_.AddCloud(400, {0, 0, 4}, {1.6, 1.2, 0.5}, mapped_ns_);
    const auto keyframes = static_cast<uint32_t>(map_s * 1e9 / MapScene::kStepNs) + 1;
    scene_.MapAll(keyframes, 0.2 / keyframes);
    for (uint32_t k = 0; k + kSeenLately < keyframes; ++k) {
      const Keyframe& keyframe = scene_.map().At(KeyframeId::Make(MapScene::kSession, k));
      for (uint16_t i = 0; i < scene_.size(); ++i) {
        if (i % one_old_of_ != 0) scene_.map().ClearObservation(keyframe, i);
      }
    }
    replica_.Apply(scene_.map().TakeDelta(MapEvent::kMapStarted, KeyframeId::Make(MapScene::kSession, 1), 1));
    const char* source = std::getenv("DMSLAM_SOURCE_DIR");
    Tracker::Setup setup;
    setup.camera = TestCamera();
    setup.options.usual_speed = usual_speed_;
    setup.vocabulary = std::make_shared<const Vocabulary>(
        LoadOrbVocabulary((source != nullptr ? std::string(source) : ".") + "/data/vocabulary.dmv"));
    tracker_.emplace(setup);
    tracker_->OnMapChanged(replica_);
    tracker_->BeginAt(*replica_.FindKeyframe(KeyframeId::Make(MapScene::kSession, 0)));
    for (uint32_t frame = 1; frame < until; ++frame) Track(frame, frame >= kLost);
  }
  TrackingResult Track(uint32_t frame, bool blind = false) {
    const auto place = [&](size_t i) -> std::optional<Eigen::Vector3d> {
      const bool hidden = blind || i % one_seen_of_ != 0 || std::abs(scene_.point(i).x()) > seen_aside_ ||
                          (hides_old_ && i % one_old_of_ == 0);
      return hidden ? std::nullopt : std::optional(scene_.point(i));
    };
    return tracker_->Track(replica_, {.whereabouts = whereabouts_},
                           scene_.See(frame, frame * kFrameNs, MapScene::PoseAt(kStep * frame), place));
  }
  /// The first frame from `begin` on that has a pose.
  uint32_t FirstFound(uint32_t begin) {
    for (uint32_t frame = begin; frame < begin + 60; ++frame) {
      if (Track(frame).pose) return frame;
    }
    return 0;
  }

  static constexpr uint32_t kSeenLately = 30;  ///< keyframes

  int64_t mapped_ns_ = 0;   ///< of the points
  size_t one_seen_of_ = 1;  ///< points
  size_t one_old_of_ = 1;   ///< points; the others have been seen for a second
  bool hides_old_ = false;
  double seen_aside_ = 1e9;  ///< those no farther to the left or right
  bool usual_speed_ = true;
  Tracker::Whereabouts whereabouts_;
  MapScene scene_;
  Replica replica_{TestCamera(), Pyramid()};
  std::optional<Tracker> tracker_;
};

TEST_F(Recovering, APlaceThatIsSeenAsAWholeIsBelievedAtOnce) {
  Start(1.0);
  EXPECT_TRUE(Track(kFound).pose);
}

TEST_F(Recovering, APlaceIsBelievedWhenItHasPredictedForHalfASecond) {
  Start(1.0);
  one_seen_of_ = 4;
  const TrackingResult first = Track(kFound);
  EXPECT_TRUE(first.relocalized);
  EXPECT_FALSE(first.pose) << "people who stood are places too";
  EXPECT_TRUE(tracker_->TakeEvidence(0, 1).items.empty());
  const uint32_t found = FirstFound(kFound + 1);
  EXPECT_NEAR((found - kFound) / 30.0, 0.5, 0.05);
}

/// As where somebody stands who is in the map: he keeps predicting himself, and the room is not there.
TEST_F(Recovering, InAYoungMapAPlaceThatPredictsNoMoreThanChanceIsNotBelieved) {
  Start(1.0);
  one_seen_of_ = 4;
  EXPECT_TRUE(Track(kFound).relocalized);
  one_seen_of_ = 12;
  for (uint32_t frame = kFound + 1; frame < kFound + 45; ++frame) {
    const TrackingResult result = Track(frame);
    EXPECT_FALSE(result.pose) << frame;
    EXPECT_FALSE(result.relocalized) << frame << ": it is followed";
  }
  one_seen_of_ = 4;
  EXPECT_TRUE(Track(kFound + 45).pose);
}

TEST_F(Recovering, InAYoungMapAPlaceNoWiderThanSomebodyIsNotBelieved) {
  Start(1.0);
  seen_aside_ = 0.3;
  EXPECT_TRUE(Track(kFound).relocalized);
  for (uint32_t frame = kFound + 1; frame < kFound + 45; ++frame) {
    const TrackingResult result = Track(frame);
    EXPECT_FALSE(result.pose) << frame;
    EXPECT_FALSE(result.report.MayMatchByChance()) << frame;
  }
  seen_aside_ = 1.5;
  EXPECT_TRUE(Track(kFound + 45).pose);
}

/// The wall behind somebody shows now and then only.
TEST_F(Recovering, InAYoungMapANarrowPlaceThatShowsWhatIsProvenIsBelieved) {
  one_old_of_ = 10;
  Start(6.0);
  seen_aside_ = 0.3;
  for (uint32_t frame = kFound; frame < kFound + 7; ++frame) EXPECT_FALSE(Track(frame).pose) << frame;
  hides_old_ = true;
  const uint32_t found = FirstFound(kFound + 7);
  EXPECT_NEAR((found - kFound) / 30.0, 0.5, 0.05);
}

TEST_F(Recovering, InAYoungMapOneProvenLandmarkInOneFrameProvesNothing) {
  one_old_of_ = 10;
  Start(6.0);
  seen_aside_ = 0.3;
  const TrackingResult first = Track(kFound);
  EXPECT_GT(CountProven(replica_, first.frame.landmarks, {}), 0);
  hides_old_ = true;
  for (uint32_t frame = kFound + 1; frame < kFound + 45; ++frame) EXPECT_FALSE(Track(frame).pose) << frame;
}

TEST_F(Recovering, AnotherMapTooYoungToProveAnythingMustBeSeenAsAWholeAndPredict) {
  Start(1.0);
  tracker_->BeginLost();
  whereabouts_ = Tracker::InMap{MapScene::kMap + 1};
  const TrackingResult first = Track(kFound);
  EXPECT_TRUE(first.relocalized) << first.report.reason;
  EXPECT_FALSE(first.pose);
  const uint32_t found = FirstFound(kFound + 1);
  EXPECT_NEAR((found - kFound) / 30.0, 0.5, 0.05);
}

TEST_F(Recovering, OfAnotherMapTooYoungToProveAnythingAPartIsNoPlace) {
  Start(1.0);
  tracker_->BeginLost();
  whereabouts_ = Tracker::InMap{MapScene::kMap + 1};
  one_seen_of_ = 4;
  for (uint32_t frame = kFound; frame < kFound + 30; ++frame) EXPECT_FALSE(Track(frame).relocalized);
}

/// As one that looks for a first map of its own, beside that of another camera.
TEST_F(Recovering, WhoMayBeInNoMapBelievesNoPartOfAYoungOne) {
  Start(1.0);
  tracker_->BeginLost();
  whereabouts_ = Tracker::PerhapsInNone{};
  one_seen_of_ = 4;
  for (uint32_t frame = kFound; frame < kFound + 30; ++frame) EXPECT_FALSE(Track(frame).relocalized) << frame;
  one_seen_of_ = 1;
  const uint32_t found = FirstFound(kFound + 30);
  EXPECT_NEAR((found - kFound - 30) / 30.0, 0.5, 0.05) << "seen as a whole it must predict";
}

TEST_F(Recovering, WhoBeginsInAMapLooksAtOnce) {
  Start(1.0);
  tracker_->BeginLost();
  EXPECT_TRUE(Track(kFound).pose);
}

/// Nobody comes half the depth of the room in a quarter of a second.
class FarAway : public Recovering {
 protected:
  static constexpr uint32_t kSoon = kLost + 8;

  TrackingResult TrackFarAway() {
    return tracker_->Track(replica_, {.whereabouts = Tracker::InMap{MapScene::kMap}},
                           scene_.See(kSoon, kSoon * kFrameNs, MapScene::PoseAt(2.0)));
  }
};

TEST_F(FarAway, WhatIsNotProvenIsNoPlace) {
  Start(1.0, kSoon);
  const TrackingResult result = TrackFarAway();
  EXPECT_FALSE(result.relocalized);
  EXPECT_FALSE(tracker_->IsUndecided());
}

TEST_F(FarAway, WhatIsProvenIs) {
  Start(10.0, kSoon);
  const TrackingResult result = TrackFarAway();
  ASSERT_TRUE(result.pose) << result.report.reason;
  EXPECT_TRUE(result.relocalized);
  EXPECT_LT(ErrorAt(result.frame.T_cam_world, 2.0), 0.02);
}

TEST_F(Recovering, ManyProvenLandmarksAreBelievedAtOnce) {
  Start(10.0);
  one_seen_of_ = 4;
  EXPECT_TRUE(Track(kFound).pose);
}

TEST_F(Recovering, SomeProvenLandmarksAreBelievedSoon) {
  Start(10.0);
  one_seen_of_ = 12;
  const TrackingResult first = Track(kFound);
  EXPECT_TRUE(first.relocalized);
  EXPECT_FALSE(first.pose) << CountProven(replica_, first.frame.landmarks, {});
  const uint32_t found = FirstFound(kFound + 1);
  EXPECT_NEAR((found - kFound) / 30.0, 0.12, 0.07) << "half a second is what eight of them take";
}

/// Fifteen points walk off while all others are hidden, and lead the camera's weak poses along. Then they
/// have gone, and some of the others are seen again.
class LedAstray : public Recovering {
 protected:
  static constexpr uint32_t kShown = 18;
  size_t one_shown_of_ = 9;

  TrackingResult TrackAstray(uint32_t frame) {
    const auto place = [&](size_t i) -> std::optional<Eigen::Vector3d> {
      const bool walks = i % 27 == 1;
      const bool seen = frame < kLost || (frame < kShown ? walks : i % one_shown_of_ == 0);
      if (!seen) return std::nullopt;
      const double aside = walks && frame > kLost ? 0.03 * (frame - kLost) : 0.0;
      return scene_.point(i) + Eigen::Vector3d(aside, 0, 0);
    };
    return tracker_->Track(replica_, {.whereabouts = Tracker::InMap{MapScene::kMap}},
                           scene_.See(frame, frame * kFrameNs, MapScene::PoseAt(0), place));
  }
};

TEST_F(LedAstray, IsFoundWhereSomeOfTheRoomIsProven) {
  Start(10.0, 1);
  TrackingResult result;
  for (uint32_t frame = 1; frame < kShown; ++frame) result = TrackAstray(frame);
  ASSERT_FALSE(result.pose);
  ASSERT_GT(ErrorAt(result.frame.T_cam_world, 0), 0.3) << "it was led astray";
  result = TrackAstray(kShown);
  EXPECT_TRUE(result.relocalized) << result.report.reason;
  EXPECT_LT(ErrorAt(result.frame.T_cam_world, 0), 0.02);
  EXPECT_LT(CountProven(replica_, result.frame.landmarks, {}), kManyProven);
}

/// In a map too young to have proven anything it must go on to predict what is seen.
TEST_F(LedAstray, InAYoungMapItIsFoundWhereItCanHaveComeFromWhereItWasTracked) {
  Start(1.0, 1);
  for (uint32_t frame = 1; frame < kShown; ++frame) TrackAstray(frame);
  const TrackingResult first = TrackAstray(kShown);
  EXPECT_TRUE(first.relocalized) << first.report.reason;
  EXPECT_FALSE(first.pose);
  EXPECT_LT(ErrorAt(first.frame.T_cam_world, 0), 0.02);
  uint32_t frame = kShown + 1;
  while (frame < kShown + 60 && !TrackAstray(frame).pose) ++frame;
  EXPECT_NEAR((frame - kShown) / 30.0, 0.5, 0.05);
}

TEST_F(LedAstray, InAYoungMapAPlaceThatMayMatchByChanceIsNone) {
  Start(1.0, 1);
  one_shown_of_ = 12;
  for (uint32_t frame = 1; frame < kShown; ++frame) TrackAstray(frame);
  EXPECT_FALSE(TrackAstray(kShown).relocalized);
}

TEST_F(Recovering, APlaceThatDoesNotPredictIsDropped) {
  Start(1.0);
  one_seen_of_ = 4;
  EXPECT_TRUE(Track(kFound).relocalized);
  for (uint32_t frame = kFound + 1; frame < kFound + 10; ++frame) Track(frame, true);
  const uint32_t found = FirstFound(kFound + 10);
  EXPECT_GE(found, kFound + 10 + 14) << "the half second begins anew";
}

/// One in eight points walks off while all others are hidden, and takes the camera along. Then the others are
/// seen again, in their places.
TEST_F(Recovering, APoseThatFindsLittleGivesWayToOneBesideThatExplainsMuchMore) {
  constexpr uint32_t kShown = 40;
  constexpr double kStepAside = 0.006;
  mapped_ns_ = -10'000'000'000;
  Start(1.0, 1);
  whereabouts_ = Tracker::InMap{MapScene::kMap};
  const auto track = [&](uint32_t frame) {
    const auto place = [&](size_t i) -> std::optional<Eigen::Vector3d> {
      const bool walks = i % 8 == 0;
      if (frame < kShown && !walks) return std::nullopt;
      const double aside = walks ? kStepAside * std::min(frame, kShown) : 0.0;
      return scene_.point(i) + Eigen::Vector3d(aside, 0, 0);
    };
    return tracker_->Track(replica_, {.whereabouts = whereabouts_},
                           scene_.See(frame, frame * kFrameNs, MapScene::PoseAt(0), place));
  };
  for (uint32_t frame = 1; frame + 1 < kShown; ++frame) track(frame);
  ASSERT_GT(ErrorAt(track(kShown - 1).frame.T_cam_world, 0), 0.2) << "it was carried away";
  const TrackingResult result = track(kShown);
  ASSERT_TRUE(result.pose) << result.report.reason;
  EXPECT_FALSE(result.relocalized);
  EXPECT_LT(ErrorAt(result.frame.T_cam_world, 0), 0.02);
}

/// For two seconds a camera goes slowly. Then one in six points walks off quickly while all others are
/// hidden, in a map too young to have proven anything. The largest error of a pose that is told.
class CarriedAway : public Recovering {
 protected:
  static constexpr uint32_t kHidden = 61;

  double WorstTold(bool usual_speed) {
    usual_speed_ = usual_speed;
    Start(1.0, 1);
    double worst = 0, aside = 0;
    for (uint32_t frame = 1; frame < kHidden + 12; ++frame) {
      if (frame > kHidden) aside += std::min(0.1, 0.02 * (frame - kHidden));
      const auto place = [&](size_t i) -> std::optional<Eigen::Vector3d> {
        const bool walks = i % 6 == 0;
        if (frame >= kHidden && !walks) return std::nullopt;
        return scene_.point(i) + Eigen::Vector3d(walks ? aside : 0.0, 0, 0);
      };
      const double x = 0.002 * frame;
      const TrackingResult result =
          tracker_->Track(replica_, {.whereabouts = Tracker::InMap{MapScene::kMap}},
                          scene_.See(frame, frame * kFrameNs, MapScene::PoseAt(x), place));
      if (result.pose) worst = std::max(worst, ErrorAt(result.frame.T_cam_world, x));
    }
    return worst;
  }
};

TEST_F(CarriedAway, ByWhatIsFasterThanTheCameraEverWasItIsNotTold) {
  EXPECT_LT(WorstTold(true), 0.35) << "0.4 depths a second for 0.2 s, from four units away";
}

/// A camera that goes slowly for two seconds and then at 0.9 depths a second; how many frames have no pose.
class SettingOff : public Recovering {
 protected:
  int FramesWithoutPose(size_t one_seen_of) {
    int without = 0;
    double x = 0;
    for (uint32_t frame = 1; frame < 75; ++frame) {
      const double step = frame < 62 ? 0.002 : std::min(0.12, 0.01 * (frame - 61));
      x += step;
      const auto place = [&](size_t i) -> std::optional<Eigen::Vector3d> {
        return frame < 62 || i % one_seen_of == 0 ? std::optional(scene_.point(i)) : std::nullopt;
      };
      without += !tracker_
                      ->Track(replica_, {.whereabouts = Tracker::InMap{MapScene::kMap}},
                              scene_.See(frame, frame * kFrameNs, MapScene::PoseAt(x), place))
                      .pose;
    }
    return without;
  }
};

TEST_F(SettingOff, WhereThePlaceIsSeenAsAWholeItIsBelieved) {
  Start(1.0, 1);
  EXPECT_EQ(FramesWithoutPose(1), 0);
}

TEST_F(SettingOff, WhereManyLandmarksAreProvenItIsBelieved) {
  Start(10.0, 1);
  EXPECT_EQ(FramesWithoutPose(5), 0);
}

TEST_F(SettingOff, ElseItIsNot) {
  Start(1.0, 1);
  EXPECT_GT(FramesWithoutPose(5), 3);
}

TEST_F(CarriedAway, ItWouldBe) { EXPECT_GT(WorstTold(false), 0.6); }

// ---- Projection search ----

TEST_F(Tracking, TheSearchLooksNearTheProjectionOnly) {
  ProjectionSearch search({});
  const LandmarkVotes votes({});
  std::vector<LandmarkId> ids;
  for (size_t i = 0; i < kWall; ++i) ids.push_back(MapScene::IdOf(i));
  for (const double beside : {0.0, 0.01, 0.2}) {  // 0.2 at depth 4: 25 pixels
    TrackedFrame frame = Frame(5, 0.0);
    frame.T_cam_world = MapScene::PoseAt(CameraAt(5) + beside);
    const auto expected = search.MatchLandmarks(scene_.map(), votes, ids, 1.0, &frame);
    EXPECT_GT(expected.size(), kWall / 2);
    const auto matched = std::count_if(frame.landmarks.begin(), frame.landmarks.end(),
                                       [](LandmarkId id) { return id.valid(); });
    if (beside < 0.1) {
      EXPECT_EQ(static_cast<size_t>(matched), expected.size());
    } else {
      EXPECT_LT(matched, 5) << "by chance";
    }
  }
}

}  // namespace
}  // namespace dmslam
