#include "dmslam/mapping/correction.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

/// Keyframes 1, 2, 3 in a row, each hanging from the one before, and a landmark of each.
class Correction : public testing::Test {
 protected:
  Correction() {
    for (uint32_t frame = 1; frame <= 3; ++frame) {
      scene_.AddKeyframe(map_, frame, 0.1 * frame);
      if (frame > 1) map_.SetParent(map_.At(Id(frame)), Id(frame - 1));
      own_.push_back(scene_.AddLandmark(map_, frame, static_cast<uint16_t>(frame), {frame}));
    }
    map_.TakeDelta(MapEvent::kMapStarted, Id(3), 1);
  }
  static Sim3d Up(double by, double scale = 1.0) {
    return Sim3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, by, 0), scale);
  }
  LoopAnswer Answer(std::vector<LoopAnswer::KeyframeCorrection> corrections) const {
    LoopAnswer answer;
    answer.keyframe = Id(2);
    answer.base_version = map_.version();
    answer.correction_id = 7;
    answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
    answer.corrections = std::move(corrections);
    return answer;
  }
  double HeightOf(uint32_t frame) const { return map_.At(Id(frame)).T_cam_world.Center().y(); }
  double HeightOfLandmark(size_t i) const {
    return map_.At(own_[i]).p_world.y() - scene_.point(static_cast<size_t>(i) + 1).y();
  }

  WallScene scene_;
  MapEditor map_{TestCamera(), Pyramid()};
  MapperOptions options_;
  std::vector<LandmarkId> own_;
};

TEST_F(Correction, KeyframesMadeMeanwhileFollowTheirParent) {
  ApplyCorrection(map_, Answer({{Id(1), Up(0)}, {Id(2), Up(1)}}), options_);
  EXPECT_NEAR(HeightOf(1), 0, 1e-12);
  EXPECT_NEAR(HeightOf(2), 1, 1e-12);
  EXPECT_NEAR(HeightOf(3), 1, 1e-12);
}

TEST_F(Correction, ACulledParentStillLeads) {
  const LoopAnswer answer = Answer({{Id(1), Up(0)}, {Id(2), Up(1)}});
  map_.RemoveKeyframe(map_.At(Id(2)));  // with its own landmark; 3 hangs from 1 now
  ApplyCorrection(map_, answer, options_);
  EXPECT_NEAR(HeightOf(3), 0, 1e-12);
}

TEST_F(Correction, LandmarksFollowTheirReferenceAndTakeWhatIsBeyond) {
  LoopAnswer answer = Answer({{Id(1), Up(0)}, {Id(2), Up(1)}});
  answer.landmark_offsets.push_back({own_[1], {0, 0.25, 0}});
  ApplyCorrection(map_, answer, options_);
  EXPECT_NEAR(HeightOfLandmark(0), 0, 1e-12);
  EXPECT_NEAR(HeightOfLandmark(1), 1.25, 1e-12);
  EXPECT_NEAR(HeightOfLandmark(2), 1, 1e-12);
}

TEST_F(Correction, ScalesWhatHangsOnTheKeyframe) {
  const Eigen::Vector3d seen_before = map_.At(Id(3)).T_cam_world * map_.At(own_[2]).p_world;
  ApplyCorrection(map_, Answer({{Id(1), Up(0)}, {Id(3), Up(0, 2.0)}}), options_);
  EXPECT_NEAR(map_.At(Id(3)).scale, 2.0, 1e-12);
  EXPECT_NEAR(map_.At(Id(3)).T_cam_world.Center().x(), 0.6, 1e-12);
  const Eigen::Vector3d seen = map_.At(Id(3)).T_cam_world * map_.At(own_[2]).p_world;
  EXPECT_LT((seen - 2 * seen_before).norm(), 1e-9) << "in the same pixel, twice as far";
}

TEST_F(Correction, OtherMapsStayWhereTheyAre) {
  Keyframe other;
  other.id = Id(9);
  other.map_id = 2;
  other.features = map_.At(Id(1)).features;
  map_.AddKeyframe(other);
  ApplyCorrection(map_, Answer({{Id(1), Up(1)}}), options_);
  EXPECT_NEAR(HeightOf(9), 0, 1e-12);
  EXPECT_NEAR(HeightOf(2), 1, 1e-12);
}

TEST_F(Correction, SaysWhyItDoesNotApply) {
  EXPECT_EQ(WhyRefused(map_, Answer({{Id(1), Up(1)}})), "");
  EXPECT_EQ(WhyRefused(map_, Answer({{Id(8), Up(1)}})), "its keyframes are gone");
  LoopAnswer later = Answer({{Id(1), Up(1)}});
  ++later.base_version;
  EXPECT_NE(WhyRefused(map_, later).find("the map's is 1"), std::string::npos);
  MapProgress progress;
  progress.corrected = 2;
  map_.SetProgress(progress);
  EXPECT_NE(WhyRefused(map_, Answer({{Id(1), Up(1)}})).find("before the correction of version 2"),
            std::string::npos);
}

/// A second map of keyframes 11, 12, 13, each hanging from the one before, that sees the wall again: in its
/// own coordinates it stands a unit higher.
class Joining : public Correction {
 protected:
  Joining() {
    for (uint16_t i = 20; i < 60; ++i) scene_.AddLandmark(map_, 100U + i, i, {1, 2, 3});
    for (uint32_t frame = 11; frame <= 13; ++frame) {
      scene_.AddKeyframe(map_, frame, 0.1 * (frame - 10));
      map_.SetParent(map_.At(Id(frame)), frame > 11 ? std::optional(Id(frame - 1)) : std::nullopt);
      map_.SetMapId(map_.At(Id(frame)), 2);
      map_.SetPose(map_.At(Id(frame)), map_.At(Id(frame)).T_cam_world * Lift(-1));
    }
    for (uint16_t i = 20; i < 60; ++i) {
      const LandmarkId id = scene_.AddLandmark(map_, 200U + i, i, {11, 12, 13});
      map_.SetMapId(map_.At(id), 2);
      map_.SetPosition(map_.At(id), Lift(1) * scene_.point(i));
    }
    map_.TakeDelta(MapEvent::kSettled, Id(13), 2);
  }
  static Rigid3d Lift(double by) { return Rigid3d(Eigen::Quaterniond::Identity(), {0, by, 0}); }
  LoopAnswer Loop() const {
    LoopAnswer answer = Answer({{Id(11), Up(-1)}, {Id(12), Up(-1)}, {Id(13), Up(-1)}});
    answer.kind = LoopAnswer::Kind::kLoop;
    answer.keyframe = Id(12);
    answer.seen_from = Id(12);
    answer.matched = Id(2);
    answer.fusions.push_back({LandmarkId::Make(1, 220), LandmarkId::Make(1, 120)});
    return answer;
  }
};

TEST_F(Joining, TwoMapsBecomeOne) {
  EXPECT_EQ(ApplyCorrection(map_, Loop(), options_).landmarks, 40);
  for (const auto& [id, keyframe] : map_.keyframes()) EXPECT_EQ(keyframe.map_id, 1u);
  EXPECT_TRUE(map_.LandmarksOf(2).empty());
  EXPECT_NEAR(HeightOf(12), 0, 1e-12);
  for (uint16_t i = 20; i < 60; ++i) {
    const Landmark* now = map_.Resolve(LandmarkId::Make(1, 200U + i));
    ASSERT_NE(now, nullptr) << i;
    EXPECT_EQ(map_.Resolve(LandmarkId::Make(1, 100U + i)), now) << "seen by both, it is one: " << i;
    EXPECT_EQ(now->observations.size(), 6u) << i;
  }
}

TEST_F(Joining, TheTreeHangsFromThePlaceAtTheLoop) {
  ApplyCorrection(map_, Loop(), options_);
  EXPECT_EQ(map_.At(Id(12)).parent, Id(2));
  EXPECT_EQ(map_.At(Id(11)).parent, Id(12)) << "turned around";
  EXPECT_EQ(map_.At(Id(13)).parent, Id(12));
  EXPECT_FALSE(map_.At(Id(1)).parent.has_value());
  EXPECT_EQ(map_.At(Id(12)).loop_edges, std::vector<KeyframeId>{Id(2)});
  EXPECT_EQ(map_.At(Id(2)).loop_edges, std::vector<KeyframeId>{Id(12)});
}

TEST_F(Joining, AMapJoinsAlone) {
  JoinMaps(map_, map_.At(Id(13)), map_.At(Id(3)));
  EXPECT_TRUE(map_.KeyframesOf(2).empty());
  EXPECT_EQ(map_.At(Id(13)).parent, Id(3));
  EXPECT_EQ(map_.At(Id(12)).parent, Id(13));
  EXPECT_EQ(map_.At(Id(11)).parent, Id(12));
}

TEST_F(Joining, ALoopWhoseEndsAreOneKeyframeNowMovesButJoinsNothing) {
  LoopAnswer answer = Loop();
  answer.matched = Id(12);
  EXPECT_EQ(ApplyCorrection(map_, answer, options_), FusionCounts());
  EXPECT_NEAR(HeightOf(12), 0, 1e-12);
  EXPECT_EQ(map_.At(Id(12)).map_id, 2u);
}

}  // namespace
}  // namespace dmslam
