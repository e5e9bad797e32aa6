#include "collector/proposed_keyframes.h"

#include <gtest/gtest.h>

#include <memory>
#include <sstream>

namespace dmslam {
namespace {

constexpr MapId kMap = 1;
constexpr int64_t kEpoch = 100;

KeyframeId Id(uint32_t frame) { return KeyframeId::Make(4, frame); }
bool NoneIsKnown(KeyframeId) { return false; }

class ProposedKeyframesTest : public testing::Test {
 protected:
  ProposedKeyframesTest() {
    proposed_.NoteTo([this](const std::string& note) { notes_.push_back(note); });
  }
  void Propose(uint32_t frame, int64_t seq, int64_t epoch = kEpoch) {
    proposed_.OnProposal(Id(frame), kMap, {epoch, seq}, 0);
    proposed_.KeepRecord(Id(frame), std::make_shared<const Bytes>(Bytes{static_cast<uint8_t>(frame)}));
  }
  static bool Lives(CameraId, int64_t epoch) { return epoch > kEpoch; }
  KeyframeRecord Count(int64_t mapped_epoch, const ProposedKeyframes::IsKnown& is_known = NoneIsKnown) const {
    KeyframeRecord record;
    proposed_.CountMissing(
        is_known, [=](CameraId) { return mapped_epoch; }, &record);
    return record;
  }

  /// Of the notes.
  ProposedKeyframes ReadByTheNext() const {
    ProposedKeyframes next;
    for (const std::string& text : notes_) {
      std::istringstream note(text);
      std::string kind;
      note >> kind;
      next.ReadNote(kind, note);
    }
    return next;
  }

  ProposedKeyframes proposed_;
  std::vector<std::string> notes_;
};

TEST_F(ProposedKeyframesTest, WhatADeadFrontendLeftIsSaidAgainUntilAMapperHasIt) {
  Propose(1, 10);
  Propose(2, 20);
  proposed_.OnMapped(0, {kEpoch, 10});
  auto left = proposed_.ToSayAgain(Lives, NoneIsKnown);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left[0].id, Id(2));
  EXPECT_EQ(left[0].record->front(), 2);
  EXPECT_TRUE(proposed_.ToSayAgain([](CameraId, int64_t) { return true; }, NoneIsKnown).empty())
      << "its frontend says it itself";
  EXPECT_TRUE(proposed_.ToSayAgain(Lives, [](KeyframeId) { return true; }).empty());
  proposed_.OnMapped(0, {kEpoch, 20});
  EXPECT_TRUE(proposed_.ToSayAgain(Lives, NoneIsKnown).empty());
}

TEST_F(ProposedKeyframesTest, NothingIsSaidAgainForEver) {
  Propose(1, 10);
  int times = 0;
  while (times < 1000 && !proposed_.ToSayAgain(Lives, NoneIsKnown).empty()) ++times;
  EXPECT_GE(times, 10);
  EXPECT_LE(times, 100);
}

TEST_F(ProposedKeyframesTest, WhatIsNotInTheMapIsNamedByWhatBecameOfIt) {
  Propose(1, 10);
  proposed_.OnAllDied();
  Propose(2, 20);
  Propose(3, 30);
  proposed_.OnMapped(0, {kEpoch, 25});  // 1 and 2 were taken
  const auto only_2_is_lacking = [](KeyframeId id) { return id != Id(2); };
  EXPECT_EQ(Count(kEpoch, only_2_is_lacking).missing, 1u);
  const KeyframeRecord record = Count(kEpoch + 1);
  EXPECT_EQ(record.proposed, 3u);
  EXPECT_EQ(record.lost_in_crash, 1u);
  EXPECT_EQ(record.missing, 1u);
  EXPECT_EQ(record.lost_with_frontend, 1u) << "3: the map goes on with another frontend";
}

TEST_F(ProposedKeyframesTest, WhetherAMapperHadTakenAnySinceAllDied) {
  Propose(1, 10);
  EXPECT_FALSE(proposed_.AnyMapped());
  proposed_.OnMapped(0, {kEpoch, 10});
  EXPECT_TRUE(proposed_.AnyMapped());
  proposed_.OnAllDied();
  EXPECT_FALSE(proposed_.AnyMapped());
}

TEST_F(ProposedKeyframesTest, OfADroppedMapNothingIsMissingNorSaidAgain) {
  Propose(1, 10);
  proposed_.OnDropped(kMap + 1);
  EXPECT_EQ(Count(kEpoch).missing, 1u);
  proposed_.OnDropped(kMap);
  EXPECT_EQ(Count(kEpoch).missing, 0u);
  EXPECT_TRUE(proposed_.ToSayAgain(Lives, NoneIsKnown).empty());
}

TEST_F(ProposedKeyframesTest, OfAMapThatItsFrontendGaveUpNothingIsMissing) {
  Propose(1, 10);
  proposed_.OnGivenUp(kMap + 1);
  EXPECT_EQ(Count(kEpoch).missing, 1u);
  proposed_.OnGivenUp(kMap);
  EXPECT_EQ(Count(kEpoch).missing, 0u);
  EXPECT_FALSE(proposed_.WasDropped(kMap)) << "no mapper has said so";
}

TEST_F(ProposedKeyframesTest, ADroppedMapIsNotedOnceAlsoWhereItsFrontendGaveItUp) {
  proposed_.OnGivenUp(2);
  EXPECT_TRUE(notes_.empty());
  proposed_.OnDropped(2);
  proposed_.OnDropped(2);
  EXPECT_EQ(notes_, std::vector<std::string>{"dropped 2"});
}

TEST_F(ProposedKeyframesTest, AMapThatContinuesNoneSaysThatAllHadDiedWhereSomethingWasToBeInOne) {
  proposed_.OnFreshMap(10, false);
  EXPECT_EQ(proposed_.times_all_died(), 0) << "the run's first";
  Propose(1, 10);
  proposed_.OnFreshMap(11, false);
  EXPECT_EQ(proposed_.times_all_died(), 0) << "nothing was in a map";
  proposed_.OnFreshMap(12, true);
  EXPECT_EQ(proposed_.times_all_died(), 1) << "it goes on with a checkpoint";
  Propose(2, 20);
  proposed_.OnMapped(0, {kEpoch, 20});
  proposed_.OnFreshMap(13, false);
  proposed_.OnFreshMap(13, false);
  EXPECT_EQ(proposed_.times_all_died(), 2);
  EXPECT_EQ(Count(kEpoch).lost_in_crash, 2u);
}

TEST_F(ProposedKeyframesTest, TheNextOneKnowsWhichTermItsMapBeganInAndWhatWasDropped) {
  Propose(1, 10);
  proposed_.OnFreshMap(11, true);
  proposed_.OnDropped(5);
  ProposedKeyframes next = ReadByTheNext();
  EXPECT_EQ(next.times_all_died(), 1);
  std::vector<std::string> notes;
  next.NoteTo([&](const std::string& note) { notes.push_back(note); });
  next.OnFreshMap(11, true);
  next.OnDropped(5);
  EXPECT_EQ(next.times_all_died(), 1) << "both hear the beginning of the same term";
  EXPECT_TRUE(notes.empty());
  EXPECT_TRUE(next.WasDropped(5));
}

TEST_F(ProposedKeyframesTest, ItsNotesTellTheNextOne) {
  Propose(1, 10);
  Propose(2, 20);
  Propose(2, 20);  // again
  proposed_.OnMapped(0, {kEpoch, 10});
  EXPECT_EQ(notes_.size(), 3u);
  const ProposedKeyframes next = ReadByTheNext();
  KeyframeRecord record;
  next.CountMissing(
      NoneIsKnown, [](CameraId) { return kEpoch + 1; }, &record);
  EXPECT_EQ(record.proposed, 2u);
  EXPECT_EQ(record.missing, 1u) << "1 was taken, and is not there";
  EXPECT_EQ(record.lost_with_frontend, 1u);
}

TEST_F(ProposedKeyframesTest, WhenEachWasHeardIsKnown) {
  proposed_.OnProposal(Id(1), kMap, {kEpoch, 10}, 77);
  proposed_.OnProposal(Id(1), kMap, {kEpoch, 10}, 99);
  EXPECT_EQ(proposed_.HeardNs(Id(1)), 77);
  EXPECT_FALSE(proposed_.HeardNs(Id(2)));
}

}  // namespace
}  // namespace dmslam
