// A frame's pose in a map, each way of finding it: each mechanism fails its test when it is taken out.
#include "dmslam/tracking/pose_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;
using Result = PoseSearch::FromFrameResult;

constexpr int64_t kNow = 10'000'000'000;

constexpr int64_t Ago(double seconds) { return kNow - static_cast<int64_t>(seconds * 1e9); }
KeyframeId Kf(uint32_t index) { return KeyframeId::Make(MapScene::kSession, index); }

/// A camera before a wall, and somebody before it who may have gone since he was mapped.
class PoseSearchTest : public ::testing::Test {
 protected:
  /// All over the picture.
  void AddRoom(int count, double age_s = 1.0) {
    scene_.AddCloud(count, {0, 0, 4}, {2, 1.6, 0.2}, Ago(age_s));
    room_ = scene_.size();
  }
  void AddSomebody(int count, double age_s = 1.0) {
    scene_.AddCloud(count, {0, 0, 2}, {0.2, 0.3, 0.1}, Ago(age_s));
  }
  bool IsOfRoom(size_t point) const { return point < room_; }
  bool IsOfRoom(LandmarkId id) const { return IsOfRoom(id.number() - 1); }

  /// What a camera at `truth_` sees where somebody has gone by `gone`; a point is left out if `shown` says
  /// so. It is believed to look the other way.
  TrackedFrame See(const std::function<bool(size_t)>& shown = {},
                   const Eigen::Vector3d& gone = Eigen::Vector3d::Zero()) const {
    TrackedFrame frame = scene_.See(100, kNow, truth_, [&](size_t i) {
      const Eigen::Vector3d offset = IsOfRoom(i) ? Eigen::Vector3d::Zero() : gone;
      return shown && !shown(i) ? std::nullopt : std::optional<Eigen::Vector3d>(scene_.point(i) + offset);
    });
    frame.T_cam_world = Rigid3d(ExpSo3({0, M_PI, 0}), Eigen::Vector3d::Zero());
    return frame;
  }
  /// The same, each point up to `px` beside its place.
  TrackedFrame SeeScattered(double px, const std::function<bool(size_t)>& shown = {}) const {
    Random random(8);
    return scene_.See(100, kNow, truth_, [&](size_t i) {
      Eigen::Vector3d p_cam = truth_ * scene_.point(i);
      const double right_px = random.Uniform(-px, px), down_px = random.Uniform(-px, px);
      p_cam += p_cam.z() / 500 * Eigen::Vector3d(right_px, down_px, 0);
      return shown && !shown(i) ? std::nullopt : std::optional<Eigen::Vector3d>(truth_.Inverse() * p_cam);
    });
  }
  /// The truth, turned to the left by so many pixels.
  Rigid3d Beside(double px) const {
    return Rigid3d(ExpSo3({0, px / 500, 0}), Eigen::Vector3d::Zero()) * truth_;
  }
  /// The first keyframe, which sees all, as a frame that saw what `saw` says.
  TrackedFrame Last(const std::function<bool(size_t)>& saw = {}) const {
    TrackedFrame last = TrackedFrame::Of(*scene_.map().FindKeyframe(Kf(0)));
    for (LandmarkId& id : last.landmarks) {
      if (saw && !saw(id.number() - 1)) id = {};
    }
    return last;
  }
  /// Matches the frame's features with the landmarks that they show, where `so` says so.
  static void Match(const std::function<bool(size_t)>& so, const MapScene& scene, TrackedFrame* frame) {
    for (size_t i = 0; i < frame->features->size(); ++i) {
      for (size_t point = 0; point < scene.size(); ++point) {
        const Landmark* landmark = scene.map().FindLandmark(MapScene::IdOf(point));
        if (landmark == nullptr || !so(point)) continue;
        if (HammingDistance(landmark->descriptor, frame->features->set.descriptors[i]) == 0)
          frame->landmarks[i] = landmark->id;
      }
    }
  }
  /// So many bits of the descriptors of those that `so` names are wrong.
  void Blur(size_t bits, const std::function<bool(size_t)>& so, TrackedFrame* frame) const {
    FeatureSet set = frame->features->set;
    for (Descriptor& d : set.descriptors) {
      for (size_t point = 0; point < scene_.size(); ++point) {
        if (!so(point) || HammingDistance(d, LooksOf(point)) != 0) continue;
        for (size_t bit = 0; bit < bits; ++bit) d.words[bit % 4] ^= uint64_t{1} << (bit / 4);
        break;
      }
    }
    frame->features = MakeFrameFeatures(std::move(set), scene_.map().camera(), scene_.map().pyramid());
  }
  const Descriptor& LooksOf(size_t point) const {
    return scene_.map().FindLandmark(MapScene::IdOf(point))->descriptor;
  }
  /// The frame at its place, matched with what it sees of those that `so` names.
  TrackedFrame Matched(TrackedFrame frame, const std::function<bool(size_t)>& so) const {
    Match(so, scene_, &frame);
    frame.T_cam_world = truth_;
    return frame;
  }
  int CountMatches(const TrackedFrame& frame, bool of_room = true) const {
    return static_cast<int>(std::ranges::count_if(
        frame.landmarks, [&](LandmarkId id) { return id.valid() && IsOfRoom(id) == of_room; }));
  }
  double Error(const TrackedFrame& frame) const {
    return (frame.T_cam_world.Center() - truth_.Center()).norm() +
           AngleBetween(frame.T_cam_world.rotation, truth_.rotation);
  }
  static PosePrior Certainly(const Rigid3d& T_cam_world) {
    return {T_cam_world, 1e10 * Matrix6d::Identity()};
  }
  /// Where the camera would be if somebody who has gone by `gone` were the room.
  Rigid3d GoneAlong(const Eigen::Vector3d& gone) const {
    return truth_ * Rigid3d(Eigen::Quaterniond::Identity(), gone);
  }
  TrackingReport InLocalMap(TrackedFrame* frame, bool careful = false) {
    return search_->InLocalMap(scene_.map(), careful, std::nullopt, frame);
  }
  /// Evidence on the room, or on somebody.
  struct Evidence {
    int moved = 0, found = 0, visible = 0;
  };
  Evidence Believed(bool of_room) {
    Evidence sum;
    for (const FrameEvidence::Item& item : search_->judge().TakeEvidence(kNow, 1).items) {
      if (IsOfRoom(item.landmark) != of_room) continue;
      sum.moved += item.moved;
      sum.found += item.found;
      sum.visible += item.visible;
    }
    return sum;
  }
  void Begin(const TrackingOptions& options = {}) { search_.emplace(options, scene_.map().camera()); }

  void SetUp() override { Begin(); }

  const Rigid3d truth_{ExpSo3({0.002, -0.003, 0.002}), Eigen::Vector3d(-0.03, 0.01, 0.02)};
  MapScene scene_;
  size_t room_ = 0;
  std::optional<PoseSearch> search_;
};

// ---- From the last frame ----

TEST_F(PoseSearchTest, AFrameIsFoundNearWhereItIsPredicted) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame frame = See();
  EXPECT_EQ(search_->FromFrame(scene_.map(), Last(), Beside(8), {}, &frame), Result::kFound);
  EXPECT_LT(Error(frame), 2e-3);
  EXPECT_GT(CountMatches(frame), 80);
}

TEST_F(PoseSearchTest, WhereLittleIsNearItIsLookedForTwiceAsFar) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame frame = See();
  EXPECT_EQ(search_->FromFrame(scene_.map(), Last(), Beside(22), {}, &frame), Result::kFound);
  EXPECT_LT(Error(frame), 2e-3);
  frame = See();
  EXPECT_EQ(search_->FromFrame(scene_.map(), Last(), Beside(50), {}, &frame), Result::kNotSeen);
  EXPECT_EQ(CountMatches(frame), 0);
}

TEST_F(PoseSearchTest, FewerThanAreAskedAreNotSeen) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame frame = See([](size_t i) { return i < 15; });
  EXPECT_EQ(search_->FromFrame(scene_.map(), Last(), truth_, {}, &frame), Result::kNotSeen);
}

TEST_F(PoseSearchTest, WhatIsNearButNotInItsPlaceContradicts) {
  AddRoom(40);
  scene_.MapAll();
  TrackedFrame frame = SeeScattered(9);
  EXPECT_EQ(search_->FromFrame(scene_.map(), Last(), truth_, {}, &frame), Result::kContradicted);
}

/// Somebody hides all but a third of what the last frame saw.
TEST_F(PoseSearchTest, WhatIsMostlyHiddenContradictsNothing) {
  AddRoom(120);
  scene_.MapAll();
  TrackedFrame frame = SeeScattered(9, [](size_t i) { return i % 3 == 0; });
  EXPECT_EQ(search_->FromFrame(scene_.map(), Last(), truth_, {}, &frame), Result::kNotSeen);
}

TEST_F(PoseSearchTest, AWiderMotionThanThatOfTheFramesBeforeIsTold) {
  AddRoom(80);
  AddSomebody(110);
  scene_.MapAll();
  const Eigen::Vector3d gone(0.1, 0, 0);
  TrackedFrame frame = See({}, gone);
  EXPECT_EQ(search_->FromFrame(scene_.map(), Last(), GoneAlong(gone), {}, &frame), Result::kFoundRival);
  EXPECT_LT(Error(frame), 3e-3);
}

TEST_F(PoseSearchTest, WhatWasTriedBeforeIsForgotten) {
  AddRoom(100);
  scene_.MapAll();
  const auto before = [&] {
    TrackedFrame frame = See();
    Match([](size_t i) { return i >= 90; }, scene_, &frame);
    for (FeatureClass& c : frame.classes) c = FeatureClass::kMoving;
    return frame;
  };
  TrackedFrame frame = before();
  ASSERT_GT(CountMatches(frame), 0);
  search_->FromFrame(scene_.map(), Last([](size_t i) { return i < 60; }), Beside(3), {}, &frame);
  const auto invented = [&] {
    int count = static_cast<int>(std::ranges::count(frame.classes, FeatureClass::kMoving));
    for (const LandmarkId id : frame.landmarks) count += id.valid() && id.number() > 90 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(invented(), 0);
  frame = before();
  PoseSearch nowhere({}, scene_.map().camera());
  EXPECT_EQ(nowhere.FromPrediction(scene_.map(), truth_, {}, &frame), 0) << "there is no local map";
  EXPECT_EQ(invented(), 0);
}

TEST_F(PoseSearchTest, WhatWasKnownBeforehandHasItsSay) {
  AddRoom(60);
  scene_.MapAll();
  const PosePrior prior = Certainly(Beside(1));
  const auto expect_prior = [&](const TrackedFrame& frame) {
    EXPECT_LT(AngleBetween(frame.T_cam_world.rotation, prior.T_cam_world.rotation), 3e-4);
  };
  TrackedFrame frame = See();
  search_->FromFrame(scene_.map(), Last(), truth_, prior, &frame);
  expect_prior(frame);
  search_->InLocalMap(scene_.map(), false, prior, &frame);
  expect_prior(frame);
  search_->FromPrediction(scene_.map(), truth_, prior, &frame);
  expect_prior(frame);
  frame = See();
  EXPECT_TRUE(search_->FromKeyframe(scene_.map(), Kf(0), 1, prior, &frame));
  expect_prior(frame);
}

// ---- From the prediction alone ----

TEST_F(PoseSearchTest, AroundAPredictionManyMoreAreLookedForThanTheLastFrameSaw) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame last = Matched(See(), [](size_t i) { return i < 12; });
  InLocalMap(&last);
  TrackedFrame frame = See();
  EXPECT_GT(search_->FromPrediction(scene_.map(), Beside(7), {}, &frame), 80);
  EXPECT_LT(Error(frame), 2e-3);
}

TEST_F(PoseSearchTest, WhatHasLeftTheMapIsNotLookedFor) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame last = Matched(See(), [](size_t) { return true; });
  InLocalMap(&last);
  for (size_t i = 0; i < 10; ++i) scene_.map().RemoveLandmark(scene_.map().At(MapScene::IdOf(i)));
  TrackedFrame frame = See();
  const int inliers = search_->FromPrediction(scene_.map(), truth_, {}, &frame);
  EXPECT_GT(inliers, 70);
  EXPECT_LE(inliers, 90);
}

// Of all that should be seen one is found, with many wrong bits.
TEST_F(PoseSearchTest, AMatchAloneAmongThoseThatAreHiddenMustLookLikeItsLandmark) {
  AddRoom(200);
  scene_.MapAll();
  const auto on_the_left = [&](size_t i) { return scene_.point(i).x() < 0; };
  const size_t alone = [&] {
    size_t i = 0;
    while (scene_.point(i).x() > -0.8 || scene_.point(i).x() < -1.2) ++i;
    return i;
  }();
  for (const bool hidden : {false, true}) {
    TrackedFrame frame = See([&](size_t i) { return i == alone || !hidden || !on_the_left(i); });
    Blur(
        70, [&](size_t i) { return i == alone; }, &frame);
    frame = Matched(std::move(frame), [&](size_t i) { return !on_the_left(i); });
    InLocalMap(&frame);
    EXPECT_EQ(std::ranges::count(frame.landmarks, MapScene::IdOf(alone)), hidden ? 0 : 1);
  }
}

// ---- From a keyframe ----

TEST_F(PoseSearchTest, AKeyframesFeaturesFindTheFrameWhereverItWasBelieved) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame frame = See();
  EXPECT_TRUE(search_->FromKeyframe(scene_.map(), Kf(0), 1, {}, &frame));
  EXPECT_LT(Error(frame), 2e-3);
  EXPECT_GT(CountMatches(frame), 80);
}

TEST_F(PoseSearchTest, AKeyframeThatIsGoneFindsNothing) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame frame = See();
  EXPECT_FALSE(search_->FromKeyframe(scene_.map(), Kf(77), 1, {}, &frame));
}

TEST_F(PoseSearchTest, FewOfAKeyframesFeaturesFindNothing) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame frame = See([](size_t i) { return i < 14; });
  EXPECT_FALSE(search_->FromKeyframe(scene_.map(), Kf(0), 1, {}, &frame));
}

TEST_F(PoseSearchTest, WhatAKeyframesFeaturesSayAgainstAllThatIsKnownIsNotBelieved) {
  AddRoom(100);
  scene_.MapAll();
  TrackedFrame frame = See();
  EXPECT_FALSE(search_->FromKeyframe(scene_.map(), Kf(0), 1, Certainly(Beside(40)), &frame));
}

TEST_F(PoseSearchTest, AKeyframesFeaturesWithoutACommonPoseLeaveTheFrameAsItWas) {
  AddRoom(40);
  scene_.MapAll();
  TrackedFrame frame = SeeScattered(100);
  frame.T_cam_world = Beside(40);
  EXPECT_FALSE(search_->FromKeyframe(scene_.map(), Kf(0), 1, {}, &frame));
  EXPECT_EQ(AngleBetween(frame.T_cam_world.rotation, Beside(40).rotation), 0.0);
  EXPECT_EQ(CountMatches(frame), 0);
}

// ---- From a turn ----

TEST_F(PoseSearchTest, ACameraThatTurnedTooFastIsFoundByItsTurn) {
  AddRoom(300);
  scene_.MapAll();
  const Rigid3d before = Beside(60);
  TrackedFrame frame = See();
  EXPECT_TRUE(search_->FromTurn(scene_.map(), Last(), before, {.most_rad = 0.3}, &frame));
  EXPECT_LT(Error(frame), 2e-3);
  EXPECT_GT(CountMatches(frame), 150);
  frame = See();
  EXPECT_FALSE(search_->FromTurn(scene_.map(), Last(), before, {.most_rad = 0.03}, &frame))
      << "it turned farther";
  frame = See();
  EXPECT_FALSE(search_->FromTurn(scene_.map(), Last(), before, {.least_rad = 0.2, .most_rad = 0.3}, &frame))
      << "it turned by less";
}

TEST_F(PoseSearchTest, WhatLooksLikeNothingInTheMapIsNoTurn) {
  AddRoom(300);
  scene_.MapAll();
  TrackedFrame frame = See([](size_t) { return false; });
  EXPECT_FALSE(search_->FromTurn(scene_.map(), Last(), Beside(60), {.most_rad = 0.3}, &frame));
}

TEST_F(PoseSearchTest, ATurnThatNothingFollowsExactlyIsNotBelieved) {
  AddRoom(40);
  scene_.MapAll();
  TrackedFrame frame = SeeScattered(8);
  EXPECT_FALSE(search_->FromTurn(scene_.map(), Last(), Beside(60), {.most_rad = 0.3}, &frame));
}

// ---- In the local map ----

TEST_F(PoseSearchTest, ByAFewMatchesAllThatLiesAroundIsFound) {
  AddRoom(150);
  scene_.MapAll();
  TrackedFrame frame = Matched(See(), [](size_t i) { return i < 12; });
  EXPECT_EQ(search_->Reference(scene_.map()), nullptr);
  const TrackingReport report = InLocalMap(&frame);
  EXPECT_TRUE(report.HasPose()) << report.reason;
  EXPECT_FALSE(report.IsDoubtful());
  EXPECT_FALSE(report.by_rival);
  EXPECT_LE(report.num_elsewhere, report.num_static);
  EXPECT_GT(report.num_static, 130);
  EXPECT_EQ(report.num_static, CountMatches(frame));
  EXPECT_GE(report.num_expected, report.num_static);
  EXPECT_GT(report.cells, 30);
  EXPECT_LT(report.mean_chi2, 0.01);
  EXPECT_LT(Error(frame), 1e-3);
  ASSERT_NE(search_->Reference(scene_.map()), nullptr);
}

TEST_F(PoseSearchTest, WhereThePoseAloneIsAskedForNothingIsLearntOfLandmarks) {
  AddRoom(150);
  scene_.MapAll();
  TrackedFrame learnt = Matched(See(), [](size_t i) { return i < 12; }), fitted = learnt;
  EXPECT_TRUE(InLocalMap(&learnt).IsTracked());
  EXPECT_FALSE(search_->judge().TakeEvidence(kNow, MapScene::kMap).items.empty());
  EXPECT_TRUE(search_->FitsLocalMap(scene_.map(), &fitted));
  EXPECT_TRUE(search_->judge().TakeEvidence(kNow, MapScene::kMap).items.empty());
  EXPECT_EQ(fitted.landmarks, learnt.landmarks);
  EXPECT_EQ(fitted.T_cam_world.translation, learnt.T_cam_world.translation);
  TrackedFrame hidden = Matched(See([](size_t i) { return i < 5; }), [](size_t i) { return i < 5; });
  EXPECT_FALSE(search_->FitsLocalMap(scene_.map(), &hidden));
}

TEST_F(PoseSearchTest, WhatWasFoundIsToldWithItsCovariance) {
  AddRoom(150);
  scene_.MapAll();
  TrackedFrame frame = Matched(See(), [](size_t) { return true; });
  InLocalMap(&frame);
  const FoundPose found = search_->found(frame);
  EXPECT_EQ(found.T_cam_world.translation, frame.T_cam_world.translation);
  EXPECT_TRUE((found.covariance * search_->basis().information).isIdentity(1e-6));
}

TEST_F(PoseSearchTest, OldLandmarksAreCounted) {
  AddRoom(50, 1);
  AddRoom(80, 5);
  scene_.MapAll();
  TrackedFrame frame = Matched(See([](size_t i) { return i < 100; }), [](size_t i) { return i < 50; });
  const TrackingReport report = InLocalMap(&frame);
  EXPECT_GT(report.num_old_expected, 70);
  EXPECT_LE(report.num_old_expected, 80);
  EXPECT_GT(report.num_old, 40);
  EXPECT_LE(report.num_old, 50);
}

TEST_F(PoseSearchTest, ACameraThatWasLostLooksFartherAround) {
  AddRoom(150);
  scene_.MapAll();
  const auto begun = [&] {
    TrackedFrame frame = Matched(See(), [](size_t i) { return i < 12; });
    frame.T_cam_world = Beside(3.8);
    return frame;
  };
  TrackedFrame frame = begun();
  EXPECT_LT(InLocalMap(&frame).num_static, 30);
  frame = begun();
  EXPECT_GT(InLocalMap(&frame, true).num_static, 130);
}

TEST_F(PoseSearchTest, ACameraThatWasLostNeedsMoreThatMatches) {
  AddRoom(150);
  scene_.MapAll();
  const auto tracked = [&](size_t count, bool careful) {
    TrackedFrame frame = See([count](size_t i) { return i < count; });
    frame = Matched(std::move(frame), [](size_t) { return true; });
    const TrackingReport report = InLocalMap(&frame, careful);
    EXPECT_EQ(report.num_static, static_cast<int>(count)) << "all are in the picture";
    if (!report.HasPose()) {
      EXPECT_STREQ(report.reason, "too few static features match the map");
    }
    return report.HasPose();
  };
  EXPECT_FALSE(tracked(19, false));
  EXPECT_TRUE(tracked(20, false));
  EXPECT_FALSE(tracked(29, true));
  EXPECT_TRUE(tracked(30, true));
}

TEST_F(PoseSearchTest, WhatLiesInASmallPartOfThePictureIsNotEnough) {
  AddRoom(600);
  scene_.MapAll();
  const auto near_the_middle = [&](size_t i) { return scene_.point(i).head<2>().norm() < 0.6; };
  TrackedFrame frame = Matched(See(near_the_middle), [](size_t) { return true; });
  const TrackingReport report = InLocalMap(&frame);
  ASSERT_GE(report.num_static, 20);
  EXPECT_FALSE(report.HasPose());
  EXPECT_STREQ(report.reason, "the static features lie in too small a part of the image");
  EXPECT_EQ(Believed(true).found, 0);
}

TEST_F(PoseSearchTest, WhereLittleAndNothingThatHasStoodForLongIsSeenAPoseIsDoubtedAndNotBelieved) {
  constexpr size_t kYoung = 700;
  AddRoom(kYoung, 1);
  AddRoom(100, 10);
  scene_.MapAll();
  const auto tracked = [&](size_t of_the_young, size_t of_the_old, size_t gone = 0) {
    for (size_t i = 0; i < gone; ++i)
      scene_.map().RemoveLandmark(scene_.map().At(MapScene::IdOf(kYoung + of_the_old + i)));
    TrackedFrame frame =
        See([&](size_t i) { return i < of_the_young || (i >= kYoung && i < kYoung + of_the_old); });
    frame = Matched(std::move(frame), [](size_t) { return true; });
    return InLocalMap(&frame);
  };
  TrackingReport report = tracked(60, 1);
  EXPECT_TRUE(report.HasPose());
  EXPECT_TRUE(report.IsDoubtful());
  EXPECT_STREQ(report.reason, "what has stood here for long is not seen");
  EXPECT_EQ(Believed(true).found, 0);
  report = tracked(60, 4);
  EXPECT_FALSE(report.IsDoubtful()) << report.num_old << " of " << report.num_old_expected << " are seen";
  EXPECT_GT(Believed(true).found, 50);
  EXPECT_FALSE(tracked(90, 0).IsDoubtful()) << "more is seen than somebody who hides the room shows";
  TrackingOptions options;
  options.doubt = false;
  Begin(options);
  EXPECT_FALSE(tracked(60, 1).IsDoubtful());
  Begin();
  EXPECT_FALSE(tracked(60, 0, 45).IsDoubtful()) << "hardly anything has stood here for long";
}

TEST_F(PoseSearchTest, WhatMayMatchByChanceIsDoubted) {
  AddRoom(600, 1);
  scene_.MapAll();
  const auto tracked = [&](size_t count, double scattered_px) {
    TrackedFrame frame = SeeScattered(scattered_px, [count](size_t i) { return i < count; });
    frame = Matched(std::move(frame), [](size_t) { return true; });
    const TrackingReport report = InLocalMap(&frame);
    EXPECT_TRUE(report.HasPose()) << report.reason;
    if (report.IsDoubtful()) {
      EXPECT_STREQ(report.reason, "what matches the map may do so by chance");
    }
    return report.IsDoubtful();
  };
  EXPECT_TRUE(tracked(50, 1.7));
  EXPECT_FALSE(tracked(50, 0.5)) << "they are near their places";
  EXPECT_FALSE(tracked(120, 1.7)) << "so many do not match by chance";
}

TEST_F(PoseSearchTest, MoreThatContradictThanAgreeAreTold) {
  AddRoom(150, 10);
  AddSomebody(110, 1);
  scene_.MapAll();
  const Eigen::Vector3d gone(0.15, 0, 0);
  TrackedFrame frame = See([](size_t i) { return i < 50 || i >= 150; }, gone);
  frame = Matched(std::move(frame), [](size_t) { return true; });
  TrackingReport report = InLocalMap(&frame);
  EXPECT_EQ(report.num_static, 50);
  EXPECT_GT(report.num_elsewhere, report.num_static);
  EXPECT_TRUE(report.HasPose());
  report.TakePoseAway();
  EXPECT_EQ(report.outcome, TrackingReport::Outcome::kContradicted);
}

TEST_F(PoseSearchTest, WhatIsSeenElsewhereHasMoved) {
  AddRoom(150, 10);
  AddSomebody(40, 1);
  scene_.MapAll();
  TrackedFrame frame = Matched(See({}, {0.05, 0, 0}), [&](size_t i) { return IsOfRoom(i); });
  const TrackingReport report = InLocalMap(&frame);
  ASSERT_TRUE(report.HasPose());
  EXPECT_GT(report.num_moving, 25);
  EXPECT_GT(Believed(false).moved, 25);
}

// The frame was matched with somebody alone, and what was known beforehand follows him, too.
TEST_F(PoseSearchTest, AWiderMotionAmongTheMatchesIsTold) {
  AddRoom(80);
  AddSomebody(110);
  scene_.MapAll();
  TrackedFrame frame = Matched(See({}, {0.1, 0, 0}), [](size_t) { return true; });
  frame.T_cam_world = GoneAlong({0.1, 0, 0});
  EXPECT_TRUE(InLocalMap(&frame).by_rival);
  EXPECT_LT(Error(frame), 3e-3);
}

TEST_F(PoseSearchTest, TheRoomThatIsSeenElsewhereIsFollowed) {
  AddRoom(150);
  AddSomebody(60);
  scene_.MapAll();
  const Eigen::Vector3d gone(0.06, 0, 0);
  TrackedFrame frame = See({}, gone);
  Blur(
      50, [&](size_t i) { return IsOfRoom(i) && i % 3 == 0; }, &frame);  // found by their places alone
  frame = Matched(std::move(frame), [&](size_t i) { return !IsOfRoom(i); });
  frame.T_cam_world = GoneAlong(gone);
  const TrackingReport report = search_->InLocalMap(scene_.map(), false, Certainly(GoneAlong(gone)), &frame);
  EXPECT_TRUE(report.HasPose());
  EXPECT_TRUE(report.by_rival);
  EXPECT_LT(Error(frame), 2e-3);
  EXPECT_EQ(CountMatches(frame, false), 0);
  EXPECT_GT(report.num_static, 130);
  EXPECT_GT(report.num_moving, 40);
  const FrameEvidence evidence = search_->judge().TakeEvidence(kNow, 1);
  for (const FrameEvidence::Item& item : evidence.items) {
    if (IsOfRoom(item.landmark)) {
      EXPECT_EQ(item.moved, 0);
    }
  }
  EXPECT_TRUE(std::ranges::any_of(evidence.items, [](const auto& item) { return item.moved > 0; }));
}

// Somebody behind a fence has stood for longer than the camera has seen the fence, and is still near his
// place.
TEST_F(PoseSearchTest, WhoIsOlderThanTheRoomDoesNotTakeTheFrameBack) {
  TrackingOptions options;
  options.dynamics.elders.min_elders = 20;
  options.dynamics.elders.share = 0.2;
  options.local_radius_rad = options.local_radius_frontal_rad = 0.02;  // 10 px
  Begin(options);
  scene_.AddCloud(100, {0, 0, 1.8}, {0.9, 0.7, 0.5}, Ago(1));
  room_ = scene_.size();
  scene_.AddCloud(32, {0, 0, 4}, {0.4, 0.6, 0.2}, Ago(10));
  scene_.MapAll();
  const Eigen::Vector3d gone(0.076, 0, 0);  // 9.5 px
  TrackedFrame frame = Matched(See({}, gone), [&](size_t i) { return !IsOfRoom(i); });
  frame.T_cam_world = GoneAlong(gone);
  const TrackingReport report = InLocalMap(&frame);
  EXPECT_TRUE(report.by_rival);
  EXPECT_LT(Error(frame), 3e-3);
  EXPECT_EQ(CountMatches(frame, false), 0);
  EXPECT_GT(CountMatches(frame, true), 60);
}

TEST_F(PoseSearchTest, AgainstLandmarksThatAreOlderThanPeopleStandNothingElsewhereIsFollowed) {
  scene_.AddCloud(80, {0, 0, 2}, {0.5, 0.5, 0.1}, Ago(10));  // all that is old is small in the picture
  room_ = scene_.size();
  scene_.AddCloud(110, {0, 0, 4}, {2, 1.6, 0.2}, Ago(1));
  scene_.MapAll();
  const auto seen = [&] { return See({}, {0.08, 0, 0}); };
  // Beside the old ones only some of the young ones are matched.
  TrackedFrame frame = Matched(seen(), [&](size_t i) { return IsOfRoom(i) || i % 8 == 0; });
  TrackingReport report = InLocalMap(&frame);
  EXPECT_FALSE(report.by_rival);
  EXPECT_LT(Error(frame), 5e-3);
  EXPECT_GT(report.num_moving, 60);
  frame = Matched(seen(), [&](size_t i) { return IsOfRoom(i); });
  EXPECT_TRUE(InLocalMap(&frame).by_rival) << "else it would be";
}

TEST_F(PoseSearchTest, AMapThatIsGoneIsForgotten) {
  AddRoom(150);
  scene_.MapAll();
  TrackedFrame frame = Matched(See(), [](size_t) { return true; });
  InLocalMap(&frame);
  search_->Reset();
  EXPECT_EQ(search_->Reference(scene_.map()), nullptr);
  EXPECT_EQ(Believed(true).found, 0);
  EXPECT_EQ(search_->FromPrediction(scene_.map(), truth_, {}, &frame), 0);
}

}  // namespace
}  // namespace dmslam
