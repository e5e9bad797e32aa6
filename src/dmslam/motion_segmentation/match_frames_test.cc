#include "dmslam/motion_segmentation/match_frames.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr size_t kMost = 200, kFew = 60;

/// Somebody who has most of the features and crosses the picture, and a room that stays where it is.
struct Crossing {
  Crossing() {
    Random random(11);
    for (size_t k = 0; k < kMost + kFew; ++k) {
      const bool crosses = k < kMost;
      const double left = crosses ? 60 : 330, right = crosses ? 300 : 600;
      const Eigen::Vector2d uv_px(random.Uniform(left, right), random.Uniform(40, 440));
      Descriptor descriptor;
      for (uint64_t& word : descriptor.words) word = random.Next();
      Add(uv_px, descriptor, &before);
      Add(uv_px + Eigen::Vector2d(crosses ? 200 : 0, 0), descriptor, &after);
    }
    for (FrameFeatures* frame : {&before, &after})
      frame->grid.Build(frame->uv_px, frame->set.keypoints, camera.width_px, camera.height_px);
  }
  static void Add(const Eigen::Vector2d& uv_px, const Descriptor& descriptor, FrameFeatures* frame) {
    Keypoint keypoint;
    keypoint.x_q4 = static_cast<uint16_t>(uv_px.x() * 16);
    keypoint.y_q4 = static_cast<uint16_t>(uv_px.y() * 16);
    frame->set.keypoints.push_back(keypoint);
    frame->set.descriptors.push_back(descriptor);
    frame->uv_px.push_back(uv_px);
  }
  /// Where who crosses is, as if the camera had turned.
  std::vector<Eigen::Vector2d> Predicted() const {
    std::vector<Eigen::Vector2d> places;
    for (const Eigen::Vector2d& uv_px : before.uv_px) places.emplace_back(uv_px + Eigen::Vector2d(200, 0));
    return places;
  }
  static size_t OfTheRoom(const std::vector<Match>& matches) {
    return static_cast<size_t>(
        std::ranges::count_if(matches, [](const Match& m) { return m.index0 >= kMost; }));
  }

  Camera camera = TestCamera();
  FrameFeatures before, after;
};

TEST(AddMatchesInPlace, FindsTheRoomWhereTheTurnIsThatOfSomebodyWhoCrosses) {
  const Crossing crossing;
  FeatureMatcher matcher;
  std::vector<Match> matches =
      MatchFrames(crossing.before, crossing.after, crossing.camera, {}, &matcher, crossing.Predicted());
  EXPECT_EQ(matches.size(), kMost);
  EXPECT_EQ(Crossing::OfTheRoom(matches), 0u);
  AddMatchesInPlace(crossing.before, crossing.after, crossing.camera, {}, &matcher, &matches);
  EXPECT_EQ(matches.size(), kMost + kFew);
  EXPECT_EQ(Crossing::OfTheRoom(matches), kFew);
  EXPECT_TRUE(std::ranges::is_sorted(matches, {}, &Match::index0));
}

TEST(AddMatchesInPlace, NoFeatureIsMatchedTwice) {
  Crossing crossing;
  // A feature of the room looks like one that crosses, and was where that one is afterwards.
  crossing.before.set.descriptors[kMost] = crossing.before.set.descriptors[0];
  crossing.before.uv_px[kMost] = crossing.after.uv_px[0];
  FeatureMatcher matcher;
  std::vector<Match> matches =
      MatchFrames(crossing.before, crossing.after, crossing.camera, {}, &matcher, crossing.Predicted());
  AddMatchesInPlace(crossing.before, crossing.after, crossing.camera, {}, &matcher, &matches);
  std::vector<uint32_t> taken;
  taken.reserve(matches.size());
  for (const Match& match : matches) taken.push_back(match.index1);
  std::ranges::sort(taken);
  EXPECT_EQ(std::ranges::adjacent_find(taken), taken.end());
}

}  // namespace
}  // namespace dmslam
