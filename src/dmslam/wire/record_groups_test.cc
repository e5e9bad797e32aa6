#include "dmslam/wire/record_groups.h"

#include <gtest/gtest.h>

#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"

namespace dmslam::wire {
namespace {

MapDelta Part(uint32_t index, uint32_t count, uint64_t id = 4) {
  MapDelta delta;
  delta.event = MapEvent::kGloballyAdjusted;
  delta.correction_id = 9;
  delta.group = {id, index, count};
  delta.version = 100 + index;
  delta.landmark_positions.push_back({LandmarkId::Make(1, index), {1.0 * index, 2, 3}});
  return delta;
}

MapDelta Alone() {
  MapDelta delta;
  delta.event = MapEvent::kEvidence;
  return delta;
}

TEST(RecordGroupsTest, ARecordThatStandsAloneIsAppliedAtOnce) {
  RecordGroups<MapDelta> groups;
  const std::optional<MapDelta> change = groups.Add(Alone());
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(change->event, MapEvent::kEvidence);
  EXPECT_FALSE(groups.open());
}

TEST(RecordGroupsTest, AGroupIsOneChange) {
  RecordGroups<MapDelta> groups;
  EXPECT_FALSE(groups.Add(Part(0, 3)).has_value());
  EXPECT_TRUE(groups.open());
  EXPECT_FALSE(groups.Add(Part(1, 3)).has_value());
  EXPECT_TRUE(groups.fault().empty());
  const std::optional<MapDelta> change = groups.Add(Part(2, 3));
  ASSERT_TRUE(change.has_value());
  EXPECT_FALSE(groups.open());
  EXPECT_TRUE(change->group.alone());
  EXPECT_EQ(change->correction_id, 9U);
  EXPECT_EQ(change->version, 102U) << "of its last record";
  ASSERT_EQ(change->landmark_positions.size(), 3U);
  for (uint32_t i = 0; i < 3; ++i) EXPECT_EQ(change->landmark_positions[i].id, LandmarkId::Make(1, i));
}

TEST(RecordGroupsTest, AMissingRecordIsNamed) {
  RecordGroups<MapDelta> groups;
  groups.Add(Part(0, 3));
  EXPECT_FALSE(groups.Add(Part(2, 3)).has_value());
  EXPECT_EQ(groups.fault(), "record 2 of 3 of group 4 was due, record 3 of 3 of group 4 came");
  EXPECT_FALSE(groups.open()) << "nothing of it is kept";
  EXPECT_FALSE(groups.Add(Part(1, 3)).has_value()) << "what follows of it is no beginning";
  EXPECT_FALSE(groups.fault().empty());
  EXPECT_TRUE(groups.Add(Alone()).has_value());
}

TEST(RecordGroupsTest, ADoubledRecordIsRefused) {
  RecordGroups<MapDelta> groups;
  groups.Add(Part(0, 3));
  groups.Add(Part(1, 3));
  EXPECT_FALSE(groups.Add(Part(1, 3)).has_value());
  EXPECT_EQ(groups.fault(), "record 3 of 3 of group 4 was due, record 2 of 3 of group 4 came");
}

TEST(RecordGroupsTest, ARecordOfAnotherGroupOrOfAnotherCountIsRefused) {
  for (const MapDelta& intruder : {Part(1, 3, 5), Part(1, 4), Part(0, 3), Alone()}) {
    RecordGroups<MapDelta> groups;
    groups.Add(Part(0, 3));
    EXPECT_FALSE(groups.Add(intruder).has_value());
    EXPECT_FALSE(groups.fault().empty());
  }
}

TEST(RecordGroupsTest, AnswersOfTheLoopCloserToo) {
  LoopAnswer first;
  first.keyframe = KeyframeId::Make(1, 7);
  first.kind = LoopAnswer::Kind::kGlobalAdjustment;
  first.correction_id = 3;
  first.group = {2, 0, 2};
  first.corrections.push_back({KeyframeId::Make(1, 1), Sim3d()});
  LoopAnswer second = first;
  second.group.index = 1;
  second.corrections[0].keyframe = KeyframeId::Make(1, 2);
  RecordGroups<LoopAnswer> groups;
  EXPECT_FALSE(groups.Add(first).has_value());
  const std::optional<LoopAnswer> answer = groups.Add(second);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->corrections.size(), 2U);
}

TEST(RecordGroupsTest, APlaceInAGroupThatCannotBeIsRefusedByTheCodec) {
  MapDelta delta = Part(0, 2);
  EXPECT_TRUE(Decode<MapDelta>(Encode(delta)).has_value());
  for (const RecordGroup group :
       {RecordGroup{4, 2, 2}, RecordGroup{0, 0, 2}, RecordGroup{4, 0, 1}, RecordGroup{4, 0, 0}}) {
    delta.group = group;
    EXPECT_THROW(Encode(delta), InvariantError);
  }
}

}  // namespace
}  // namespace dmslam::wire
