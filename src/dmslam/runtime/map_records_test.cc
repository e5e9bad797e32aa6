#include "dmslam/runtime/map_records.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/messaging/stream_writer.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
const Term kTerm{10, 3};

MapDelta Change(uint64_t version, MapEvent event = MapEvent::kMapped) {
  MapDelta delta;
  delta.event = event;
  delta.version = version;
  if (event == MapEvent::kMapped) {
    delta.about = KeyframeId::Make(1, 1);
    delta.map_id = 1;
  }
  return delta;
}

MapDelta Part(uint64_t version, uint32_t index, uint32_t count) {
  MapDelta delta = Change(version);
  delta.group = {version, index, count};
  delta.dropped_maps = {index + 1};
  return delta;
}

/// A snapshot of one record.
class OnePiece : public SnapshotSource {
 public:
  void BeginSnapshot(int64_t) override {}
  Piece NextPiece() override {
    return {wire::Info<MapDelta>().channel, wire::Encode(Change(100, MapEvent::kSnapshot)), true};
  }
};

/// A mapper's stream, and who reads it.
class MapRecordsTest : public testing::Test {
 protected:
  MapRecordsTest() : reader_(ReaderOptions()) { Succeed(kTerm, {}); }

  static StreamReader::Options ReaderOptions() {
    StreamReader::Options options;
    options.stream = StreamId::kMap;
    options.owner = "MAPPER";
    options.reader = "VIEWER";
    options.role = "viewer";
    options.id = 1;
    return options;
  }
  /// Another writer goes on from `parent`; none: it begins anew.
  void Succeed(const Term& term, const Version& parent) {
    StreamWriter::Options options;
    options.stream = StreamId::kMap;
    options.owner = "MAPPER";
    options.roles = {{"viewer", false}};
    writer_ = std::make_unique<StreamWriter>(options, term, parent, &snapshots_);
    Run();
  }
  /// For half a second.
  void Run() {
    for (int i = 0; i < 100; ++i, now_ns_ += 5 * kMs) {
      writer_->Advance(now_ns_);
      for (const Outgoing& out : writer_->TakeOutgoing()) {
        if (!out.local) reader_.Receive(out.channel, *out.bytes, now_ns_);
      }
      reader_.Advance(now_ns_);
      for (const Outgoing& out : reader_.TakeOutgoing()) writer_->Receive(out.channel, *out.bytes, now_ns_);
    }
  }
  /// The next record of the stream, read.
  std::optional<MapRecords::Outcome> Read() {
    const std::optional<Record> record = reader_.Take();
    if (!record) return std::nullopt;
    return records_.Read(*record, &reader_, now_ns_);
  }
  MapRecords::Outcome Tell(std::vector<uint8_t> bytes) {
    writer_->Publish(wire::Info<MapDelta>().channel, std::move(bytes), now_ns_);
    Run();
    std::optional<MapRecords::Outcome> outcome = Read();
    EXPECT_TRUE(outcome.has_value());
    return outcome.value_or(MapRecords::Outcome{});
  }
  MapRecords::Outcome Tell(const MapDelta& delta) { return Tell(wire::Encode(delta)); }

  int64_t now_ns_ = kMs;
  OnePiece snapshots_;
  std::unique_ptr<StreamWriter> writer_;
  StreamReader reader_;
  MapRecords records_;
};

TEST_F(MapRecordsTest, AChangeIsThatOfItsRecord) {
  const MapRecords::Outcome outcome = Tell(Change(7));
  ASSERT_TRUE(outcome.change);
  EXPECT_EQ(outcome.change->version, 7U);
  EXPECT_TRUE(outcome.complaints.empty());
  EXPECT_EQ(reader_.held(), (Version{10, 1}));
}

TEST_F(MapRecordsTest, UntilItsGroupIsWholeThereIsNoChangeAndNothingIsHeld) {
  ASSERT_TRUE(Tell(Change(1)).change);
  for (const uint32_t index : {0U, 1U}) {
    const MapRecords::Outcome outcome = Tell(Part(2, index, 3));
    EXPECT_FALSE(outcome.change);
    EXPECT_TRUE(outcome.complaints.empty());
    EXPECT_EQ(reader_.held(), (Version{10, 1}));
  }
  const MapRecords::Outcome outcome = Tell(Part(2, 2, 3));
  ASSERT_TRUE(outcome.change);
  EXPECT_EQ(outcome.change->dropped_maps, (std::vector<MapId>{1, 2, 3}));
  EXPECT_TRUE(outcome.change->group.alone());
  EXPECT_EQ(reader_.held(), (Version{10, 4}));
}

TEST_F(MapRecordsTest, ForARecordThatCannotBeReadASnapshotIsAskedForAndNothingOfItIsHeld) {
  ASSERT_TRUE(Tell(Change(1)).change);
  std::vector<uint8_t> unreadable = wire::Encode(Change(2));
  unreadable[0] ^= 1;
  const MapRecords::Outcome outcome = Tell(unreadable);
  EXPECT_FALSE(outcome.change);
  ASSERT_EQ(outcome.complaints.size(), 1U);
  EXPECT_NE(outcome.complaints[0].find("asks for a snapshot"), std::string::npos) << outcome.complaints[0];
  EXPECT_EQ(reader_.state(), StreamReader::State::kSnapshot);
  EXPECT_TRUE(reader_.held().empty());
  Run();
  const std::optional<MapRecords::Outcome> snapshot = Read();
  ASSERT_TRUE(snapshot && snapshot->change);
  EXPECT_EQ(snapshot->change->version, 100U);
  EXPECT_EQ(reader_.held(), (Version{10, 2}));
}

TEST_F(MapRecordsTest, ABrokenGroupIsNamedAndNoneOfItsRecordsIsLeftForTheNext) {
  EXPECT_FALSE(Tell(Part(2, 0, 3)).change);
  const MapRecords::Outcome broken = Tell(Part(2, 2, 3));
  EXPECT_FALSE(broken.change);
  ASSERT_EQ(broken.complaints.size(), 1U);
  EXPECT_NE(broken.complaints[0].find("record 2 of 3"), std::string::npos) << broken.complaints[0];
  EXPECT_EQ(reader_.state(), StreamReader::State::kSnapshot);
  Run();
  ASSERT_TRUE(Read());  // the snapshot
  EXPECT_FALSE(Tell(Part(101, 0, 2)).change);
  const MapRecords::Outcome whole = Tell(Part(101, 1, 2));
  ASSERT_TRUE(whole.change) << whole.complaints.front();
  EXPECT_EQ(whole.change->dropped_maps, (std::vector<MapId>{1, 2}));
}

/// Versions count changes: no writer says one that was there.
TEST_F(MapRecordsTest, AnEarlierChangeIsAskedForAgainAndBelievedWhenItIsSaidAgain) {
  ASSERT_TRUE(Tell(Change(5)).change);
  for (const uint64_t version : {5, 4}) {
    const Version before = reader_.held();
    const MapRecords::Outcome outcome = Tell(Change(version));
    EXPECT_FALSE(outcome.change);
    EXPECT_TRUE(outcome.complaints.empty()) << "it is no fault";
    EXPECT_EQ(reader_.held(), before) << "as if it had not come";
    Run();
    const std::optional<MapRecords::Outcome> again = Read();
    ASSERT_TRUE(again && again->change);
    EXPECT_EQ(again->change->version, version);
    EXPECT_GT(reader_.held(), before);
  }
}

TEST_F(MapRecordsTest, TheVersionsOfASuccessorAreItsOwn) {
  ASSERT_TRUE(Tell(Change(5)).change);
  Succeed({20, 9}, reader_.held());
  EXPECT_TRUE(Tell(Change(4)).change) << "no earlier one of its own";
  EXPECT_FALSE(Tell(Change(4)).change);
}

TEST_F(MapRecordsTest, AGroupWhoseWriterIsGoneIsNamedAndTheSuccessorsChangeIsGood) {
  ASSERT_TRUE(Tell(Change(1)).change);
  EXPECT_FALSE(Tell(Part(2, 0, 3)).change);
  Succeed({20, 9}, reader_.held());
  const MapRecords::Outcome outcome = Tell(Change(2));
  ASSERT_TRUE(outcome.change);
  EXPECT_TRUE(outcome.change->dropped_maps.empty());
  ASSERT_EQ(outcome.complaints.size(), 1U);
  EXPECT_NE(outcome.complaints[0].find("its writer is gone"), std::string::npos);
  EXPECT_EQ(reader_.state(), StreamReader::State::kFollowing) << "what is held is good";
}

TEST_F(MapRecordsTest, WhereTheStreamBeginsAnewAnOpenGroupIsVoid) {
  EXPECT_FALSE(Tell(Part(2, 0, 3)).change);
  Succeed({20, 9}, {});
  const MapRecords::Outcome outcome = Tell(Change(1));
  EXPECT_TRUE(outcome.change);
  EXPECT_TRUE(outcome.complaints.empty()) << "nothing is lost that anybody held";
}

TEST_F(MapRecordsTest, ASavedMapIsInPartsUntilSomethingElseIsTold) {
  EXPECT_FALSE(records_.InParts());
  EXPECT_TRUE(Tell(Change(1, MapEvent::kSnapshot)).change);
  EXPECT_TRUE(records_.InParts());
  EXPECT_TRUE(Tell(Change(1, MapEvent::kSnapshot)).change) << "its parts are of one version";
  EXPECT_FALSE(Tell(Part(2, 0, 2)).change);
  EXPECT_TRUE(records_.InParts()) << "the rest of the group is to come";
  EXPECT_TRUE(Tell(Part(2, 1, 2)).change);
  EXPECT_FALSE(records_.InParts());
}

TEST_F(MapRecordsTest, ASnapshotForALateReaderIsNoSavedMap) {
  EXPECT_TRUE(Tell(Change(1, MapEvent::kSnapshot)).change);
  reader_.Forget();
  Run();
  const std::optional<MapRecords::Outcome> snapshot = Read();
  ASSERT_TRUE(snapshot && snapshot->change);
  EXPECT_FALSE(records_.InParts());
}

}  // namespace
}  // namespace dmslam
