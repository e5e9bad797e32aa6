#include "dmslam/mapping/keyframe_insertion.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

/// Keyframes 1 and 2 see the wall; 2 is half a unit to the right of 1.
class Insertion : public testing::Test {
 protected:
  Insertion() {
    scene_.AddKeyframe(map_, 1, 0.0);
    scene_.AddKeyframe(map_, 2, 0.5);
    for (uint16_t i = 0; i < 30; ++i) ids_.push_back(scene_.AddLandmark(map_, 100U + i, i, {1, 2}));
  }
  KeyframeProposal Seeing(uint16_t count, uint32_t reference = 2) const {
    KeyframeProposal proposal = scene_.Propose(3, 0.8, reference, 0.5, 1.0);
    for (uint16_t i = 0; i < count; ++i) proposal.matches.push_back({i, ids_[i]});
    return proposal;
  }
  double PlaceOf(const InsertionReport& report) const { return report.keyframe->T_cam_world.Center().x(); }

  WallScene scene_;
  MapEditor map_{TestCamera(), Pyramid()};
  std::vector<LandmarkId> ids_;
};

TEST_F(Insertion, PutsItWhereItsReferenceIsNow) {
  map_.SetPoseAndScale(map_.At(Id(2)), WallScene::At(1.5),
                       2.0);  // corrected while the proposal was on its way
  const InsertionReport report = InsertKeyframe(map_, Seeing(10));
  ASSERT_NE(report.keyframe, nullptr);
  EXPECT_NEAR(PlaceOf(report), 1.5 + 2.0 * 0.3, 1e-12) << "all lengths have doubled";
  EXPECT_EQ(report.keyframe->scale, 2.0);
  EXPECT_EQ(report.keyframe->stamp_ns, 1'000'000'000);
}

TEST_F(Insertion, ResolvesAReferenceThatWasCulled) {
  const KeyframeProposal proposal = Seeing(10);
  map_.RemoveKeyframe(map_.At(Id(2)));
  const InsertionReport report = InsertKeyframe(map_, proposal);
  ASSERT_NE(report.keyframe, nullptr);
  EXPECT_NEAR(PlaceOf(report), 0.8, 1e-12);
  EXPECT_EQ(report.keyframe->parent, Id(1));
}

TEST_F(Insertion, SeesWhatItsLandmarksHaveBecome) {
  KeyframeProposal proposal = Seeing(10);
  map_.Fuse(map_.At(ids_[3]), map_.At(ids_[20]), {});
  map_.RemoveLandmark(map_.At(ids_[4]));
  map_.SetMapId(map_.At(ids_[5]), 2);
  proposal.matches.push_back({60000, ids_[6]});  // no such feature
  const InsertionReport report = InsertKeyframe(map_, proposal);
  ASSERT_NE(report.keyframe, nullptr);
  EXPECT_EQ(report.observations_dropped, 3);
  EXPECT_EQ(report.keyframe->landmarks[3], ids_[20]);
  EXPECT_FALSE(report.keyframe->landmarks[4].valid());
  EXPECT_FALSE(report.keyframe->landmarks[5].valid());
  EXPECT_EQ(map_.CountTracked(*report.keyframe, 3), 8);
}

TEST_F(Insertion, HangsFromWhomItSharesMostWith) {
  scene_.AddKeyframe(map_, 9, 0.7);
  for (uint16_t i = 0; i < 6; ++i) map_.SetObservation(map_.At(Id(9)), i, map_.At(ids_[i]));
  map_.ClearObservation(map_.At(Id(1)), 0);
  map_.ClearObservation(map_.At(Id(2)), 0);
  const InsertionReport report = InsertKeyframe(map_, Seeing(6));
  ASSERT_NE(report.keyframe, nullptr);
  EXPECT_EQ(report.keyframe->parent, Id(9));
}

TEST_F(Insertion, HangsFromItsReferenceWhereItSharesNothing) {
  const InsertionReport report = InsertKeyframe(map_, Seeing(0));
  ASSERT_NE(report.keyframe, nullptr);
  EXPECT_EQ(report.keyframe->parent, Id(2));
}

TEST_F(Insertion, OneProposedTwiceIsRecognisedAlsoWhenItWasCulled) {
  EXPECT_NE(InsertKeyframe(map_, Seeing(10)).keyframe, nullptr);
  EXPECT_EQ(InsertKeyframe(map_, Seeing(10)).outcome, KeyframeOutcome::kRepeated);
  map_.RemoveKeyframe(map_.At(Id(3)));
  const InsertionReport again = InsertKeyframe(map_, Seeing(10));
  EXPECT_EQ(again.outcome, KeyframeOutcome::kRepeated);
  EXPECT_EQ(again.keyframe, nullptr);
}

TEST_F(Insertion, RefusesAReferenceThatIsUnknownOrOfAnotherMap) {
  const InsertionReport unknown = InsertKeyframe(map_, Seeing(10, 77));
  EXPECT_EQ(unknown.keyframe, nullptr);
  EXPECT_EQ(unknown.outcome, KeyframeOutcome::kRefused);
  map_.SetMapId(map_.At(Id(2)), 2);
  EXPECT_EQ(InsertKeyframe(map_, Seeing(10)).keyframe, nullptr);
  EXPECT_EQ(map_.keyframes().size(), 2u);
}

/// The frontend proposed it before it heard of the weld.
TEST_F(Insertion, AKeyframeOfAMapThatWasJoinedMeanwhileIsOneOfTheJoinedMap) {
  std::vector<KeyframeId> all;
  for (const auto& [id, keyframe] : map_.keyframes()) all.push_back(id);
  for (const KeyframeId id : all) map_.SetMapId(map_.At(id), 2);
  for (const LandmarkId id : ids_) map_.SetMapId(map_.At(id), 2);
  const InsertionReport report = InsertKeyframe(map_, Seeing(10));
  ASSERT_NE(report.keyframe, nullptr);
  EXPECT_EQ(report.keyframe->map_id, 2u);
  EXPECT_EQ(report.observations_dropped, 0);
}

}  // namespace
}  // namespace dmslam
