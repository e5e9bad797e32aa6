#include "viewer/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace dmslam {
namespace {

/// What a browser reads out of the bytes.
struct Decoded {
  std::vector<uint32_t> words;
  explicit Decoded(const std::vector<uint8_t>& bytes) : words(bytes.size() / 4) {
    std::memcpy(words.data(), bytes.data(), bytes.size());
  }
  uint32_t generation() const { return words[2]; }
  bool everything() const { return words[3] == 1; }
  uint32_t version() const { return words[4]; }
  uint32_t points() const { return words[5]; }
  uint32_t keyframes() const { return words[6]; }
  uint32_t links() const { return words[7]; }
  uint32_t path() const { return words[8]; }
  uint32_t truth() const { return words[9]; }
  float Real(size_t word) const {
    float value;
    std::memcpy(&value, &words[word], sizeof(value));
    return value;
  }
  size_t ExpectedWords() const { return CamerasAt() + 2 + 8 * words.at(CamerasAt() + 1); }
  size_t CamerasAt() const {
    return 10 + 9 * points() + 12 * keyframes() + 2 * links() + 7 * path() + 5 * truth();
  }
  uint32_t arrangement() const { return words.at(CamerasAt()); }
};

ScenePoint PointAt(float x) { return {{x, 2, 3}, -1.5F, 7, 4}; }

TEST(SceneTest, TellsEverythingFirstAndThenWhatChanged) {
  ViewerScene scene;
  for (uint64_t i = 1; i <= 5; ++i) scene.SetPoint(LandmarkId{i}, PointAt(static_cast<float>(i)));
  const Decoded first(scene.Encode(0, 0));
  EXPECT_TRUE(first.everything());
  EXPECT_EQ(first.points(), 5u);
  EXPECT_EQ(first.words.size(), first.ExpectedWords());

  EXPECT_EQ(Decoded(scene.Encode(first.generation(), first.version())).points(), 0u);
  scene.Advance();
  scene.SetPoint(LandmarkId{2}, PointAt(9));
  scene.SetPoint(LandmarkId{3}, PointAt(3));  // as it was
  const Decoded second(scene.Encode(first.generation(), first.version()));
  EXPECT_FALSE(second.everything());
  ASSERT_EQ(second.points(), 1u);
  EXPECT_EQ(second.words[10], 1u) << "the slot";
  EXPECT_EQ(second.words[11], 2u) << "the id";
  EXPECT_EQ(second.Real(13), 9.0F);
  EXPECT_EQ(second.Real(16), -1.5F);
  EXPECT_EQ(second.words[17], 7u);
  EXPECT_EQ(second.words[18], 4u) << "the colour";
}

TEST(SceneTest, TellsOfRemovalsOnceAndReusesSlotsOfLandmarks) {
  ViewerScene scene;
  scene.SetPoint(LandmarkId{1}, PointAt(1));
  scene.SetPoint(LandmarkId{2}, PointAt(2));
  const Decoded first(scene.Encode(0, 0));
  scene.Advance();
  scene.RemovePoint(LandmarkId{1});
  scene.RemovePoint(LandmarkId{77});  // never heard of
  const Decoded second(scene.Encode(first.generation(), first.version()));
  ASSERT_EQ(second.points(), 1u);
  EXPECT_EQ(second.words[10], 0u);
  EXPECT_TRUE(std::isnan(second.Real(16)));
  EXPECT_EQ(Decoded(scene.Encode(0, 0)).points(), 1u) << "a newcomer hears nothing of what is gone";
  scene.Advance();
  scene.SetPoint(LandmarkId{3}, PointAt(3));
  EXPECT_EQ(scene.points().Find(LandmarkId{3}), 0);
}

TEST(SceneTest, KeyframesKeepTheirSlotsAndCarryLinks) {
  ViewerScene scene;
  const KeyframeId a = KeyframeId::Make(1, 10), b = KeyframeId::Make(1, 20), c = KeyframeId::Make(1, 30);
  scene.SetKeyframe(a, {{1, 2, 3}, {0, 0, 0, 1}, {}});
  scene.SetKeyframe(b, {{4, 5, 6}, {0, 0, 0, 1}, {{0, SceneKeyframe::LinkKind::kParent}}});
  scene.RemoveKeyframe(a);
  scene.SetKeyframe(c, {{7, 8, 9},
                        {0, 0, 0, 1},
                        {{1, SceneKeyframe::LinkKind::kParent}, {0, SceneKeyframe::LinkKind::kLoop}}});
  EXPECT_EQ(scene.keyframes().Find(c), 2) << "the slot of one that is gone means nobody else";
  const Decoded all(scene.Encode(0, 0));
  ASSERT_EQ(all.keyframes(), 2u);
  ASSERT_EQ(all.links(), 3u);
  EXPECT_EQ(all.words.size(), all.ExpectedWords());
  const size_t links = 10 + 12 * 2;
  EXPECT_EQ(all.words[12], 20u) << "its frame";
  EXPECT_EQ(all.words[links - 2], 1u) << "where the links of the first end";
  EXPECT_EQ(all.words[links - 1], 3u);
  EXPECT_EQ(all.words[links + 5], 2u) << "kind of the last link";
}

TEST(SceneTest, FramesOfTwoCamerasDoNotCollide) {
  ViewerScene scene;
  scene.SetPath({0, 3}, {{1, 1, 1}, false, 0});
  scene.SetPath({1, 3}, {{2, 2, 2}, true, 5});
  scene.SetKeyframe(KeyframeId::Make(1, 3, 1), {{7, 8, 9}, {0, 0, 0, 1}, {}, 5});
  const Decoded all(scene.Encode(0, 0));
  ASSERT_EQ(all.path(), 2u);
  ASSERT_EQ(all.words.size(), all.ExpectedWords());
  EXPECT_EQ(all.words[11], 3u) << "the keyframe's frame";
  EXPECT_EQ(all.words[19], 1u) << "its camera";
  EXPECT_EQ(all.words[20], 5u) << "its colour";
  const size_t path = 10 + 12;
  const auto at = all.words.begin() + path;
  EXPECT_EQ(std::vector<uint32_t>(at, at + 4), (std::vector<uint32_t>{3, 3, 0, 1})) << "frames, cameras";
  EXPECT_EQ(all.Real(path + 4), 1.0F);
  EXPECT_EQ(all.Real(path + 7), 2.0F);
  EXPECT_EQ(std::vector<uint32_t>(at + 10, at + 14), (std::vector<uint32_t>{0, 1, 0, 5})) << "later, colours";
  scene.Advance();
  scene.RemovePath({0, 3});
  EXPECT_EQ(scene.path().Find({0, 3}), -1);
  EXPECT_GE(scene.path().Find({1, 3}), 0);
}

TEST(SceneTest, CamerasAreToldWithTheMapTheyAreIn) {
  ViewerScene scene;
  scene.SetPoint(LandmarkId{1}, PointAt(1));
  scene.SetCameras({{0, {{1, 2, 3}, {0, 0, 0, 1}}}, {5, {{4, 5, 6}, {1, 0, 0, 0}}}});
  const Decoded first(scene.Encode(0, 0));
  ASSERT_EQ(first.words.size(), first.ExpectedWords());
  const size_t at = first.CamerasAt() + 2;
  ASSERT_EQ(first.words[at - 1], 2u) << "how many";
  EXPECT_EQ(first.words[at], 0u);
  EXPECT_EQ(first.Real(at + 3), 3.0F) << "z of the first";
  EXPECT_EQ(first.words[at + 8], 5u);
  EXPECT_EQ(first.Real(at + 9), 4.0F) << "x of the second";
  EXPECT_EQ(first.Real(at + 12), 1.0F) << "x of its quaternion";
  scene.Advance();
  const Decoded same(scene.Encode(first.generation(), first.version()));
  EXPECT_EQ(same.arrangement(), first.arrangement());
  EXPECT_EQ(same.words[same.CamerasAt() + 1], 2u) << "always all";
  scene.Advance();
  scene.Rearrange();
  scene.SetCameras({});
  const Decoded moved(scene.Encode(first.generation(), first.version()));
  EXPECT_NE(moved.arrangement(), first.arrangement());
  EXPECT_EQ(moved.words.size(), moved.ExpectedWords());
  EXPECT_EQ(moved.words[moved.CamerasAt() + 1], 0u) << "all are lost";
  scene.Clear();
  EXPECT_NE(Decoded(scene.Encode(0, 0)).arrangement(), moved.arrangement());
}

TEST(SceneTest, AfterClearingNothingOfBeforeCounts) {
  ViewerScene scene;
  scene.SetPoint(LandmarkId{1}, PointAt(1));
  scene.SetPath({0, 3}, {{1, 1, 1}, false});
  scene.SetTruth({0, 3}, {1, 1, 1});
  const Decoded before(scene.Encode(0, 0));
  EXPECT_EQ(before.path() + before.truth(), 2u);
  scene.Clear();
  scene.Advance();
  scene.SetPoint(LandmarkId{5}, PointAt(5));
  const Decoded after(scene.Encode(before.generation(), before.version()));
  EXPECT_TRUE(after.everything());
  EXPECT_NE(after.generation(), before.generation());
  EXPECT_EQ(after.points(), 1u);
  EXPECT_EQ(after.path() + after.truth(), 0u);
}

}  // namespace
}  // namespace dmslam
