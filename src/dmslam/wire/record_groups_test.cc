#include "dmslam/wire/record_groups.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/testing/random_message.h"

namespace dmslam::wire {
namespace {

MapDelta Part(uint32_t index, uint32_t count, uint64_t id = 4) {
  MapDelta delta;
  delta.event = MapEvent::kGloballyAdjusted;
  delta.correction_id = 9;
  delta.group = {id, index, count};
  delta.version = 100;
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
  EXPECT_EQ(change->version, 100U);
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

TEST(RecordGroupsTest, ARecordOfAnotherChangeIsRefusedThoughItsPlaceFits) {
  MapDelta later = Part(1, 2), other_event = later, further = later;
  later.version = 101;
  other_event.event = MapEvent::kAdjusted;
  further.progress.frontend = {3, 4};
  for (const MapDelta& intruder : {later, other_event, further}) {
    RecordGroups<MapDelta> groups;
    groups.Add(Part(0, 2));
    EXPECT_FALSE(groups.Add(intruder).has_value());
    EXPECT_EQ(groups.fault(), "record 2 of 2 of group 4 tells of another change than those before it");
    EXPECT_FALSE(groups.open());
  }
}

TEST(RecordGroupsTest, AnotherWriterEndsNoGroupAndItsFirstRecordCounts) {
  const Term first{10, 3}, second{11, 8};
  RecordGroups<MapDelta> groups;
  groups.Add(Part(0, 2), first);
  EXPECT_FALSE(groups.Add(Part(1, 2), second).has_value()) << "the second half of another writer's group";
  EXPECT_FALSE(groups.abandoned().empty());
  EXPECT_FALSE(groups.fault().empty());

  groups.Add(Part(0, 2), first);
  EXPECT_TRUE(groups.Add(Alone(), second).has_value());
  EXPECT_EQ(groups.abandoned(),
            "a group of 2 records ended with record 1, for its writer is gone: it is not applied");
  EXPECT_TRUE(groups.fault().empty());
  EXPECT_TRUE(groups.Add(Alone(), second).has_value());
  EXPECT_TRUE(groups.abandoned().empty());
}

/// Every list many times over, as a global adjustment of a large map would be.
MapDelta Large(Random& random) {
  MapDelta delta = testing::RandomMessage<MapDelta>(random.Next(), 40);
  delta.group = {};
  const size_t keyframes = delta.keyframes.size();
  for (size_t i = 0; i < 40; ++i) {
    for (size_t k = 0; k < keyframes; ++k) delta.keyframes.push_back(delta.keyframes[k]);
  }
  const auto repeat = [](auto* list, size_t size) {
    if (list->empty()) return;
    list->reserve(size);
    for (size_t i = 0; list->size() < size; ++i) list->push_back((*list)[i]);
  };
  repeat(&delta.keyframe_poses, 9000);
  repeat(&delta.landmarks, 5000);
  repeat(&delta.landmark_positions, 90'000);
  repeat(&delta.landmark_evidence, 3000);
  repeat(&delta.keyframe_tombstones, 300);
  repeat(&delta.landmark_tombstones, 10'000);
  return delta;
}

TEST(RecordGroupsTest, NoRecordOfASplitChangeIsTooLargeAndTogetherTheyAreTheChange) {
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const MapDelta change = Large(random);
    const Bytes whole = Encode(change);
    const size_t max_bytes = seed % 2 == 0 ? kMaxRecordBytes : 64 * 1024;
    const std::vector<MapDelta> records = Split(change, max_bytes);
    ASSERT_GT(records.size(), 2U);
    EXPECT_LE(records.size(), 2 + 2 * whole.size() / max_bytes) << "records are filled";
    RecordGroups<MapDelta> groups;
    std::optional<MapDelta> applied;
    for (const MapDelta& record : records) {
      EXPECT_FALSE(applied.has_value());
      const Bytes bytes = Encode(record);
      EXPECT_LE(bytes.size(), max_bytes);
      std::optional<MapDelta> read = Decode<MapDelta>(bytes);
      ASSERT_TRUE(read.has_value());
      applied = groups.Add(std::move(*read));
      EXPECT_EQ(groups.fault(), "");
    }
    ASSERT_TRUE(applied.has_value());
    EXPECT_EQ(Encode(*applied), whole);
  }
}

TEST(RecordGroupsTest, WhatFitsIsOneRecordAsItWas) {
  Random random(3);
  const MapDelta change = testing::RandomMessage<MapDelta>(random.Next());
  const std::vector<MapDelta> records = Split(change);
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(Encode(records[0]), Encode(change));
}

TEST(RecordGroupsTest, AKeyframeIsNotCut) {
  MapDelta change = Alone();
  KeyframeState keyframe;
  keyframe.id = KeyframeId::Make(1, 1);
  keyframe.map_id = 1;
  FeatureSet features;
  features.keypoints.resize(10'000);
  features.descriptors.resize(10'000);
  keyframe.features = std::make_shared<const FeatureSet>(std::move(features));
  for (int i = 0; i < 3; ++i) change.keyframes.push_back(keyframe);
  EXPECT_EQ(Split(change).size(), 2U) << "10000 features, the most that can be set, take 380 kB";
  EXPECT_EQ(Split(change, 1000).size(), 3U) << "one each";
}

TEST(RecordGroupsTest, ALargeGlobalAdjustmentOfTheLoopCloserIsSplitToo) {
  LoopAnswer answer;
  answer.keyframe = KeyframeId::Make(1, 7);
  answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
  answer.correction_id = 3;
  answer.note = "20000 keyframes";
  for (uint32_t i = 0; i < 20'000; ++i) answer.corrections.push_back({KeyframeId::Make(1, i + 1), Sim3d()});
  for (uint64_t i = 0; i < 100'000; ++i)
    answer.landmark_offsets.push_back({LandmarkId::Make(1, i + 1), {0.1, 0.2, 0.3}});
  RecordGroups<LoopAnswer> groups;
  std::optional<LoopAnswer> applied;
  for (const LoopAnswer& record : Split(answer)) {
    EXPECT_LE(Encode(record).size(), kMaxRecordBytes);
    applied = groups.Add(record);
  }
  ASSERT_TRUE(applied.has_value());
  EXPECT_EQ(Encode(*applied), Encode(answer));
}

TEST(RecordGroupsTest, AnInitialMapOfTheMostFeaturesThatCanBeSetIsOneRecord) {
  InitialMap map;
  map.map_id = 1;
  map.first.id = KeyframeId::Make(1, 1);
  map.second.id = KeyframeId::Make(1, 2);
  map.first.map_id = map.second.map_id = 1;
  for (KeyframeProposal* keyframe : {&map.first, &map.second}) {
    keyframe->features.keypoints.resize(10'000);
    keyframe->features.descriptors.resize(10'000);
  }
  map.points.resize(9000);
  EXPECT_LE(Encode(map).size(), kMaxRecordBytes);
}

TEST(RecordGroupsTest, SoIsOneOfFourKeyframesOfFiveThousandFeatures) {
  InitialMap map;
  map.map_id = 1;
  map.between.resize(2);
  uint32_t frame = 0;
  for (KeyframeProposal* keyframe :
       {&map.first, &map.between[0].keyframe, &map.between[1].keyframe, &map.second}) {
    keyframe->id = KeyframeId::Make(1, ++frame);
    keyframe->map_id = 1;
    keyframe->features.keypoints.resize(5000);
    keyframe->features.descriptors.resize(5000);
  }
  map.points.resize(5000);
  for (InitialMap::View& view : map.between) view.sights.resize(5000);
  EXPECT_LE(Encode(map).size(), kMaxRecordBytes);
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
