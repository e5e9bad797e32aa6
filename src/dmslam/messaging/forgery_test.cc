// One forged message each, with the right checksum: nobody is ended, hung or deafened by it. Whoever keeps
// sending can still forge anything where the bus has no key (keyed_bus.h).

#include <gtest/gtest.h>

#include <functional>

#include "dmslam/messaging/believed_terms.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/election.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/messaging/stream_writer.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kHourUs = 3'600'000'000;
constexpr int64_t kWall = 1'700'000'000'000'000;

Bytes MakeRecord(int64_t value) {
  replica_t message{};
  message.holder = value;
  message.role = "x";
  return Encode(message);
}

/// A writer and a reader on one wire, and somebody who hears both and can send.
struct Wire {
  StreamWriter writer;
  StreamReader reader;
  int64_t now_ns = 0;
  int64_t next_value = 0;
  std::vector<int64_t> taken;
  std::optional<head_t> head;
  std::optional<ack_t> ack;

  Wire() : Wire(0, 1000, 0) {}
  /// The writer's host has the wall clock `writer_us` at the beginning [us since 1970], the reader's another.
  Wire(int64_t writer_us, int64_t epoch, int64_t reader_us)
      : writer(WriterOptions(writer_us), Term{epoch, 5}, Version{}), reader(ReaderOptions(reader_us)) {
    Run(1000);
  }

  static StreamWriter::Options WriterOptions(int64_t wall_us = 0) {
    StreamWriter::Options options;
    options.clock_offset_us = wall_us;
    options.owner = "TEST";
    options.name = "writer";
    options.roles = {{"reader", true}};
    return options;
  }
  static StreamReader::Options ReaderOptions(int64_t wall_us = 0) {
    StreamReader::Options options;
    options.clock_offset_us = wall_us;
    options.owner = "TEST";
    options.reader = "READER";
    options.role = "reader";
    options.name = "reader 1";
    options.id = 1;
    return options;
  }

  void Run(int64_t ms, bool publish = true) {
    for (int64_t i = 0; i < ms; ++i, now_ns += kMs) {
      if (publish && i % 20 == 0) writer.Publish("DMSLAM_TEST_X", MakeRecord(next_value++), now_ns);
      writer.Advance(now_ns);
      for (const Outgoing& out : writer.TakeOutgoing()) Deliver(out);
      reader.Advance(now_ns);
      for (const Outgoing& out : reader.TakeOutgoing()) Deliver(out);
      TakeAll();
      reader.AcceptTaken();
    }
  }
  /// A value below zero is grave.
  void TakeAll() {
    while (const std::optional<Record> record = reader.Take()) {
      const int64_t value = DecodeReplica(record->channel, *record->bytes)->holder;
      if (value < 0 && reader.Doubt(*record, now_ns)) return;
      taken.push_back(value);
    }
  }
  void ForgeRecord(int64_t seq, int64_t value) {
    RecordHeader header = head->header;
    header.seq = seq;
    Bytes bytes = MakeRecord(value);
    Seal(header, "DMSLAM_TEST_X", bytes);
    Deliver({"DMSLAM_TEST_X", std::make_shared<const Bytes>(bytes), false});
    TakeAll();
  }
  void Deliver(const Outgoing& out) {
    if (out.channel == HeadChannel("TEST")) head = DecodeHead(out.channel, *out.bytes);
    if (out.channel == AckChannel("READER")) ack = DecodeAck(out.channel, *out.bytes);
    reader.Receive(out.channel, *out.bytes, now_ns);
    writer.Receive(out.channel, *out.bytes, now_ns);
  }
  void ForgeHead(const std::function<void(head_t&)>& change) {
    head_t forged = *head;
    forged.utime = now_ns / 1000;
    change(forged);
    Deliver(SealedMessage(HeadChannel("TEST"), forged));
  }
  /// Beacons and acknowledgements of a term, so many times in a row, as one who keeps speaking.
  void ForgeTerm(int64_t epoch, int times) {
    for (int i = 0; i < times; ++i) {
      ForgeHead([&](head_t& forged) { forged.header.epoch = epoch; });
      ForgeAck([&](ack_t& forged) { forged.header.epoch = epoch; });
      Run(20);
    }
  }
  void ForgeAck(const std::function<void(ack_t&)>& change) {
    ack_t forged = *ack;
    forged.utime = now_ns / 1000;
    change(forged);
    Deliver(SealedMessage(AckChannel("READER"), forged));
  }
  /// Everything goes on, and the end is heard.
  void ExpectUnharmed() {
    Run(3000);
    Run(100, false);
    EXPECT_FALSE(writer.superseded_by());
    EXPECT_FALSE(writer.close_requested_by());
    EXPECT_FALSE(writer.newer_replica());
    EXPECT_FALSE(reader.AtEnd());
    EXPECT_EQ(reader.state(), StreamReader::State::kFollowing);
    EXPECT_EQ(reader.backlog(), 0);
    EXPECT_EQ(reader.statistics().lost, 0);
    EXPECT_EQ(writer.Backlog("reader"), 0);
    writer.Complete(now_ns);
    Run(3000, false);
    EXPECT_TRUE(writer.completed());
    EXPECT_TRUE(reader.AtEnd());
    ASSERT_EQ(taken.size(), static_cast<size_t>(next_value));
    for (size_t i = 0; i < taken.size(); ++i) ASSERT_EQ(taken[i], static_cast<int64_t>(i));
  }
  int64_t doubtful() const {
    return reader.statistics().dropped_doubtful + writer.statistics().dropped_doubtful;
  }
};

TEST(Forgery, AHeadWithAHigherEpoch) {
  Wire wire;
  wire.ForgeHead([](head_t& forged) { forged.header.epoch += kHourUs; });
  EXPECT_EQ(wire.doubtful(), 2) << "refused, and counted by both";
  wire.ExpectUnharmed();
}

TEST(Forgery, AHeadWithAHigherEpochBeforeAnyOtherIsHeard) {
  Wire wire;
  wire.reader = StreamReader(Wire::ReaderOptions());
  wire.taken.clear();
  head_t forged = *wire.head;
  forged.header.epoch += kHourUs;
  wire.reader.Receive(HeadChannel("TEST"), *SealedMessage(HeadChannel("TEST"), forged).bytes, wire.now_ns);
  wire.Run(2000);
  EXPECT_EQ(wire.reader.term(), wire.writer.term());
}

/// `before`: how many of the writer's own beacons a reader that has just begun heard before the forged one.
void ForgeTheFuture(int before) {
  Wire wire;
  wire.reader = StreamReader(Wire::ReaderOptions());
  wire.taken.clear();
  for (int heard = 0; heard < before; ++heard) {
    wire.head->utime = wire.now_ns / 1000 + heard;
    wire.reader.Receive(HeadChannel("TEST"), *SealedMessage(HeadChannel("TEST"), *wire.head).bytes,
                        wire.now_ns);
  }
  wire.ForgeHead([](head_t& forged) { forged.utime += kHourUs; });
  wire.Run(2000);
  EXPECT_EQ(wire.reader.term(), wire.writer.term());
  wire.ForgeHead([](head_t& forged) { ++forged.utime; });
  wire.Run(3000);
  wire.Run(100, false);
  EXPECT_EQ(wire.reader.backlog(), 0);
  EXPECT_EQ(wire.writer.Backlog("reader"), 0);
  wire.writer.Complete(wire.now_ns);
  wire.Run(3000, false);
  EXPECT_TRUE(wire.reader.AtEnd()) << "the writer's own beacons count again";
}

TEST(Forgery, AHeadFromTheFutureBeforeAnyOtherIsHeard) { ForgeTheFuture(0); }
TEST(Forgery, AHeadFromTheFutureThatIsTheSecondOneHeard) { ForgeTheFuture(1); }

/// Believed, such a term would leave none for whoever comes next.
TEST(Forgery, TwoHeadsOfAFarTermExhaustNothing) {
  for (const int64_t far : {kMaxEpoch - 1, kWall + 11 * kYearUs}) {
    for (const int64_t reader_us : {kWall, kWall - kHourUs, int64_t{0}}) {  // 0: a clock that was never set
      for (const int64_t writer_us : {kWall, int64_t{0}}) {
        Wire wire(writer_us, kWall, reader_us);
        wire.ForgeTerm(far, 3);
        EXPECT_EQ(wire.reader.term(), wire.writer.term()) << far << " " << reader_us << " " << writer_us;
        EXPECT_GE(wire.reader.statistics().dropped_doubtful, 3);
        EXPECT_GE(wire.writer.statistics().dropped_doubtful, 6) << "heads and acknowledgements";
        wire.ExpectUnharmed();
      }
    }
  }
}

/// A writer whose clock is years ahead is a writer; and no chain of leaps leads beyond that.
TEST(Forgery, ATermWithinTenYearsIsFollowedAndNoneBeyondIt) {
  Wire wire(kWall, kWall, kWall);
  wire.ForgeTerm(kWall + 9 * kYearUs, 2);
  EXPECT_TRUE(wire.writer.superseded_by());
  EXPECT_EQ(wire.reader.term().epoch, kWall + 9 * kYearUs);
  wire.ForgeTerm(kWall + 18 * kYearUs, 3);
  EXPECT_EQ(wire.reader.term().epoch, kWall + 9 * kYearUs);
}

TEST(Forgery, AHostWhoseClockWasNeverSetFollowsTheFirstTermOfNow) {
  const Wire wire(kWall, kWall, 0);
  EXPECT_EQ(wire.reader.term(), (Term{kWall, 5}));
  EXPECT_EQ(wire.reader.state(), StreamReader::State::kFollowing);
}

TEST(Forgery, AHeadThatSaysTheStreamIsClosed) {
  Wire wire;
  wire.ForgeHead([](head_t& forged) { forged.state = head_t::STATE_CLOSED; });
  EXPECT_FALSE(wire.reader.AtEnd());
  wire.ExpectUnharmed();
}

TEST(Forgery, AHeadFromTheFuture) {
  Wire wire;
  wire.ForgeHead([](head_t& forged) { forged.utime += kHourUs; });
  wire.ExpectUnharmed();
}

TEST(Forgery, AHeadThatCountsTooFar) {
  for (const int64_t more : {int64_t{3}, int64_t{3000}, int64_t{1} << 40}) {
    Wire wire;
    wire.ForgeHead([&](head_t& forged) { forged.header.seq += more; });
    EXPECT_LE(wire.reader.backlog(), 3000);
    wire.Run(1000, false);
    EXPECT_EQ(wire.reader.backlog(), 0) << more;
    wire.ExpectUnharmed();
  }
}

TEST(Forgery, AHeadThatSaysRecordsAreGone) {
  Wire wire;
  wire.ForgeHead([](head_t& forged) { forged.first_seq = forged.header.seq += 1000; });
  wire.ExpectUnharmed();
}

TEST(Forgery, AHeadOfAnotherVersion) {
  Wire wire;
  wire.ForgeHead([](head_t& forged) { forged.protocol_version += 1; });
  wire.ExpectUnharmed();
}

TEST(Forgery, ARequestToTakeOver) {
  Wire wire;
  take_over_t forged{};
  forged.header = wire.head->header;
  forged.successor = 99;
  forged.name = "nobody";
  for (int copy = 0; copy < 3; ++copy) wire.Deliver(SealedMessage(TakeOverChannel("TEST"), forged));
  wire.ExpectUnharmed();
}

/// Five within a tenth of a second, and again every two seconds.
TEST(Forgery, RequestsToTakeOverInARow) {
  Wire wire;
  take_over_t forged{};
  forged.header = wire.head->header;
  forged.successor = 99;
  forged.name = "nobody";
  for (int row = 0; row < 3; ++row) {
    for (int i = 0; i < 5; ++i) {
      forged.utime = wire.now_ns / 1000;
      wire.Deliver(SealedMessage(TakeOverChannel("TEST"), forged));
      wire.Run(20);
    }
    wire.Run(1900);
  }
  wire.ExpectUnharmed();
}

TEST(Forgery, AnAckFromTheFuture) {
  Wire wire;
  wire.ForgeAck([](ack_t& forged) { forged.utime += kHourUs; });
  wire.ExpectUnharmed();
}

TEST(Forgery, AnAckOfWhatWasNotWritten) {
  Wire wire;
  wire.ForgeAck([](ack_t& forged) { forged.header.seq += 1000; });
  wire.Run(1, true);
  EXPECT_FALSE(wire.writer.AcknowledgedByAny(wire.writer.last_seq() + 1));
  wire.ExpectUnharmed();
}

TEST(Forgery, AnAckOfAHigherTermOrANewerVersion) {
  Wire wire;
  wire.ForgeAck([](ack_t& forged) { forged.header.epoch += kHourUs; });
  wire.ForgeAck([](ack_t& forged) { forged.header.parent_epoch = 999; });
  wire.ExpectUnharmed();
}

TEST(Forgery, ARecordWithALeapInItsNumber) {
  for (const int64_t more : {int64_t{3}, int64_t{3000}, int64_t{1} << 40}) {
    Wire wire;
    wire.ForgeRecord(wire.writer.last_seq() + more, 77);
    wire.Run(1000, false);
    EXPECT_EQ(wire.reader.backlog(), 0) << more;
    wire.ExpectUnharmed();
  }
}

/// Who goes on is not kept from it by one that is doubted, nor by copies of that on their way.
TEST(Forgery, AGraveRecordInThePlaceOfTheNext) {
  for (const int64_t later_ms : {1, 300}) {
    Wire wire;
    const int64_t seq = wire.writer.last_seq() + 1;
    for (const int64_t copy_ms : {0, 20, 60}) {
      wire.ForgeRecord(seq, -1);
      wire.Run(copy_ms, false);
    }
    wire.Run(later_ms, false);
    wire.ExpectUnharmed();
  }
}

/// What was held before is held again.
TEST(Forgery, AGraveRecordInThePlaceOfTheFirst) {
  Wire wire;
  const Version before = wire.reader.held();
  wire.writer = StreamWriter(Wire::WriterOptions(), Term{2000, 6}, Version{});
  wire.writer.Advance(wire.now_ns);
  for (const Outgoing& out : wire.writer.TakeOutgoing()) wire.Deliver(out);
  wire.Run(200, false);
  ASSERT_EQ(wire.reader.term().epoch, 2000);
  wire.taken.clear();
  wire.next_value = 0;
  wire.ForgeRecord(1, -1);
  EXPECT_EQ(wire.reader.held(), before);
  wire.ExpectUnharmed();
}

TEST(Forgery, AGraveRecordThatItsWriterSaysAgainIsBelieved) {
  Wire wire;
  wire.writer.Publish("DMSLAM_TEST_X", MakeRecord(-1), wire.now_ns);
  wire.Run(50, false);
  EXPECT_NE(wire.taken.back(), -1);
  wire.Run(450, false);
  EXPECT_EQ(wire.taken.back(), -1);
  EXPECT_EQ(wire.writer.Backlog("reader"), 0);
}

TEST(Forgery, AClockThatHasLeaptInEarnestIsBelieved) {
  Wire wire;
  wire.now_ns += 7200 * 1000 * kMs;  // both have been asleep, the writer's clock has not
  wire.ExpectUnharmed();
}

WriterElection::Options Newcomer() {
  WriterElection::Options options;
  options.owner = "TEST";
  options.name = "newcomer";
  options.writer = 9;
  return options;
}

head_t LiveHead(int64_t epoch) {
  head_t head{};
  head.header.session = 1;
  head.header.stream = static_cast<int32_t>(StreamId::kTest);
  head.header.epoch = epoch;
  head.header.writer = 4;
  head.protocol_version = kProtocolVersion;
  head.state = head_t::STATE_LIVE;
  return head;
}

void Hear(WriterElection* election, head_t head, int64_t now_ns) {
  head.utime = now_ns / 1000;
  election->Receive(HeadChannel("TEST"), *SealedMessage(HeadChannel("TEST"), head).bytes, now_ns);
}

TEST(Forgery, AHeadWithAHigherEpochHidesNoWriterFromANewcomer) {
  WriterElection election(Newcomer(), 0);
  Hear(&election, LiveHead(1000 + kHourUs), 0);
  Hear(&election, LiveHead(1000), 100 * kMs);
  Hear(&election, LiveHead(1000), 200 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kRefused);
}

TEST(Forgery, AnEpochFarInTheFutureExhaustsNothing) {
  WriterElection election(Newcomer(), 0);
  Hear(&election, LiveHead(kMaxEpoch - 1), 0);
  election.Advance(3000 * kMs);
  EXPECT_EQ(election.Win(5000).epoch, 5000);
}

TEST(Forgery, AnEpochFarInTheFutureThatIsSaidAgainExhaustsNothing) {
  for (const int64_t clock_us : {kWall, int64_t{0}}) {
    WriterElection::Options options = Newcomer();
    options.clock_offset_us = clock_us;
    WriterElection election(options, 0);
    for (int64_t i = 0; i < 3; ++i) Hear(&election, LiveHead(kMaxEpoch - 1), i * 100 * kMs);
    for (int64_t i = 0; i < 3; ++i) {
      ack_t ack{};
      ack.utime = 1 + i;
      ack.header.session = 1;
      ack.header.stream = static_cast<int32_t>(StreamId::kTest);
      ack.header.epoch = kMaxEpoch - 1;
      const Outgoing sealed = SealedMessage(AckChannel("READER"), ack);
      election.Receive(sealed.channel, *sealed.bytes, i * 100 * kMs);
    }
    election.Advance(3000 * kMs);
    ASSERT_EQ(election.state(), WriterElection::State::kWon) << "nobody believable writes";
    EXPECT_EQ(election.Win(clock_us + 5000).epoch, clock_us + 5000);
  }
}

TEST(Terms, NeverGoBackWhateverTheClock) {
  WriterElection election(Newcomer(), 0);
  ack_t ack{};  // of a reader that follows nobody alive, and holds what an earlier one wrote
  ack.header.session = 1;
  ack.header.stream = static_cast<int32_t>(StreamId::kTest);
  ack.header.epoch = kWall;
  ack.header.parent_epoch = kWall - 77;
  ack.header.seq = 3;
  const Outgoing sealed = SealedMessage(AckChannel("READER"), ack);
  election.Receive(sealed.channel, *sealed.bytes, 0);
  election.Advance(3000 * kMs);
  EXPECT_EQ(election.Win(kWall - kHourUs).epoch, kWall + 1) << "a host whose clock is an hour behind";
  EXPECT_EQ(election.Win(kWall - kHourUs, kWall + 5).epoch, kWall + 6) << "a replica names a later one";
  EXPECT_EQ(election.Win(kWall + kHourUs).epoch, kWall + kHourUs);
}

}  // namespace
}  // namespace dmslam
