#include "dmslam/initialization/testimony.h"

#include <gtest/gtest.h>

#include <initializer_list>

#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

/// A camera that moves past a room at 30 Hz, and reference frames that watch it.
class TestimonyTest : public ::testing::Test {
 protected:
  TestimonyTest() {
    Random random(5);
    for (int k = 0; k < 200; ++k) {
      const Eigen::Vector3d ray = camera_.Ray({random.Uniform(150, 490), random.Uniform(100, 380)});
      points_.push_back(random.Uniform(2.0, 5.0) * ray);
    }
  }

  static Rigid3d PoseAt(uint32_t frame) {
    return Rigid3d(ExpSo3({0.0, 0.003 * frame, 0.0}), 0.01 * frame * Eigen::Vector3d(1.0, 0.1, 0.2));
  }
  static Rigid3d Motion(uint32_t from, uint32_t to) { return PoseAt(to) * PoseAt(from).Inverse(); }
  /// That of somebody who goes along.
  static Rigid3d WrongMotion(uint32_t from, uint32_t to) {
    const double frames = static_cast<double>(to) - from;
    return Rigid3d(ExpSo3({0.0, -0.006 * frames, 0.0}), frames * Eigen::Vector3d(-0.02, 0.0, 0.01));
  }

  InitializerFrame Frame(uint32_t index) const { return {index, int64_t{index} * 33'333'333, nullptr}; }
  ReferenceWindow& Watch(uint32_t reference, std::initializer_list<uint32_t> frames) {
    ReferenceWindow& window = windows_.emplace_back(Frame(reference));
    for (const uint32_t frame : frames) {
      ReferenceView view;
      view.frame = Frame(frame);
      view.since_reference_s = SecondsFromTo(window.reference(), view.frame);
      for (size_t k = 0; k < points_.size(); ++k) {
        Match match;
        match.index0 = match.index1 = static_cast<uint32_t>(k);
        match.uv0_px = *camera_.Project(PoseAt(reference) * points_[k]);
        match.uv1_px = *camera_.Project(PoseAt(frame) * points_[k]);
        view.pair.matches.push_back(match);
      }
      window.AddView(std::move(view));
    }
    return window;
  }
  /// The room as the window sees it with its newest view.
  CandidateMap RoomOf(const ReferenceWindow& window) const {
    CandidateMap map;
    const uint32_t reference = window.reference().index;
    for (const Eigen::Vector3d& point : points_) map.points.push_back(PoseAt(reference) * point);
    map.use.assign(points_.size(), 1);
    const ReferenceView& last = window.views().back();
    map.placed.push_back({&last, Motion(reference, last.frame.index), 1.0});
    return map;
  }
  /// A map whose poses follow the wrong motion in all views.
  CandidateMap WrongMapOf(const ReferenceWindow& window) const {
    CandidateMap map = RoomOf(window);
    map.placed.clear();
    for (auto view = window.views().rbegin(); view != window.views().rend(); ++view) {
      map.placed.push_back({&*view, WrongMotion(window.reference().index, view->frame.index), 1.0});
    }
    return map;
  }
  static void Claim(const CandidateMap& map, ReferenceWindow* window) {
    window->OnExplained(map);
    window->OnClaimed({&map.last(), map.T_last_0()});
  }
  Verdict HearOf(const ReferenceWindow& window, const CandidateMap& map) const {
    return Hear(builder_, windows_, window, map, TestimonyOptions());
  }

  Camera camera_ = SyntheticCamera();
  CandidateBuilder builder_{{}, camera_, {}};
  std::vector<Eigen::Vector3d> points_;
  std::deque<ReferenceWindow> windows_;
};

TEST_F(TestimonyTest, NobodySaysAnythingBeforeItFoundSomething) {
  Watch(0, {4, 8, 12});
  const ReferenceWindow& window = Watch(4, {8, 12});
  EXPECT_EQ(HearOf(window, RoomOf(window)), Verdict::kUnheard);
}

TEST_F(TestimonyTest, AnOlderAndAYoungerReferenceFrameConfirmTheSameMotion) {
  ReferenceWindow& older = Watch(0, {4, 8, 12});
  const ReferenceWindow& window = Watch(4, {8, 12});
  Claim(RoomOf(older), &older);
  EXPECT_EQ(HearOf(window, RoomOf(window)), Verdict::kConfirmed);
  windows_.clear();
  Watch(0, {4, 8, 12});
  Watch(4, {8, 12});
  ReferenceWindow& younger = Watch(8, {12});
  Claim(RoomOf(younger), &younger);
  EXPECT_EQ(HearOf(windows_[1], RoomOf(windows_[1])), Verdict::kConfirmed);
}

TEST_F(TestimonyTest, AnOtherMotionContradicts) {
  ReferenceWindow& older = Watch(0, {4, 8, 12});
  const ReferenceWindow& window = Watch(4, {8, 12});
  Claim(WrongMapOf(older), &older);
  EXPECT_EQ(HearOf(window, RoomOf(window)), Verdict::kContradicted);
  windows_.clear();
  Watch(0, {4, 8, 12});
  Watch(4, {8, 12});
  ReferenceWindow& younger = Watch(8, {12});
  Claim(WrongMapOf(younger), &younger);
  EXPECT_EQ(HearOf(windows_[1], RoomOf(windows_[1])), Verdict::kContradicted);
}

// Who has watched for longer has more weight, however many there are.
TEST_F(TestimonyTest, EachCountsByHowLongItHasWatched) {
  ReferenceWindow& older = Watch(0, {12, 16, 20, 24});
  Watch(12, {16, 20, 24});
  ReferenceWindow& younger = Watch(16, {20, 24});
  Claim(RoomOf(older), &older);
  Claim(WrongMapOf(younger), &younger);
  EXPECT_EQ(HearOf(windows_[1], RoomOf(windows_[1])), Verdict::kConfirmed);
  EXPECT_EQ(HearOf(younger, WrongMapOf(younger)), Verdict::kContradicted);
}

// Between two frames that are close together noise decides which way the camera went.
TEST_F(TestimonyTest, ACameraThatHardlyMovedHasNoDirectionToCompare) {
  ReferenceWindow& older = Watch(0, {8, 16, 22, 24});
  Watch(16, {24, 30});
  Watch(22, {24, 30});
  Claim(RoomOf(older), &older);
  EXPECT_EQ(HearOf(windows_[1], WrongMapOf(windows_[1])), Verdict::kContradicted);
  EXPECT_EQ(HearOf(windows_[2], WrongMapOf(windows_[2])), Verdict::kUnheard);
}

// The motion that wins now is not believed where another one won at the views before.
TEST_F(TestimonyTest, AWindowThatHasChangedItsMindIsNotBelieved) {
  ReferenceWindow& window = Watch(0, {4, 8, 12});
  for (const ReferenceView& view : window.views()) window.OnClaimed({&view, Motion(0, view.frame.index)});
  EXPECT_EQ(HearOf(window, RoomOf(window)), Verdict::kUnheard) << "nobody confirms himself";
  EXPECT_EQ(HearOf(window, WrongMapOf(window)), Verdict::kContradicted);
}

TEST_F(TestimonyTest, WhatWasFoundLongAgoDoesNotCount) {
  ReferenceWindow& window = Watch(0, {4, 8, 50});
  window.OnClaimed({&window.views()[1], WrongMotion(0, 8)});
  EXPECT_EQ(HearOf(window, RoomOf(window)), Verdict::kUnheard);
}

TEST_F(TestimonyTest, WhatOlderReferenceFramesFoundIsTriedAtTheYounger) {
  ReferenceWindow& older = Watch(0, {4, 8, 12});
  ReferenceWindow& window = Watch(4, {8, 12});
  EXPECT_TRUE(MotionsToTry(builder_, windows_, window, TestimonyOptions()).empty());
  CandidateMap before = RoomOf(older);
  before.placed.front() = {&older.views()[1], Motion(0, 8), 1.0};
  older.OnExplained(before);
  for (const ReferenceWindow* each : {&older, &window}) {
    const auto motions = MotionsToTry(builder_, windows_, *each, TestimonyOptions());
    ASSERT_EQ(motions.size(), 1U);
    EXPECT_TRUE(CandidateBuilder::SameMotion(motions[0], Motion(each->reference().index, 12)));
  }
  Watch(8, {12, 40});
  EXPECT_TRUE(MotionsToTry(builder_, windows_, windows_[2], TestimonyOptions()).empty())
      << "found long before";
}

TEST_F(TestimonyTest, FramesThatTheWindowDoesNotShowHaveNoMotion) {
  const ReferenceWindow& window = Watch(0, {4, 8});
  const CandidateMap map = RoomOf(window);
  EXPECT_TRUE(CandidateBuilder::SameMotion(*MotionBetween(builder_, window, map, 4, 8), Motion(4, 8)));
  EXPECT_FALSE(MotionBetween(builder_, window, map, 4, 9).has_value());
  EXPECT_FALSE(MotionBetween(builder_, window, map, 3, 8).has_value());
}

}  // namespace
}  // namespace dmslam
