// What becomes the first map: each gate fails its test when it is taken out.
#include "dmslam/initialization/map_gates.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <utility>
#include <vector>

#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

/// A camera that moves past a room at 30 Hz, and reference frames that watch it.
class MapGatesTest : public ::testing::Test {
 protected:
  static constexpr size_t kPoints = 200;

  MapGatesTest() {
    Random random(5);
    for (size_t k = 0; k < kPoints; ++k) {
      const Eigen::Vector3d ray = camera_.Ray({random.Uniform(150, 490), random.Uniform(100, 380)});
      points_.push_back(random.Uniform(2.0, 5.0) * ray);
    }
  }

  Rigid3d PoseAt(uint32_t frame) const {
    return Rigid3d(ExpSo3({0.0, 0.003 * frame, 0.0}), step_ * frame * Eigen::Vector3d(1.0, 0.1, 0.2));
  }
  Rigid3d Motion(uint32_t from, uint32_t to) const { return PoseAt(to) * PoseAt(from).Inverse(); }
  static Rigid3d WrongMotion(uint32_t from, uint32_t to) {
    const double frames = static_cast<double>(to) - from;
    return Rigid3d(ExpSo3({0.0, -0.006 * frames, 0.0}), frames * Eigen::Vector3d(-0.02, 0.0, 0.01));
  }
  static InitializerFrame Frame(uint32_t index) { return {index, int64_t{index} * 33'333'333, nullptr}; }

  /// A view that shows the first `shown` points, and so many of somebody who moves.
  ReferenceView View(uint32_t reference, uint32_t frame, size_t shown = kPoints, size_t somebodys = 0) const {
    Random random(DeriveSeed(3, frame, "view"));
    ReferenceView view;
    view.frame = Frame(frame);
    view.since_reference_s = SecondsFromTo(Frame(reference), view.frame);
    for (size_t k = 0; k < shown; ++k) {
      const bool gone = k < late_ && frame < reference;  // they came just before the reference frame
      const Eigen::Vector3d place = points_[k] + Eigen::Vector3d(gone ? 0.4 : 0.0, 0, 0);
      const double right_px = noise_px_ * random.Gaussian(), down_px = noise_px_ * random.Gaussian();
      Match match;
      match.index0 = match.index1 = static_cast<uint32_t>(k);
      match.uv0_px = *camera_.Project(PoseAt(reference) * points_[k]);
      match.uv1_px = *camera_.Project(PoseAt(frame) * place) + Eigen::Vector2d(right_px, down_px);
      view.pair.matches.push_back(match);
    }
    for (size_t k = 0; k < somebodys; ++k) {
      Match match;
      match.index0 = match.index1 = static_cast<uint32_t>(kPoints + k);
      match.uv0_px = {random.Uniform(200, 300), random.Uniform(100, 300)};
      match.uv1_px = match.uv0_px + Eigen::Vector2d(5, 40);
      view.pair.matches.push_back(match);
    }
    return view;
  }
  ReferenceWindow& Watch(uint32_t reference, std::initializer_list<uint32_t> frames,
                         std::initializer_list<uint32_t> past = {}) {
    std::vector<InitializerFrame> past_frames;
    for (const uint32_t frame : past) past_frames.push_back(Frame(frame));
    ReferenceWindow& window = windows_.emplace_back(Frame(reference), std::move(past_frames));
    for (const uint32_t frame : frames) window.AddView(View(reference, frame));
    return window;
  }
  /// The room as the window sees it with its newest view; of its points the first `used`.
  CandidateMap RoomOf(const ReferenceWindow& window, size_t used = kPoints) const {
    CandidateMap map;
    const uint32_t reference = window.reference().index;
    const ReferenceView& last = window.views().back();
    for (const Match& match : last.pair.matches) {
      map.points.push_back(PoseAt(reference) * points_[match.index0]);
      map.use.push_back(match.index0 < used ? 1 : 0);
    }
    map.placed.push_back({&last, Motion(reference, last.frame.index), 1.0});
    return map;
  }
  void Claim(const Rigid3d& motion, ReferenceWindow* window) const {
    CandidateMap room = RoomOf(*window);
    room.placed.front().T_k_0 = motion;
    window->OnExplained(room);
    window->OnClaimed({&window->views().back(), motion});
  }

  bool Admit(ReferenceWindow* window, CandidateMap* candidate) {
    const CandidateBuilder builder(options_, camera_, [this](auto*, auto* points, auto) {
      ++adjusted_;
      return adjust_ ? adjust_(points) : true;
    });
    const auto match = [&](const InitializerFrame& frame) {
      return View(window->reference().index, frame.index);
    };
    refused_ = {};
    return MapGates(options_, builder).Admit(windows_, match, window, candidate, &refused_);
  }
  bool AdmitRoom(ReferenceWindow* window, size_t used = kPoints) {
    CandidateMap room = RoomOf(*window, used);
    return Admit(window, &room);
  }

  InitializerOptions options_;
  double step_ = 0.01;     ///< of the camera, per frame
  double noise_px_ = 0.0;  ///< of the views
  size_t late_ = 0;        ///< the first so many points were elsewhere before the reference frame
  std::function<bool(std::vector<Eigen::Vector3d>*)> adjust_;
  int adjusted_ = 0;  ///< times
  Camera camera_ = SyntheticCamera();
  std::vector<Eigen::Vector3d> points_;
  std::deque<ReferenceWindow> windows_;
  Refused refused_;
};

TEST_F(MapGatesTest, AClearMotionThatWasWatchedForLongBecomesAMap) {
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  CandidateMap room = RoomOf(window);
  EXPECT_TRUE(Admit(&window, &room)) << refused_.text;
  EXPECT_EQ(room.NumPoints(), static_cast<int>(kPoints));
  EXPECT_EQ(adjusted_, 1);
  EXPECT_EQ(refused_.wait, WaitReason::kNone);
}

// ---- Points and parallax ----

TEST_F(MapGatesTest, FewPointsAreNotAdjusted) {
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  EXPECT_FALSE(AdmitRoom(&window, 79));
  EXPECT_EQ(refused_.wait, WaitReason::kTooFewStatic);
  EXPECT_EQ(adjusted_, 0);
  EXPECT_TRUE(AdmitRoom(&window, 80)) << refused_.text;
}

TEST_F(MapGatesTest, LittleParallaxIsToldAndNotAdjusted) {
  step_ = 0.002;  // 0.04 at depths from 2 to 5
  options_.geometry.max_direction_sigma_rad = 10;
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kParallaxTooSmall);
  EXPECT_NEAR(refused_.parallax_rad, 0.04 / 3.5, 0.003);
  EXPECT_EQ(adjusted_, 0);
}

TEST_F(MapGatesTest, ADirectionThatIsHardlyKnownIsNotEnough) {
  noise_px_ = 0.5;
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  EXPECT_TRUE(AdmitRoom(&window)) << refused_.text;
  options_.geometry.max_direction_sigma_rad = 1e-4;
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kParallaxTooSmall);
}

TEST_F(MapGatesTest, LessParallaxIsAskedWhereTheCameraTurnsAwayFromWhatTheReferenceFrameShows) {
  step_ = 0.002;
  options_.geometry.clear_direction_sigma_rad = 0.35;  // few points in the middle do not say more
  const auto admit = [&](size_t left) {
    windows_.clear();
    ReferenceWindow& window = Watch(0, {4, 12});
    window.AddView(View(0, 20, left));
    return AdmitRoom(&window);
  };
  EXPECT_TRUE(admit(100)) << refused_.text;
  EXPECT_FALSE(admit(110)) << "more may come";
  options_.geometry.clear_direction_sigma_rad = 0.25;
  EXPECT_FALSE(admit(100)) << "the direction is not clear";
  options_.geometry.clear_direction_sigma_rad = 10;
  step_ = 0.0009;
  EXPECT_FALSE(admit(100)) << "so little is chance";
}

TEST_F(MapGatesTest, SomebodyWhoLeavesThePictureIsNoReasonToAskForLessParallax) {
  step_ = 0.002;
  options_.geometry.clear_direction_sigma_rad = 0.35;
  ReferenceWindow& window = windows_.emplace_back(Frame(0));
  window.AddView(View(0, 4, 100, 150));
  window.AddView(View(0, 20, 100));
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kParallaxTooSmall);
}

// ---- Adjustment ----

TEST_F(MapGatesTest, WhatCannotBeAdjustedIsNoMap) {
  adjust_ = [](std::vector<Eigen::Vector3d>*) { return false; };
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kInconsistent);
}

// So many that, were they dropped later, they would be said to have moved.
TEST_F(MapGatesTest, PointsThatTheAdjustmentTookFromTheirPlacesAreDropped) {
  adjust_ = [](std::vector<Eigen::Vector3d>* points) {
    for (size_t k = 0; k < 30; ++k) (*points)[k].z() *= 2.0;
    return true;
  };
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  CandidateMap room = RoomOf(window);
  EXPECT_TRUE(Admit(&window, &room)) << refused_.text;
  EXPECT_EQ(room.NumPoints(), static_cast<int>(kPoints) - 30);
  EXPECT_EQ(room.use[0], 0);
}

// ---- The past ----

TEST_F(MapGatesTest, FewPointsThatWereElsewhereJustBeforeAreDropped) {
  late_ = 12;
  ReferenceWindow& window = Watch(20, {24, 32, 40}, {10, 14, 17});
  CandidateMap room = RoomOf(window);
  EXPECT_TRUE(Admit(&window, &room)) << refused_.text;
  EXPECT_EQ(room.NumPoints(), static_cast<int>(kPoints) - 12);
  EXPECT_EQ(room.use[0], 0);
  EXPECT_EQ(room.placed.size(), 1U) << "frames of the past do not become views";
}

TEST_F(MapGatesTest, WhereManyPointsWereElsewhereJustBeforeSomebodyHasStopped) {
  late_ = 20;
  ReferenceWindow& window = Watch(20, {24, 32, 40}, {10, 14, 17});
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kInconsistent);
  EXPECT_EQ(refused_.text, "20 of 200 points were elsewhere just before");
}

TEST_F(MapGatesTest, ThePointsThatThePastLeavesMustBeEnough) {
  late_ = 6;
  ReferenceWindow& window = Watch(20, {24, 32, 40}, {10, 14, 17});
  EXPECT_FALSE(AdmitRoom(&window, 84));
  EXPECT_EQ(refused_.wait, WaitReason::kTooFewStatic);
  EXPECT_EQ(adjusted_, 1) << "before there were enough";
}

// ---- Belief ----

TEST_F(MapGatesTest, AMotionThatWasHardToTellFromOthersIsOnTrial) {
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  window.OnTried(WaitReason::kNoReconstruction);
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kOnTrial);
}

TEST_F(MapGatesTest, AMotionThatWasWatchedForAMomentIsOnTrial) {
  ReferenceWindow& window = Watch(0, {4, 8, 11});
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kOnTrial);
}

TEST_F(MapGatesTest, AMotionThatHasARivalMustKnowItsDirection) {
  noise_px_ = 0.5;
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  CandidateMap room = RoomOf(window);
  room.rival_ratio = 2.0;
  EXPECT_TRUE(Admit(&window, &room)) << refused_.text;
  options_.geometry.clear_direction_sigma_rad = 1e-4;
  ReferenceWindow& second = Watch(0, {4, 12, 20});
  room = RoomOf(second);
  room.rival_ratio = 2.0;
  EXPECT_FALSE(Admit(&second, &room));
  EXPECT_EQ(refused_.wait, WaitReason::kOnTrial);
  EXPECT_TRUE(AdmitRoom(&Watch(0, {4, 12, 20}))) << "it has no rival";
}

TEST_F(MapGatesTest, AnotherReferenceFrameMayConfirmWhatIsOnTrial) {
  Watch(0, {10, 22, 30});
  ReferenceWindow& window = Watch(10, {22, 30});
  window.OnTried(WaitReason::kNoReconstruction);
  Claim(Motion(0, 30), &windows_.front());
  CandidateMap room = RoomOf(window);
  room.rival_ratio = 2.0;
  EXPECT_TRUE(Admit(&window, &room)) << refused_.text;
  ASSERT_TRUE(window.found());
  EXPECT_EQ(window.found()->view, &window.views().back());
}

TEST_F(MapGatesTest, AnotherReferenceFrameMayContradictTheClearestMotion) {
  Watch(0, {10, 22, 40});
  ReferenceWindow& window = Watch(10, {22, 40});
  ReferenceWindow& younger = Watch(22, {40});
  EXPECT_TRUE(AdmitRoom(&window)) << refused_.text;
  Claim(WrongMotion(22, 40), &younger);
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kInconsistent);
}

TEST_F(MapGatesTest, TheSameMotionFoundAgainAtTheNextViewIsBelieved) {
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  window.OnTried(WaitReason::kNoReconstruction);
  EXPECT_FALSE(AdmitRoom(&window));
  ASSERT_TRUE(window.found());
  EXPECT_EQ(window.found()->view, &window.views().back());
  EXPECT_TRUE(CandidateBuilder::SameMotion(window.found()->T_view_0, Motion(0, 20)));
  window.AddView(View(0, 22));
  CandidateMap room = RoomOf(window);
  EXPECT_TRUE(Admit(&window, &room)) << refused_.text;
  EXPECT_EQ(room.placed.size(), 1U);
}

TEST_F(MapGatesTest, AnotherMotionThanTheLastIsNotFoundAgain) {
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  window.OnTried(WaitReason::kNoReconstruction);
  window.OnFound({&window.views().back(), WrongMotion(0, 20)});
  window.AddView(View(0, 22));
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kOnTrial);
}

TEST_F(MapGatesTest, AMotionWithARivalThatIsFoundAgainStaysOnTrial) {
  ReferenceWindow& window = Watch(0, {4, 12, 20});
  window.OnTried(WaitReason::kNoReconstruction);
  for (const bool again : {false, true}) {
    CandidateMap room = RoomOf(window);
    room.rival_ratio = 2.0;
    EXPECT_FALSE(Admit(&window, &room)) << again;
    EXPECT_EQ(refused_.wait, WaitReason::kOnTrial);
    window.AddView(View(0, 22));
  }
}

TEST_F(MapGatesTest, AViewThatShowsTooFewOfThePointsSaysNothingOfTheMotion) {
  ReferenceWindow& window = Watch(0, {4, 12});
  const ReferenceView& few = window.AddView(View(0, 20, 15));
  window.OnTried(WaitReason::kNoReconstruction);
  window.AddView(View(0, 22));
  window.OnFound({&few, Motion(0, 22)});
  EXPECT_FALSE(AdmitRoom(&window));
  EXPECT_EQ(refused_.wait, WaitReason::kOnTrial);
}

}  // namespace
}  // namespace dmslam
