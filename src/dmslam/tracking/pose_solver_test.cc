// A frame's pose by its matches: each mechanism fails its test when it is taken out.
#include "dmslam/tracking/pose_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

constexpr int64_t kNow = 10'000'000'000;

constexpr int64_t Ago(double seconds) { return kNow - static_cast<int64_t>(seconds * 1e9); }

/// A camera before a wall at depth 4, and somebody before it who may have gone since he was mapped.
class PoseSolverTest : public ::testing::Test {
 protected:
  static constexpr double kMaxChi2 = kChiSquared2Dof;

  /// All over the picture.
  void AddRoom(int count, double age_s, double depth = 4.0) {
    scene_.AddCloud(count, {0, 0, depth}, {0.5 * depth, 0.4 * depth, 0.25 * depth}, Ago(age_s));
    room_ = scene_.size();
  }
  void AddSomebody(int count, double age_s) {
    scene_.AddCloud(count, {0, 0, 2}, {0.2, 0.3, 0.1}, Ago(age_s));
  }

  /// A frame at `truth_` that is matched with all it sees, and believed to be where the first keyframe is.
  TrackedFrame Frame(const MapScene::Place& place) {
    std::vector<size_t> shown;
    TrackedFrame frame = scene_.See(100, kNow, truth_, place, &shown);
    for (size_t i = 0; i < shown.size(); ++i) frame.landmarks[i] = MapScene::IdOf(shown[i]);
    frame.T_cam_world = Rigid3d();
    return frame;
  }
  /// What was mapped after the room has gone by `gone`.
  MapScene::Place Gone(const Eigen::Vector3d& gone) const {
    return [this, gone](size_t i) {
      return std::optional<Eigen::Vector3d>(scene_.point(i) + (i < room_ ? Eigen::Vector3d::Zero() : gone));
    };
  }
  /// All stay, and those of whom `so` says so are seen `right_px` beside their places.
  TrackedFrame FrameBeside(double right_px, const std::function<bool(size_t)>& so) {
    return Frame([this, right_px, so](size_t i) {
      Eigen::Vector3d p_cam = truth_ * scene_.point(i);
      if (so(i)) p_cam.x() += p_cam.z() * right_px / scene_.map().camera().fx_px;
      return std::optional<Eigen::Vector3d>(truth_.Inverse() * p_cam);
    });
  }

  PoseFit Solve(TrackedFrame* frame, const std::optional<PosePrior>& prior = std::nullopt,
                Elderhood elderhood = Elderhood::kCounts) {
    return solver_.Solve(scene_.map(), prior, judge_, frame, elderhood);
  }
  void LetAllBeEqual() { judge_ = &indifferent_; }
  static DynamicsOptions NothingMoves() {
    DynamicsOptions options;
    options.vote.motion_belief = false;
    return options;
  }

  static bool IsOfRoom(LandmarkId id, size_t room) { return id.number() - 1 < room; }
  /// Landmarks of the room, or those mapped later, that the frame is matched with.
  int Matched(const TrackedFrame& frame, bool of_room) const {
    return static_cast<int>(std::ranges::count_if(
        frame.landmarks, [&](LandmarkId id) { return id.valid() && IsOfRoom(id, room_) == of_room; }));
  }
  int Rejected(const PoseFit& fit, bool of_room) const {
    return static_cast<int>(std::ranges::count_if(fit.rejected, [&](const RejectedMatch& match) {
      return IsOfRoom(match.landmark, room_) == of_room;
    }));
  }
  double Error(const Rigid3d& T_cam_world) const { return (T_cam_world.Center() - truth_.Center()).norm(); }
  /// How far to the right the room is seen from there, compared to the truth, in the mean.
  double RightPx(const Rigid3d& T_cam_world) const {
    const Pinhole camera = scene_.map().camera().Ideal();
    double sum = 0;
    for (size_t i = 0; i < room_; ++i)
      sum += (camera.Project(T_cam_world * scene_.point(i)) - camera.Project(truth_ * scene_.point(i))).x();
    return sum / static_cast<double>(room_);
  }
  static int OfClass(const TrackedFrame& frame, FeatureClass c) {
    return static_cast<int>(std::ranges::count(frame.classes, c));
  }
  /// That the camera is nearly certainly where it sees what is mapped at its old place and has gone by
  /// `gone`.
  PosePrior GoneAlong(const Eigen::Vector3d& gone) const {
    return {truth_ * Rigid3d(Eigen::Quaterniond::Identity(), gone), 1e9 * Matrix6d::Identity()};
  }

  const Rigid3d truth_{ExpSo3({0.005, -0.01, 0.005}), Eigen::Vector3d(-0.03, 0.01, 0.02)};
  const Eigen::Vector3d gone_{0.15, 0.0, 0.05};
  MapScene scene_;
  size_t room_ = 0;
  MotionJudge believing_{{}, TestCamera()}, indifferent_{NothingMoves(), TestCamera()};
  MotionJudge* judge_ = &believing_;
  PoseSolver solver_{kMaxChi2};
};

TEST_F(PoseSolverTest, FindsThePoseAndTakesTheMatchesThatDoNotAgree) {
  AddRoom(100, 1);
  scene_.MapAll();
  TrackedFrame frame = FrameBeside(15, [](size_t i) { return i < 10; });
  const int matched = Matched(frame, true);
  const PoseFit fit = Solve(&frame);
  EXPECT_LT(Error(frame.T_cam_world), 1e-3);
  EXPECT_GT(fit.inliers, 80);
  EXPECT_LT(fit.mean_chi2, 0.01) << "the keypoints are rounded to 1/16 px";
  ASSERT_GT(fit.rejected.size(), 7u);
  EXPECT_EQ(fit.inliers + static_cast<int>(fit.rejected.size()), matched);
  for (const RejectedMatch& rejected : fit.rejected) {
    EXPECT_LT(rejected.landmark.number(), 11u);
    EXPECT_NEAR(rejected.chi2, 15.0 * 15.0, 5.0);
    EXPECT_FALSE(frame.landmarks[rejected.feature].valid());
    EXPECT_EQ(frame.classes[rejected.feature], FeatureClass::kRejected);
  }
  EXPECT_EQ(Matched(frame, true), fit.inliers);
  EXPECT_EQ(OfClass(frame, FeatureClass::kUsed), fit.inliers);
}

TEST_F(PoseSolverTest, WhatItIsAskedNextHasNothingToDoWithWhatItWasAsked) {
  AddRoom(100, 1);
  scene_.MapAll();
  TrackedFrame first = FrameBeside(15, [](size_t i) { return i < 10; });
  Solve(&first);
  TrackedFrame second = FrameBeside(0, [](size_t) { return false; });
  EXPECT_TRUE(Solve(&second).rejected.empty());
}

TEST_F(PoseSolverTest, TellsWhatThePoseRestsOn) {
  AddRoom(100, 1);
  scene_.MapAll();
  TrackedFrame frame = FrameBeside(15, [](size_t i) { return i < 10; });
  const PoseFit fit = Solve(&frame);
  const PoseBasis basis = solver_.basis();
  ASSERT_EQ(basis.matches.size(), basis.observations.size());
  ASSERT_EQ(basis.matches.size(), basis.inliers.size());
  for (size_t i = 0; i < basis.matches.size(); ++i) {
    const auto [feature, landmark] = basis.matches[i];
    EXPECT_EQ(basis.observations[i].p_world, landmark->p_world);
    EXPECT_EQ(basis.observations[i].uv_px, frame.features->uv_px[feature]);
    EXPECT_EQ(basis.inliers[i] != 0, landmark->id.number() > 10);
  }
  EXPECT_EQ(basis.mean_chi2, fit.mean_chi2);
  EXPECT_GT(basis.information.determinant(), 0);
}

TEST_F(PoseSolverTest, WhatHasLeftTheMapHasNoSay) {
  AddRoom(60, 1);
  scene_.MapAll();
  TrackedFrame frame = FrameBeside(0, [](size_t) { return false; });
  const int matched = Matched(frame, true);
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (i < 5) scene_.map().RemoveLandmark(scene_.map().At(frame.landmarks[i]));
  }
  EXPECT_EQ(Solve(&frame).inliers, matched - 5);
}

TEST_F(PoseSolverTest, ACoarserFeatureMayLieFartherOff) {
  AddRoom(100, 1);
  scene_.MapAll();
  TrackedFrame frame = FrameBeside(4, [](size_t i) { return i < 10; });
  FeatureSet set = frame.features->set;
  for (Keypoint& keypoint : set.keypoints) keypoint.octave = 4;  // 1.2^4 px
  TrackedFrame coarse(frame.index, frame.stamp_ns,
                      MakeFrameFeatures(std::move(set), scene_.map().camera(), scene_.map().pyramid()));
  coarse.landmarks = frame.landmarks;
  EXPECT_GT(Solve(&frame).rejected.size(), 7u);
  EXPECT_TRUE(Solve(&coarse).rejected.empty());
}

TEST_F(PoseSolverTest, WithTooFewMatchesThePoseStaysAsItWas) {
  AddRoom(100, 1);
  scene_.MapAll();
  TrackedFrame frame = FrameBeside(0, [](size_t) { return false; });
  for (size_t i = 2; i < frame.landmarks.size(); ++i) frame.landmarks[i] = {};
  const Rigid3d before(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.3, 0, 0));
  frame.T_cam_world = before;
  const PoseFit fit = Solve(&frame);
  EXPECT_EQ(fit.inliers, 0);
  EXPECT_EQ(frame.T_cam_world.translation, before.translation);
  EXPECT_EQ(Matched(frame, true), 2) << "nothing contradicts what is not known";
  EXPECT_EQ(OfClass(frame, FeatureClass::kUsed) + OfClass(frame, FeatureClass::kRejected), 0);
}

TEST_F(PoseSolverTest, ThePriorHasItsSay) {
  AddRoom(30, 1);
  scene_.MapAll();
  TrackedFrame frame = FrameBeside(0, [](size_t) { return false; });
  PosePrior prior{Rigid3d(ExpSo3({0, 0.001, 0}), Eigen::Vector3d::Zero()) * truth_,
                  1e9 * Matrix6d::Identity()};
  Solve(&frame, prior);
  EXPECT_LT(AngleBetween(frame.T_cam_world.rotation, prior.T_cam_world.rotation), 2e-4);
}

// ---- Age ----

// Half of them are seen a little to the right.
TEST_F(PoseSolverTest, YoungLandmarksWeighLess) {
  AddRoom(18, 10);
  AddRoom(18, 0);
  scene_.MapAll();
  const auto young = [](size_t i) { return i >= 18; };
  TrackedFrame frame = FrameBeside(2, young);
  ASSERT_EQ(Matched(frame, true), 36) << "so few are not divided into elders and others";
  EXPECT_FALSE(Solve(&frame).by_trusted_elders);
  EXPECT_LT(RightPx(frame.T_cam_world), 0.7);
  LetAllBeEqual();
  frame = FrameBeside(2, young);
  Solve(&frame);
  EXPECT_NEAR(RightPx(frame.T_cam_world), 1.0, 0.15) << "all are equal";
}

TEST_F(PoseSolverTest, ThoseWhoAreOlderThanPeopleStandDecideAgainstAnyNumberOfOthers) {
  AddRoom(80, 10);
  AddSomebody(110, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(gone_));
  const PoseFit fit = Solve(&frame);
  EXPECT_TRUE(fit.by_trusted_elders);
  EXPECT_FALSE(fit.by_rival);
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
  EXPECT_EQ(Rejected(fit, false), 110);
  EXPECT_EQ(Rejected(fit, true), 0);
  EXPECT_EQ(Matched(frame, false), 0);
}

/// The map grows into the past: of the room it has known for six seconds what is seen, of somebody for half a
/// second.
TEST_F(PoseSolverTest, WhereTimeRunsBackwardsThoseSeenForLongestDecide) {
  AddRoom(80, -6);
  AddSomebody(110, -0.4);
  scene_.MapAll(4, 0.05, 110, Ago(-0.4));
  Keyframe later = scene_.map().keyframes().begin()->second;
  later.id = KeyframeId::Make(MapScene::kSession, 280);
  later.stamp_ns = Ago(-6);
  scene_.map().AddKeyframe(later);
  for (size_t i = 0; i < room_; ++i) {
    scene_.map().SetObservation(scene_.map().At(later.id), static_cast<uint16_t>(i),
                                scene_.map().At(MapScene::IdOf(i)));
  }
  TrackedFrame frame = Frame(Gone(gone_));
  const PoseFit fit = Solve(&frame);
  EXPECT_TRUE(fit.by_trusted_elders);
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
  EXPECT_EQ(Rejected(fit, true), 0);
}

TEST_F(PoseSolverTest, WhereAgeDoesNotCountOrNothingMovesTheMajorityDecides) {
  AddRoom(80, 10);
  AddSomebody(110, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(gone_));
  const PoseFit ignored = Solve(&frame, std::nullopt, Elderhood::kIgnored);
  EXPECT_FALSE(ignored.by_trusted_elders);
  LetAllBeEqual();
  frame = Frame(Gone(gone_));
  const PoseFit equal = Solve(&frame);
  EXPECT_FALSE(equal.by_trusted_elders);
  EXPECT_FALSE(equal.by_rival);
  EXPECT_GT(Error(frame.T_cam_world), 0.1);
  EXPECT_GT(Matched(frame, false), 100);
}

TEST_F(PoseSolverTest, EldersWhoAreYoungerThanPeopleStandDecideButAreNotTrusted) {
  AddRoom(80, 3);
  AddSomebody(110, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(gone_));
  const PoseFit fit = Solve(&frame);
  EXPECT_FALSE(fit.by_trusted_elders);
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
  EXPECT_EQ(Rejected(fit, false), 110);
}

TEST_F(PoseSolverTest, EldersWhoDoNotAgreeDecideNothing) {
  AddRoom(80, 10);
  AddRoom(110, 1);
  scene_.MapAll();
  const auto scattered = [](size_t i) { return i < 80 && i % 2 == 0; };
  int sign = 1;
  TrackedFrame frame = Frame([&](size_t i) {
    Eigen::Vector3d p = scene_.point(i);
    if (scattered(i)) p += (sign = -sign) * 0.02 * static_cast<double>(1 + i % 7) * Eigen::Vector3d(1, 1, 0);
    return std::optional<Eigen::Vector3d>(p);
  });
  const PoseFit fit = Solve(&frame);
  EXPECT_FALSE(fit.by_trusted_elders) << "half of them agree";
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
}

/// Of the elders more are limbs of somebody who has just begun to move than are room, and most agree with a
/// pose between them, badly. All matches together know better.
TEST_F(PoseSolverTest, EldersAreNotTakenAtACompromise) {
  scene_.AddCloud(80, {-1.5, 0, 4}, {0.4, 1.5, 0.5}, Ago(2));
  const size_t arm = scene_.size();
  scene_.AddCloud(60, {-0.3, 0.3, 2}, {0.3, 0.2, 0.1}, Ago(2));
  const size_t leg = scene_.size();
  scene_.AddCloud(60, {-0.3, -0.3, 2}, {0.3, 0.2, 0.1}, Ago(2));
  const size_t rest = scene_.size();
  scene_.AddCloud(100, {1, 0, 4}, {0.8, 1.6, 1}, Ago(1));
  scene_.MapAll();
  TrackedFrame frame = Frame([&](size_t i) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    if (i >= arm && i < leg) moved = {0.015, 0, 0.01};
    if (i >= leg && i < rest) moved = {-0.01, 0.01, 0};
    return std::optional<Eigen::Vector3d>(scene_.point(i) + moved);
  });
  const PoseFit fit = Solve(&frame);
  EXPECT_LT(Error(frame.T_cam_world), 1e-3);
  EXPECT_EQ(fit.inliers, 180);
}

TEST_F(PoseSolverTest, WhereAllAreOldNobodyIsAnElder) {
  AddRoom(120, 10);
  scene_.MapAll();
  TrackedFrame frame = FrameBeside(0, [](size_t) { return false; });
  EXPECT_FALSE(Solve(&frame).by_trusted_elders);
}

// What the young ones say is not quite what the elders say.
TEST_F(PoseSolverTest, AllYoungOnesTogetherWeighHalfAsMuchAsTheElders) {
  AddRoom(80, 10);
  AddRoom(110, 3.99);
  scene_.MapAll();
  const auto young = [](size_t i) { return i >= 80; };
  TrackedFrame frame = FrameBeside(2, young);
  const PoseFit fit = Solve(&frame);
  EXPECT_TRUE(fit.by_trusted_elders);
  EXPECT_TRUE(fit.rejected.empty());
  EXPECT_NEAR(RightPx(frame.T_cam_world), 2.0 / 3.0, 0.1);
  frame = FrameBeside(2, young);
  Solve(&frame, std::nullopt, Elderhood::kIgnored);
  EXPECT_NEAR(RightPx(frame.T_cam_world), 2.0 * 110 / 190, 0.1) << "by their number";
}

// ---- The wider motion ----

// Most matches, and what was known before, follow somebody; the room is all around.
TEST_F(PoseSolverTest, TheMotionThatHoldsMoreOfThePictureIsTheCamerasWhateverWasExpected) {
  AddRoom(80, 1);
  AddSomebody(110, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(gone_));
  const PoseFit fit = Solve(&frame, GoneAlong(gone_));
  EXPECT_TRUE(fit.by_rival);
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
  EXPECT_EQ(Rejected(fit, false), 110);
  EXPECT_EQ(Matched(frame, false), 0);
  EXPECT_EQ(fit.inliers, Matched(frame, true));
  EXPECT_EQ(OfClass(frame, FeatureClass::kUsed), fit.inliers);
}

TEST_F(PoseSolverTest, TheMotionThatHoldsLessOfThePictureIsNot) {
  AddRoom(150, 1);
  AddSomebody(25, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone({0.3, 0.1, 0}));
  frame.T_cam_world = truth_;
  const PoseFit fit = Solve(&frame);
  EXPECT_FALSE(fit.by_rival);
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
  EXPECT_EQ(Rejected(fit, false), 25);
}

TEST_F(PoseSolverTest, WhatContradictsTheTrustedEldersIsNotAsked) {
  scene_.AddCloud(80, {0, 0, 2}, {0.2, 0.3, 0.1}, Ago(10));  // all that is old is small in the picture
  room_ = scene_.size();
  scene_.AddCloud(100, {0, 0, 4}, {2, 1.6, 0.2}, Ago(1));
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(gone_));
  const PoseFit fit = Solve(&frame);
  EXPECT_TRUE(fit.by_trusted_elders);
  EXPECT_FALSE(fit.by_rival);
  EXPECT_LT(Error(frame.T_cam_world), 5e-3);
  frame = Frame(Gone(gone_));
  EXPECT_TRUE(Solve(&frame, std::nullopt, Elderhood::kIgnored).by_rival) << "else it would win";
}

// Those who stood for a while are older than the room behind them, which the camera has just turned to.
TEST_F(PoseSolverTest, WhatEldersRejectedComesBackWithTheWiderMotion) {
  AddRoom(80, 1);
  AddSomebody(110, 3);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(gone_));
  const PoseFit fit = Solve(&frame);
  EXPECT_TRUE(fit.by_rival);
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
  EXPECT_EQ(Rejected(fit, true), 0);
  EXPECT_EQ(Rejected(fit, false), 110);
  EXPECT_GT(Matched(frame, true), 60);
}

TEST_F(PoseSolverTest, FewWhoContradictAreNoMotion) {
  scene_.AddCloud(19, {0, 0, 4}, {1.8, 1.4, 0.2}, Ago(1));
  room_ = scene_.size();
  AddSomebody(60, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(gone_));
  ASSERT_LT(Matched(frame, true), 20);
  EXPECT_FALSE(Solve(&frame).by_rival);
}

// Far behind both is much that the two motions explain alike.
TEST_F(PoseSolverTest, WhatBothMotionsExplainSpeaksForNone) {
  const double far = 400;
  const Eigen::Vector3d aside(0.06, 0, 0);
  AddRoom(60, 1);
  AddRoom(100, 1, far);
  AddSomebody(110, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(aside));
  PoseFit fit = Solve(&frame);
  EXPECT_TRUE(fit.by_rival) << "what is far away does not speak for somebody";
  EXPECT_LT(Error(frame.T_cam_world), 5e-3);
}

TEST_F(PoseSolverTest, WhatBothMotionsExplainDoesNotMakeTheRivalWider) {
  const double far = 400;
  const Eigen::Vector3d aside(0.06, 0, 0);
  AddRoom(100, 1);
  AddRoom(500, 1, far);
  AddSomebody(30, 1);
  scene_.MapAll();
  TrackedFrame frame = Frame(Gone(aside));
  const PoseFit fit = Solve(&frame);
  EXPECT_FALSE(fit.by_rival);
  EXPECT_LT(Error(frame.T_cam_world), 5e-3);
}

// ---- What is seen elsewhere ----

/// The frame was matched with somebody alone, and sees the room elsewhere.
class FollowWiderMotionTest : public PoseSolverTest {
 protected:
  static constexpr size_t kRoom = 80;
  const Eigen::Vector3d step_{0.05, 0.0, 0.0};

  void SetUp() override {
    AddRoom(kRoom, 1);
    AddSomebody(60, 1);
    scene_.MapAll();
  }
  /// Somebody has gone; only he and the first `matched` of the room are matched.
  TrackedFrame FollowingSomebody(size_t hidden_from = kRoom) {
    TrackedFrame frame = Frame([&](size_t i) {
      if (i >= hidden_from && i < room_) return std::optional<Eigen::Vector3d>();
      return Gone(step_)(i);
    });
    for (LandmarkId& id : frame.landmarks) {
      if (IsOfRoom(id, room_)) id = {};
    }
    Solve(&frame);
    return frame;
  }
  void Judge(TrackedFrame* frame) {
    std::vector<ExpectedLandmark> expected;
    for (size_t i = 0; i < scene_.size(); ++i) {
      const Landmark& landmark = *scene_.map().FindLandmark(MapScene::IdOf(i));
      if (const auto view = PredictView(scene_.map(), landmark, frame->T_cam_world))
        expected.push_back({&landmark, *view});
    }
    judge_->Judge(scene_.map(), expected, {}, frame);
  }
  bool Follow(TrackedFrame* frame) {
    return solver_.FollowWiderMotion(scene_.map(), std::nullopt, *judge_, frame);
  }
};

TEST_F(FollowWiderMotionTest, TheRoomThatIsSeenElsewhereTakesTheFrame) {
  TrackedFrame frame = FollowingSomebody();
  ASSERT_GT(Error(frame.T_cam_world), 0.03);
  Judge(&frame);
  ASSERT_GE(judge_->moved().size(), 20u);
  ASSERT_TRUE(Follow(&frame));
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
  EXPECT_EQ(Matched(frame, false), 0);
  EXPECT_GE(Matched(frame, true), static_cast<int>(judge_->moved().size()) * 9 / 10);
  EXPECT_EQ(OfClass(frame, FeatureClass::kUsed) + OfClass(frame, FeatureClass::kMoving), 0) << "not yet";
}

TEST_F(FollowWiderMotionTest, FewThatAreSeenElsewhereDoNot) {
  TrackedFrame frame = FollowingSomebody(18);
  Judge(&frame);
  ASSERT_GE(judge_->moved().size(), 10u);
  ASSERT_LT(judge_->moved().size(), 20u);
  const TrackedFrame before = frame;
  EXPECT_FALSE(Follow(&frame));
  EXPECT_EQ(frame.landmarks, before.landmarks);
}

TEST_F(FollowWiderMotionTest, SomebodyWhoIsSeenElsewhereDoesNot) {
  TrackedFrame frame = Frame(Gone(step_));
  for (LandmarkId& id : frame.landmarks) {
    if (!IsOfRoom(id, room_)) id = {};
  }
  Solve(&frame);
  Judge(&frame);
  ASSERT_GE(judge_->moved().size(), 20u);
  const int matched = Matched(frame, true);
  EXPECT_FALSE(Follow(&frame));
  EXPECT_EQ(Matched(frame, true), matched);
  EXPECT_EQ(Matched(frame, false), 0);
  EXPECT_LT(Error(frame.T_cam_world), 2e-3);
}

TEST_F(FollowWiderMotionTest, NothingIsFollowedWhereNothingMoves) {
  LetAllBeEqual();
  TrackedFrame frame = FollowingSomebody();
  Judge(&frame);
  ASSERT_GE(judge_->moved().size(), 20u);
  EXPECT_FALSE(Follow(&frame));
  EXPECT_GT(Error(frame.T_cam_world), 0.03);
}

}  // namespace
}  // namespace dmslam
