#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/packing.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/messaging/stream_writer.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSession = 7;

// A record of about `size` bytes: replica_t serves as a message with a header; its role holds the payload.
Bytes MakeRecord(int64_t value, size_t size = 100) {
  replica_t message{};
  message.holder = value;
  message.role.assign(size, 'x');
  return Encode(message);
}
int64_t ValueOf(const Record& record) { return DecodeReplica(record.channel, *record.bytes).value().holder; }

StreamWriter::Options WriterOptions(Link link = Link::kHost) {
  StreamWriter::Options options;
  options.session = kSession;
  options.owner = "TEST";
  options.name = "writer";
  options.link = link;
  options.roles = {{"reader", false}};
  options.pack = false;
  return options;
}

StreamReader::Options ReaderOptions(int64_t id = 1) {
  StreamReader::Options options;
  options.session = kSession;
  options.owner = "TEST";
  options.reader = "READER";
  options.role = "reader";
  options.name = "reader " + std::to_string(id);
  options.id = id;
  return options;
}

// One writer and one reader in step; `drop` decides what the wire swallows.
struct Pair {
  StreamWriter writer;
  StreamReader reader;
  int64_t now_ns = 0;
  std::function<bool(const Outgoing&)> drop = [](const Outgoing&) { return false; };

  explicit Pair(StreamWriter::Options options = WriterOptions(), SnapshotSource* snapshots = nullptr)
      : writer(std::move(options), Term{1000, 5}, Version{}, snapshots), reader(ReaderOptions()) {}

  void Run(int64_t duration_ns) {
    for (const int64_t end = now_ns + duration_ns; now_ns < end; now_ns += kMs) Step();
  }
  void Step() {
    writer.Advance(now_ns);
    for (const Outgoing& out : writer.TakeOutgoing()) {
      if (!out.local && !drop(out)) reader.Receive(out.channel, *out.bytes, now_ns);
    }
    reader.Advance(now_ns);
    for (const Outgoing& out : reader.TakeOutgoing()) {
      if (!drop(out)) writer.Receive(out.channel, *out.bytes, now_ns);
    }
  }
  std::vector<int64_t> TakeAll() {
    std::vector<int64_t> values;
    while (std::optional<Record> record = reader.Take()) values.push_back(ValueOf(*record));
    return values;
  }
};

TEST(Stream, DeliversInOrderAndHearsTheAcceptance) {
  Pair pair;
  pair.Step();
  for (int64_t value : {11, 12, 13}) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(value), pair.now_ns);
  pair.Run(50 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{11, 12, 13}));
  EXPECT_FALSE(pair.writer.AcknowledgedByAny(1));
  pair.reader.Accept({1000, 2});
  pair.Run(50 * kMs);
  EXPECT_TRUE(pair.writer.AcknowledgedByAny(2));
  EXPECT_FALSE(pair.writer.AcknowledgedByAny(3));
  EXPECT_EQ(pair.writer.Backlog("reader"), 1);
  pair.reader.AcceptTaken();
  pair.Run(50 * kMs);
  EXPECT_EQ(pair.writer.AcknowledgedBy("reader"), 3);
  EXPECT_EQ(pair.writer.AcknowledgedBy("nobody"), std::nullopt);
}

TEST(Stream, TheFirstRecordOfAFreshTermBeginsAnew) {
  Pair pair;
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(1), 0);
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(2), 0);
  pair.Run(200 * kMs);
  EXPECT_TRUE(pair.reader.Take()->begins_anew());
  EXPECT_FALSE(pair.reader.Take()->begins_anew());
}

TEST(Stream, RepairsTheTailThatOnlyTheBeaconExposes) {
  Pair pair;
  pair.Step();
  pair.drop = [](const Outgoing& out) { return out.channel == "DMSLAM_TEST_X"; };
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(1, 5000), pair.now_ns);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), std::vector<int64_t>{1});
  EXPECT_EQ(pair.reader.statistics().repaired, 1);
  EXPECT_EQ(pair.writer.statistics().parts_repaired, 4);
  EXPECT_GT(pair.reader.statistics().recovery_p50_ms, 0);
  EXPECT_LT(pair.reader.statistics().recovery_p99_ms, 300);
}

TEST(Stream, OnALanOnlyTheLostPartsAreSentAgain) {
  Pair pair(WriterOptions(Link::kLan));
  pair.Run(50 * kMs);  // they have met
  int parts = 0;
  pair.drop = [&](const Outgoing& out) { return out.channel == "DMSLAM_TEST_PART" && ++parts % 10 == 0; };
  for (int i = 0; i < 10; ++i) {
    pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i, 30000), pair.now_ns);
    pair.Run(33 * kMs);
  }
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll().size(), 10u);
  const WriterStatistics statistics = pair.writer.statistics();
  EXPECT_EQ(statistics.parts, 220);
  EXPECT_EQ(statistics.parts_repaired, parts / 10);
}

TEST(Stream, PartsArePiecesOfTheDeflatedRecord) {
  StreamWriter::Options options = WriterOptions(Link::kLan);
  options.pack = true;
  Pair pair(options);
  pair.Step();
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(7, 30000), pair.now_ns);
  pair.Run(100 * kMs);
  EXPECT_EQ(pair.TakeAll(), std::vector<int64_t>{7});
  EXPECT_EQ(pair.writer.statistics().parts, 1);
}

TEST(Packing, ContentComesBackAndDamageDoesNot) {
  Bytes record(5000, 3);
  for (const bool pack : {false, true}) {
    Bytes content = ContentOf("DMSLAM_TEST_X", record, pack);
    EXPECT_EQ(content.size() < 200, pack);
    const auto parsed = ParseContent(content, 10000);
    ASSERT_TRUE(parsed.has_value());
    EXPECT_EQ(parsed->first, "DMSLAM_TEST_X");
    EXPECT_EQ(parsed->second, record);
  }
  Bytes content = ContentOf("DMSLAM_TEST_X", record, true);
  EXPECT_FALSE(ParseContent(content, 5000).has_value()) << "longer than allowed";
  content[content.size() / 2] ^= 1;
  EXPECT_FALSE(ParseContent(content, 10000).has_value());
  EXPECT_FALSE(ParseContent({}, 10000).has_value());
  content.resize(5);
  EXPECT_FALSE(ParseContent(content, 10000).has_value());
}

TEST(Stream, OnALanNothingIsSentAgainWhenNothingIsLost) {
  Pair pair(WriterOptions(Link::kLan));
  pair.Run(50 * kMs);  // they have met
  for (int i = 0; i < 30; ++i) {
    pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i, 60000), pair.now_ns);
    pair.Run(33 * kMs);
  }
  pair.Run(100 * kMs);
  EXPECT_EQ(pair.TakeAll().size(), 30u);
  const WriterStatistics statistics = pair.writer.statistics();
  EXPECT_EQ(statistics.parts_repaired, 0);
  EXPECT_LT(static_cast<double>(statistics.sent_bytes), 1.05 * static_cast<double>(statistics.payload_bytes));
}

TEST(Stream, ALocalTapCarriesTheWholeMessageOfALan) {
  StreamWriter writer(WriterOptions(Link::kLan), Term{1000, 5}, Version{});
  writer.Publish("DMSLAM_TEST_X", MakeRecord(1, 5000), 0);
  int taps = 0;
  for (const Outgoing& out : writer.TakeOutgoing()) {
    taps += out.local;
    EXPECT_EQ(out.local, out.channel == "DMSLAM_TEST_X");
    EXPECT_TRUE(out.local || out.bytes->size() <= 1430u);
  }
  EXPECT_EQ(taps, 1);
}

TEST(Stream, CorruptMessagesAreCountedAndRepaired) {
  Pair pair;
  pair.Step();
  StreamWriter& writer = pair.writer;
  writer.Publish("DMSLAM_TEST_X", MakeRecord(1), pair.now_ns);
  Bytes changed = *writer.TakeOutgoing().at(0).bytes;
  changed[changed.size() - 3] ^= 1;
  pair.reader.Receive("DMSLAM_TEST_X", changed, pair.now_ns);
  EXPECT_EQ(pair.reader.statistics().dropped_bad, 1);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), std::vector<int64_t>{1});
}

TEST(Stream, ForeignSessionsAreDroppedAndCounted) {
  Pair pair;
  StreamWriter::Options options = WriterOptions();
  options.session = 8;
  StreamWriter ghost(options, Term{2000, 6}, Version{});
  ghost.Advance(0);
  ghost.Publish("DMSLAM_TEST_X", MakeRecord(1), 0);
  for (const Outgoing& out : ghost.TakeOutgoing()) {
    pair.reader.Receive(out.channel, *out.bytes, 0);
    pair.writer.Receive(out.channel, *out.bytes, 0);
  }
  EXPECT_EQ(pair.reader.statistics().dropped_foreign, 2);
  EXPECT_EQ(pair.writer.statistics().dropped_foreign, 1);
  EXPECT_FALSE(pair.reader.Take().has_value());
  EXPECT_FALSE(pair.writer.superseded_by());
}

TEST(Stream, OtherTypesAreRefusedByNameOnBothSides) {
  StreamWriter::Options options = WriterOptions();
  options.schema_hash = 99;
  Pair pair(options);
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(1), 0);
  pair.Run(2000 * kMs);
  EXPECT_EQ(pair.reader.state(), StreamReader::State::kRefusedVersion);
  EXPECT_NE(pair.reader.problem().find("writer"), std::string::npos);
  EXPECT_NE(pair.writer.refusal().find("reader 1"), std::string::npos);
  EXPECT_FALSE(pair.reader.Take().has_value());
}

TEST(Stream, AWriterThatHearsAHigherTermStops) {
  StreamWriter low(WriterOptions(), Term{1000, 5}, Version{});
  StreamWriter high(WriterOptions(), Term{1000, 6}, Version{});
  for (const int64_t now : {int64_t{0}, 100 * kMs}) {
    low.Advance(now);
    high.Advance(now);
    for (const Outgoing& out : high.TakeOutgoing()) low.Receive(out.channel, *out.bytes, now);
    for (const Outgoing& out : low.TakeOutgoing()) high.Receive(out.channel, *out.bytes, now);
    EXPECT_EQ(low.superseded_by().has_value(), now > 0) << "one beacon alone may be forged";
  }
  EXPECT_EQ(low.superseded_by(), "writer");
  EXPECT_FALSE(high.superseded_by());
  low.Publish("DMSLAM_TEST_X", MakeRecord(1), kMs);
  low.Advance(1000 * kMs);
  EXPECT_TRUE(low.TakeOutgoing().empty());
}

TEST(Stream, MemoryStaysWithinTheBoundAndFullSaysSo) {
  StreamWriter::Options options = WriterOptions();
  options.roles = {{"reader", true}};
  options.max_records = 10;
  StreamWriter writer(options, Term{1000, 5}, Version{});
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(writer.Full());
    writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  }
  EXPECT_TRUE(writer.Full());
  writer.Publish("DMSLAM_TEST_X", MakeRecord(10), 0);
  EXPECT_EQ(writer.statistics().kept_records, 10u);
  EXPECT_EQ(writer.statistics().overrun, 1);
}

TEST(Stream, AReaderThatStartsFromAVersionGoesOnBehindIt) {
  Pair pair;
  for (int i = 1; i <= 5; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  StreamReader::Options options = ReaderOptions();
  options.start = {1000, 3};
  pair.reader = StreamReader(options);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{4, 5}));
}

TEST(Stream, WithoutSnapshotsAReaderSkipsWhatIsGoneAndCountsWhatItMissed) {
  StreamWriter::Options options = WriterOptions();
  options.max_records = 3;
  Pair pair(options);
  for (int i = 1; i <= 8; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{6, 7, 8}));
  EXPECT_EQ(pair.reader.statistics().lost, 0) << "gone before it came";
  pair.drop = [](const Outgoing&) { return true; };
  for (int i = 9; i <= 13; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), pair.now_ns);
  pair.Run(300 * kMs);
  pair.drop = [](const Outgoing&) { return false; };
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{11, 12, 13}));
  EXPECT_EQ(pair.reader.statistics().lost, 2);
  StreamReader::Options first = ReaderOptions();
  first.wants_all = true;
  pair.reader = StreamReader(first);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{11, 12, 13}));
  EXPECT_EQ(pair.reader.statistics().lost, 10) << "it is the first one, and wanted them too";
}

TEST(Stream, AReaderThatHeldSomethingCountsWhatIsGoneWhenItComesBack) {
  StreamWriter::Options options = WriterOptions();
  options.max_records = 3;
  Pair pair(options);
  for (int i = 1; i <= 8; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  StreamReader::Options back = ReaderOptions();
  back.start = {1000, 2};  // was started again, and holds what the one before had accepted
  pair.reader = StreamReader(back);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{6, 7, 8}));
  EXPECT_EQ(pair.reader.statistics().lost, 3);
}

TEST(Stream, ACompleteStreamStaysUntilItIsClosed) {
  StreamWriter::Options options = WriterOptions();
  options.roles = {{"reader", true}};
  Pair pair(options);
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(1), 0);
  pair.drop = [](const Outgoing&) { return true; };
  pair.writer.Complete(pair.now_ns);
  pair.Run(20'000 * kMs);
  EXPECT_FALSE(pair.writer.completed()) << "a reader that it needs has not been there";
  pair.drop = [](const Outgoing&) { return false; };
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{1}));
  pair.reader.AcceptTaken();
  pair.Run(20'000 * kMs);
  EXPECT_TRUE(pair.writer.completed());
  EXPECT_FALSE(pair.writer.closed());
  pair.reader = StreamReader(ReaderOptions(2));  // comes late: hears all the same that this is the end
  pair.Run(300 * kMs);
  pair.TakeAll();
  EXPECT_TRUE(pair.reader.AtEnd());
  pair.writer.Close(pair.now_ns);
  pair.Run(300 * kMs);
  EXPECT_TRUE(pair.writer.closed());
}

// Values 1..n as pieces of three.
struct CountingSource : SnapshotSource {
  int64_t cut = 0, next = 1;
  size_t bytes = 3000;
  void BeginSnapshot(int64_t c) override {
    cut = c;
    next = 1;
  }
  Piece NextPiece() override {
    Piece piece{"DMSLAM_TEST_X", MakeRecord(-next, bytes), false};
    next += 3;
    piece.last = next > cut;
    return piece;
  }
};

TEST(Stream, ALateReaderGetsASnapshotAndGoesOnBehindIt) {
  for (const Link link : {Link::kHost, Link::kLan}) {
    StreamWriter::Options options = WriterOptions(link);
    options.max_records = 4;
    CountingSource source;
    Pair pair(options, &source);
    for (int i = 1; i <= 100; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
    int count = 0;
    pair.drop = [&](const Outgoing& out) { return out.bytes->size() > 500 && ++count % 4 == 0; };
    std::vector<int64_t> taken;
    for (int i = 101; i <= 110; ++i) {
      pair.Run(100 * kMs);
      pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), pair.now_ns);
      while (std::optional<Record> record = pair.reader.Take()) {
        EXPECT_EQ(record->begins_anew(), taken.empty());
        taken.push_back(ValueOf(*record));
      }
      pair.reader.AcceptTaken();
    }
    pair.Run(1000 * kMs);
    for (const int64_t value : pair.TakeAll()) taken.push_back(value);
    const int64_t cut = source.cut;
    ASSERT_GE(cut, 100);
    std::vector<int64_t> expected;
    for (int64_t v = 1; v <= cut; v += 3) expected.push_back(-v);
    for (int64_t v = cut + 1; v <= 110; ++v) expected.push_back(v);
    EXPECT_EQ(taken, expected);
    EXPECT_EQ(pair.writer.statistics().snapshots, 1);
    EXPECT_EQ(pair.reader.held(), (Version{1000, 110}));
  }
}

/// As a large map: while it is cut, which takes half a minute, nobody is heard.
TEST(Stream, WhoWaitsWhileASnapshotIsCutIsNotTakenForGone) {
  StreamWriter::Options options = WriterOptions();
  options.max_records = 4;
  CountingSource source;
  Pair pair(options, &source);
  for (int i = 1; i <= 100; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  while (pair.writer.statistics().snapshots == 0 && pair.now_ns < 1000 * kMs) pair.Step(), pair.now_ns += kMs;
  ASSERT_EQ(pair.writer.statistics().snapshots, 1);
  pair.now_ns += 30'000 * kMs;
  pair.Run(2000 * kMs);
  EXPECT_EQ(pair.writer.statistics().snapshots, 1);
  EXPECT_EQ(pair.TakeAll().size(), 34U);
}

TEST(Stream, ASnapshotKeepsToItsShareOfTheBus) {
  constexpr size_t kBytes = 30'000;
  StreamWriter::Options options = WriterOptions();
  options.max_records = 4;
  CountingSource source;
  source.bytes = kBytes;
  Pair pair(options, &source);
  for (int i = 1; i <= 1000; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  int pieces = 0;
  pair.drop = [&](const Outgoing& out) {
    pieces += out.bytes->size() >= kBytes ? 1 : 0;
    return false;
  };
  while (pieces == 0 && pair.now_ns < 1000 * kMs) pair.Step(), pair.now_ns += kMs;
  ASSERT_GT(pieces, 0);
  pieces = 0;
  pair.Run(200 * kMs);
  const double parts = 1 + static_cast<double>(kBytes / static_cast<size_t>(options.part_bytes));
  const double bursts = 200.0 * kMs / static_cast<double>(options.burst_ns);
  const double share = bursts * options.snapshot_per_burst / parts;
  EXPECT_LE(pieces, share + 2);
  EXPECT_GE(pieces, 0.7 * share);
}

TEST(Stream, ASuccessorIsFollowedWhenItKnowsWhatIsHeld) {
  Pair pair;
  for (int i = 1; i <= 5; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll().size(), 5u);
  pair.writer = StreamWriter(WriterOptions(), Term{2000, 1}, Version{1000, 5});
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(6), pair.now_ns);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), std::vector<int64_t>{6});
  EXPECT_EQ(pair.reader.held(), (Version{2000, 1}));
}

TEST(Stream, WhatTheSuccessorDoesNotKnowIsNotHandedOut) {
  Pair pair;
  for (int i = 1; i <= 5; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  pair.Run(300 * kMs);
  pair.writer = StreamWriter(WriterOptions(), Term{2000, 1}, Version{1000, 3});
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(6), pair.now_ns);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{1, 2, 3, 6}));
}

TEST(Stream, ASuccessorThatKnowsLessIsRefusedAndHearsIt) {
  Pair pair;
  for (int i = 1; i <= 5; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll().size(), 5u);
  CountingSource source;
  pair.writer = StreamWriter(WriterOptions(), Term{2000, 1}, Version{1000, 4}, &source);
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(6), pair.now_ns);
  pair.Run(2000 * kMs);
  EXPECT_EQ(pair.reader.state(), StreamReader::State::kRefusedBehind);
  EXPECT_EQ(pair.TakeAll().size(), 0u);
  EXPECT_EQ(pair.writer.newer_replica(), (Version{1000, 5}));
  pair.reader.Forget();
  pair.Run(2000 * kMs);
  EXPECT_EQ(pair.TakeAll().at(0), -1);
  EXPECT_EQ(pair.reader.held(), (Version{2000, 1}));
}

TEST(Stream, OfAWriterThatIsGoneWhatCameIsHandedOutAndTheRestIsCounted) {
  Pair pair;
  for (int i = 1; i <= 5; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll().size(), 5u);
  pair.drop = [](const Outgoing& out) {
    const bool comes = out.channel == HeadChannel("TEST") ||
                       (out.channel == "DMSLAM_TEST_X" && ParseHeader(*out.bytes)->seq == 9);
    return !comes;
  };
  for (int i = 6; i <= 10; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), pair.now_ns);
  pair.Run(300 * kMs);
  pair.drop = [](const Outgoing&) { return false; };
  pair.writer = StreamWriter(WriterOptions(), Term{2000, 1}, Version{});
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(11), pair.now_ns);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{9, 11}));
  EXPECT_EQ(pair.reader.held(), (Version{2000, 1}));
  EXPECT_EQ(pair.reader.statistics().lost, 4);
  EXPECT_EQ(pair.reader.statistics().lost_with_writer, 4);
}

/// What came before the first record that is here may be what its owner turns out to hold.
TEST(Stream, WhoDoesNotKnowYetWhatItHoldsCountsOnlyGaps) {
  for (const bool any_comes : {false, true}) {
    Pair pair;
    StreamReader::Options options = ReaderOptions();
    options.start = std::nullopt;
    pair.reader = StreamReader(options);
    pair.drop = [any_comes](const Outgoing& out) {
      if (out.channel == HeadChannel("TEST")) return false;
      const std::optional<RecordHeader> header = ParseHeader(*out.bytes);
      return !any_comes || out.channel != "DMSLAM_TEST_X" || (header->seq != 3 && header->seq != 5);
    };
    for (int i = 1; i <= 5; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
    pair.writer.Advance(0);
    const std::vector<Outgoing> records = pair.writer.TakeOutgoing();
    pair.Run(300 * kMs);
    for (const Outgoing& out : records) {
      if (!pair.drop(out)) pair.reader.Receive(out.channel, *out.bytes, pair.now_ns);
    }
    pair.drop = [](const Outgoing&) { return false; };
    pair.writer = StreamWriter(WriterOptions(), Term{2000, 1}, Version{});
    pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(6), pair.now_ns);
    pair.Run(300 * kMs);
    EXPECT_EQ(pair.TakeAll(), any_comes ? (std::vector<int64_t>{3, 5, 6}) : std::vector<int64_t>{6});
    EXPECT_EQ(pair.reader.statistics().lost, any_comes ? 1 : 0);
  }
}

/// ... nor does it count what its predecessor, who is still there, has accepted before anything came here.
TEST(Stream, WhoDoesNotKnowYetWhatItHoldsCountsNothingThatIsForgottenBeforeAnythingCame) {
  StreamWriter::Options options = WriterOptions();
  options.max_records = 3;
  Pair pair(options);
  StreamReader::Options newcomer = ReaderOptions();
  newcomer.start = std::nullopt;
  pair.reader = StreamReader(newcomer);
  pair.drop = [](const Outgoing& out) { return out.channel != HeadChannel("TEST"); };
  for (int i = 1; i <= 8; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  pair.Run(300 * kMs);
  for (int i = 9; i <= 13; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), pair.now_ns);
  pair.Run(300 * kMs);
  pair.drop = [](const Outgoing&) { return false; };
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{11, 12, 13}));
  EXPECT_EQ(pair.reader.statistics().lost, 0);
  pair.drop = [](const Outgoing&) { return true; };
  for (int i = 14; i <= 18; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), pair.now_ns);
  pair.Run(300 * kMs);
  pair.drop = [](const Outgoing&) { return false; };
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.reader.statistics().lost, 2) << "what is behind that counts";
}

TEST(Stream, OfAWriterThatIsGoneWhatOthersHadIsCountedOnce) {
  Pair pair;
  pair.reader.NoteWritten({900, 7});  // before it came
  for (int i = 1; i <= 5; ++i) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i), 0);
  pair.Run(300 * kMs);
  pair.reader.NoteWritten({900, 8});
  pair.reader.NoteWritten({1000, 7});  // while it is away
  EXPECT_EQ(pair.reader.statistics().lost, 0) << "its writer lives: they may come";
  pair.writer = StreamWriter(WriterOptions(), Term{2000, 1}, Version{});
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(6), pair.now_ns);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.reader.statistics().lost, 2);
  for (const int64_t seq : {6, 7, 9, 9}) pair.reader.NoteWritten({1000, seq});
  EXPECT_EQ(pair.reader.statistics().lost, 4) << "6 to 9, each once";
  pair.reader.NoteWritten({1500, 3});
  EXPECT_EQ(pair.reader.statistics().lost, 7) << "a term of which nothing came";
  pair.reader.NoteWritten({2000, 1});
  EXPECT_EQ(pair.TakeAll(), (std::vector<int64_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(pair.reader.statistics().lost_with_writer, 7);
}

/// Of terms that were over before it came.
TEST(Stream, WhoWantsAllMissesWhatWasWrittenBeforeItCame) {
  for (const bool wants_all : {false, true}) {
    Pair pair;
    StreamReader::Options options = ReaderOptions();
    options.wants_all = wants_all;
    pair.reader = StreamReader(options);
    pair.reader.NoteWritten({900, 6});
    pair.reader.NoteWritten({900, 7});
    EXPECT_EQ(pair.reader.statistics().lost, 0) << "no later writer was heard: it may live";
    pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(1), 0);
    pair.Run(300 * kMs);
    EXPECT_EQ(pair.reader.statistics().lost, wants_all ? 7 : 0);
    pair.reader.NoteWritten({800, 2});
    pair.reader.NoteWritten({900, 7});
    EXPECT_EQ(pair.reader.statistics().lost, wants_all ? 9 : 0) << "each once";
    EXPECT_EQ(pair.reader.statistics().lost_with_writer, wants_all ? 9 : 0);
    EXPECT_EQ(pair.TakeAll(), std::vector<int64_t>{1});
    pair.reader.NoteWritten({1000, 1});
    pair.writer = StreamWriter(WriterOptions(), Term{2000, 1}, Version{});
    pair.Run(300 * kMs);
    EXPECT_EQ(pair.reader.statistics().lost, wants_all ? 9 : 0) << "what came is not lost";
  }
}

TEST(Stream, AReaderThatStartsFromAVersionMissesWhatItsWriterWroteBehindIt) {
  Pair pair;
  StreamReader::Options options = ReaderOptions();
  options.start = {900, 3};
  pair.reader = StreamReader(options);
  pair.reader.NoteWritten({900, 5});
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(6), pair.now_ns);
  pair.Run(300 * kMs);
  EXPECT_EQ(pair.TakeAll(), std::vector<int64_t>{6});
  EXPECT_EQ(pair.reader.statistics().lost, 2);
}

TEST(Stream, ClosingWaitsForTheReadersAndTellsThem) {
  Pair pair;
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(1), 0);
  pair.Run(200 * kMs);
  pair.writer.Close(pair.now_ns);
  pair.Run(500 * kMs);
  EXPECT_FALSE(pair.writer.closed());
  EXPECT_FALSE(pair.reader.AtEnd());
  EXPECT_EQ(pair.TakeAll().size(), 1u);
  pair.reader.AcceptTaken();
  pair.Run(500 * kMs);
  EXPECT_TRUE(pair.writer.closed());
  EXPECT_TRUE(pair.reader.AtEnd());
}

/// Asked by somebody who goes on with the stream, a writer closes it, and no reader takes that for the end.
TEST(Stream, WhatIsHandedOverGoesOn) {
  Pair pair;
  pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(1), 0);
  pair.Run(200 * kMs);
  EXPECT_EQ(pair.TakeAll().size(), 1u);
  pair.reader.AcceptTaken();
  for (int64_t asked = 0; asked < 4; ++asked) {
    EXPECT_FALSE(pair.writer.close_requested_by()) << "asked " << asked << " times";
    pair.Run(200 * kMs);
    take_over_t request{};
    request.utime = pair.now_ns / 1000;
    request.header.session = kSession;
    request.header.stream = static_cast<int32_t>(StreamId::kTest);
    request.header.epoch = pair.writer.term().epoch;
    request.header.writer = pair.writer.term().writer;
    request.successor = 77;
    request.name = "successor";
    const Outgoing message = SealedMessage(TakeOverChannel("TEST"), request);
    pair.writer.Receive(message.channel, *message.bytes, pair.now_ns);
  }
  ASSERT_TRUE(pair.writer.close_requested_by());
  pair.writer.Close(pair.now_ns);
  pair.Run(500 * kMs);
  EXPECT_TRUE(pair.writer.closed());
  EXPECT_FALSE(pair.reader.AtEnd());
}

// What keyframes of 20 to 60 KB cost on a LAN, and how late they come.
struct LinkCost {
  double ratio = 0;  // bytes of all messages in both directions / bytes of the records
  int64_t p50_ms = 0, p99_ms = 0;
};
LinkCost MeasureLink(double loss) {
  Pair pair(WriterOptions(Link::kLan));
  Random random(17);
  int64_t acks = 0;
  pair.drop = [&](const Outgoing& out) {
    if (out.channel == AckChannel("READER")) acks += static_cast<int64_t>(out.bytes->size());
    return random.Uniform() < loss;
  };
  std::vector<int64_t> latency_ms;
  for (int64_t ms = 0; ms < 60'000; ++ms) {
    if (ms % 200 == 100 && ms < 59'000) {
      pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(ms, 20000 + random.Below(40000)), pair.now_ns);
    }
    pair.Run(kMs);
    for (const int64_t sent_ms : pair.TakeAll()) latency_ms.push_back(ms - sent_ms);
    pair.reader.AcceptTaken();
  }
  EXPECT_EQ(latency_ms.size(), 295u);
  std::sort(latency_ms.begin(), latency_ms.end());
  const WriterStatistics statistics = pair.writer.statistics();
  const double bytes = static_cast<double>(statistics.sent_bytes + acks);
  return {bytes / static_cast<double>(statistics.payload_bytes), latency_ms[latency_ms.size() / 2],
          latency_ms[latency_ms.size() * 99 / 100]};
}

TEST(Stream, RepairCostsLittleMoreThanWhatWasLost) {
  for (const auto& [loss, bound] : {std::pair{0.0, 1.08}, {0.05, 1.15}, {0.2, 1.40}, {0.5, 2.3}}) {
    const LinkCost cost = MeasureLink(loss);
    std::printf("loss %2.0f %%: bytes on the link / payload %.3f, latency p50 %ld ms, p99 %ld ms\n",
                100 * loss, cost.ratio, static_cast<long>(cost.p50_ms), static_cast<long>(cost.p99_ms));
    EXPECT_LT(cost.ratio, bound) << loss;
    EXPECT_LT(cost.p99_ms, 2500) << loss;
  }
}

// Noise, changed messages, and changed messages sealed again (which no sum can tell) leave nobody hurt.
TEST(Stream, HostileBytesNeverThrowAndChangedOnesChangeNothing) {
  Pair pair;
  Random random(29);
  std::vector<Outgoing> heard;
  pair.drop = [&](const Outgoing& out) {
    if (heard.size() < 300) heard.push_back(out);
    return false;
  };
  std::vector<int64_t> values;
  for (int i = 0; i < 2000; ++i) {
    if (i % 20 == 0) pair.writer.Publish("DMSLAM_TEST_X", MakeRecord(i, 3000), pair.now_ns);
    pair.Run(kMs);
    for (const int64_t value : pair.TakeAll()) values.push_back(value);
    pair.reader.AcceptTaken();
    for (int n = 0; n < 10; ++n) {
      const Outgoing& out = heard[random.Below(static_cast<uint32_t>(heard.size()))];
      Bytes bytes = *out.bytes;
      const Bytes before = bytes;
      for (uint32_t k = 1 + random.Below(16); k > 0; --k) {
        bytes[random.Below(static_cast<uint32_t>(bytes.size()))] = static_cast<uint8_t>(random.Next());
      }
      if (bytes == before) continue;
      pair.reader.Receive(out.channel, bytes, pair.now_ns);
      pair.writer.Receive(out.channel, bytes, pair.now_ns);
    }
  }
  pair.Run(500 * kMs);
  for (const int64_t value : pair.TakeAll()) values.push_back(value);
  ASSERT_EQ(values.size(), 100u);
  for (size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i], static_cast<int64_t>(20 * i));
  EXPECT_FALSE(pair.writer.superseded_by());
  EXPECT_GT(pair.reader.statistics().dropped_bad + pair.writer.statistics().dropped_bad, 10000);

  for (int i = 0; i < 20000; ++i) {  // with the right sum: nothing can be promised but that all stand
    const Outgoing& out = heard[random.Below(static_cast<uint32_t>(heard.size()))];
    Bytes bytes = *out.bytes;
    for (uint32_t k = 1 + random.Below(6); k > 0; --k) {
      const size_t at = 8 + random.Below(static_cast<uint32_t>(bytes.size() - 8));
      for (size_t b = at; b < std::min(at + 1 + random.Below(8), bytes.size()); ++b) {
        bytes[b] = static_cast<uint8_t>(random.Below(3) == 0 ? 0xff : random.Next());
      }
    }
    if (out.channel == PartChannel("TEST")) continue;
    Seal(*ParseHeader(bytes), out.channel, bytes);
    pair.reader.Receive(out.channel, bytes, pair.now_ns);
    pair.writer.Receive(out.channel, bytes, pair.now_ns);
    if (i % 10 == 0) {
      pair.Run(kMs);
      while (pair.reader.Take()) {
      }
    }
  }
}

TEST(Codec, CountsAndLengthsThatDoNotFitAreRefused) {
  ack_t ack{};
  ack.header.session = 1;
  ack.role = "r";
  ack.num_missing = 2;
  ack.missing_first_seq = ack.missing_last_seq = {1, 2};
  ack.missing_first_byte = ack.missing_end_byte = {0, 0};
  const Outgoing sealed = SealedMessage("A", ack);
  ASSERT_TRUE(DecodeAck("A", *sealed.bytes));
  EXPECT_FALSE(DecodeAck("B", *sealed.bytes));
  for (const int32_t count : {-1, 3, 33, 1 << 29, INT32_MAX, INT32_MIN}) {
    Bytes bytes = *sealed.bytes;
    PutInt(count, kHeaderOffset + kHeaderBytes, bytes);
    Seal(*ParseHeader(bytes), "A", bytes);
    EXPECT_FALSE(DecodeAck("A", bytes)) << count;
  }
}

/// Of a record's and of every message of the protocol: it is a checksum like any other.
TEST(Codec, AChecksumOfZeroIsRefused) {
  const auto without_checksum = [](Bytes bytes) {
    Seal(*ParseHeader(bytes), "A", bytes);
    EXPECT_TRUE(IsIntact("A", bytes));
    PutInt(int32_t{0}, kHeaderOffset + kHeaderBytes - 4, bytes);
    EXPECT_EQ(ParseHeader(bytes)->crc32c, 0);
    return bytes;
  };
  ack_t ack{};
  ack.role = "r";
  head_t head{};
  head.name = "w";
  take_over_t request{};
  request.name = "n";
  const Bytes record = MakeRecord(1), of_ack = *SealedMessage("A", ack).bytes;
  EXPECT_FALSE(IsIntact("A", without_checksum(record)));
  EXPECT_FALSE(DecodeAck("A", without_checksum(of_ack)));
  EXPECT_FALSE(DecodeHead("A", without_checksum(*SealedMessage("A", head).bytes)));
  EXPECT_FALSE(DecodeTakeOver("A", without_checksum(*SealedMessage("A", request).bytes)));
  ASSERT_TRUE(DecodeAck("A", of_ack)) << "with one it is sound";
}

TEST(Codec, NoBytesWhateverMakeTheDecodersThrowOrAccept) {
  Random random(3);
  ack_t ack{};
  ack.role = "role";
  head_t head{};
  part_t part{};
  part.seq = 1;
  part.num_bytes = part.total_bytes = 20;
  part.data.resize(20);
  const std::vector<Bytes> valid = {*SealedMessage("A", ack).bytes, *SealedMessage("A", head).bytes,
                                    EncodePart(part)};
  ASSERT_TRUE(DecodePart(valid[2]));
  for (int i = 0; i < 30000; ++i) {
    Bytes bytes = valid[random.Below(3)];
    const Bytes before = bytes;
    for (uint32_t n = 1 + random.Below(16); n > 0; --n) {
      bytes[random.Below(static_cast<uint32_t>(bytes.size()))] = static_cast<uint8_t>(random.Next());
    }
    if (random.Below(4) == 0) bytes.resize(random.Below(static_cast<uint32_t>(bytes.size())));
    if (bytes == before) continue;
    if (bytes.size() > kHeaderOffset + kHeaderBytes && random.Below(2) == 0) {  // past the checksum as well
      Seal(*ParseHeader(bytes), "A", bytes);
      DecodeAck("A", bytes);
      DecodeHead("A", bytes);
    } else {
      EXPECT_FALSE(DecodeAck("A", bytes) || DecodeHead("A", bytes) || DecodePart(bytes));
    }
  }
}

}  // namespace
}  // namespace dmslam
