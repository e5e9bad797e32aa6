// Both ends of a stream under a script of beacons, records, parts and acknowledgements of any content, but
// sound checksums: nothing may crash, records come out in order and once, and what is kept stays within its
// bound.
#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/messaging/stream_writer.h"
#include "fuzz_target.h"

namespace dmslam::fuzz {
namespace {

constexpr char kOwner[] = "TEST";
constexpr char kRecordChannel[] = "DMSLAM_TEST_RECORD";

/// Takes numbers off the input; zeros when it is used up.
class Script {
 public:
  Script(const uint8_t* data, size_t size) : data_(data), left_(size) {}
  bool empty() const { return left_ == 0; }
  uint8_t Byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  /// Mostly small, sometimes anything.
  int64_t Number() {
    const uint8_t kind = Byte();
    if (kind < 192) return kind % 32;
    uint64_t value = 0;
    for (int i = 0; i < 8; ++i) value = value << 8 | Byte();
    return static_cast<int64_t>(kind < 240 ? value >> 40 : value);
  }
  int32_t Number32() { return static_cast<int32_t>(Number()); }

 private:
  const uint8_t* data_;
  size_t left_;
};

RecordHeader TakeHeader(Script& script) {
  RecordHeader header{};
  header.session = script.Byte() == 255 ? script.Number() : 1;
  header.stream = script.Byte() == 255 ? script.Number32() : static_cast<int32_t>(StreamId::kTest);
  header.flags = script.Byte() % 8;
  header.epoch = 1 + script.Number();
  header.writer = 1 + script.Byte() % 2;
  header.seq = script.Number();
  header.parent_epoch = script.Number();
  header.parent_seq = script.Number();
  return header;
}

Outgoing TakeHead(Script& script) {
  head_t head{};
  head.header = TakeHeader(script);
  head.protocol_version = script.Byte() == 255 ? script.Number32() : kProtocolVersion;
  head.state = script.Byte() % 5;
  head.first_seq = script.Number();
  head.snapshots = script.Number32();
  head.snapshot_total = script.Number32();
  head.snapshot_cut = script.Number();
  head.snapshot_first = script.Number();
  head.snapshot_last = script.Number();
  head.offers = script.Byte() % 4;
  return SealedMessage(HeadChannel(kOwner), head);
}

Outgoing TakeAck(Script& script) {
  ack_t ack{};
  ack.header = TakeHeader(script);
  ack.utime = script.Number();
  ack.protocol_version = script.Byte() == 255 ? script.Number32() : kProtocolVersion;
  ack.reader = 1 + script.Byte() % 3;
  ack.received = script.Number();
  ack.wants = script.Byte() % 4;
  ack.num_missing = script.Byte() % 34;
  for (int32_t i = 0; i < ack.num_missing; ++i) {
    ack.missing_first_seq.push_back(script.Number());
    ack.missing_last_seq.push_back(script.Number());
    ack.missing_first_byte.push_back(script.Number32());
    ack.missing_end_byte.push_back(script.Number32());
  }
  ack.role = script.Byte() % 2 == 0 ? "reader" : "viewer";
  return SealedMessage(AckChannel("READER"), ack);
}

Bytes TakePart(Script& script) {
  part_t part{};
  part.stream_key = StreamKey(1, StreamId::kTest, {1 + script.Byte() % 4, 1}, script.Byte() % 2);
  part.seq = script.Number();
  part.total_bytes = script.Number32();
  part.offset = script.Number32();
  part.num_bytes = script.Byte();
  part.data.assign(static_cast<size_t>(part.num_bytes), 'D');
  return EncodePart(part);
}

Bytes TakeRecord(Script& script) {
  const RecordHeader header = TakeHeader(script);
  Bytes bytes(kHeaderOffset + kHeaderBytes + script.Byte());
  Seal(header, kRecordChannel, bytes);
  return bytes;
}

/// A reader and a writer that know nothing of each other.
class Ends {
 public:
  void Step(Script& script) {
    switch (script.Byte() % 8) {
      case 0:
        return Tell(reader_, TakeHead(script));
      case 1:
        return Tell(reader_, kRecordChannel, TakeRecord(script));
      case 2:
        return Tell(reader_, PartChannel(kOwner), TakePart(script));
      case 3:
        return Tell(writer_, TakeAck(script));
      case 4:
        return Tell(writer_, TakeHead(script));
      case 5:
        return Publish(script.Byte());
      case 6:
        return Pass(script.Number());
      default:
        return TakeRecords();
    }
  }

 private:
  static StreamReader::Options ReaderOptions() {
    StreamReader::Options options;
    options.owner = kOwner;
    options.reader = "READER";
    options.role = "reader";
    options.id = 7;
    options.limits = {.records_ahead = 64, .bytes = 1U << 16, .record_bytes = 1U << 14};
    return options;
  }
  static StreamWriter::Options WriterOptions() {
    StreamWriter::Options options;
    options.owner = kOwner;
    options.roles = {{"reader", true}};
    options.max_records = 32;
    options.max_bytes = 1U << 16;
    return options;
  }

  void Tell(StateMachine& machine, const std::string& channel, const Bytes& bytes) {
    machine.Receive(channel, bytes, now_ns_);
    Drain();
  }
  void Tell(StateMachine& machine, const Outgoing& message) {
    Tell(machine, message.channel, *message.bytes);
  }
  void Publish(uint8_t extra_bytes) {
    if (writer_.Full() || writer_.closed() || writer_.superseded_by()) return;
    writer_.Publish(kRecordChannel, Bytes(kHeaderOffset + kHeaderBytes + extra_bytes), now_ns_);
    Drain();
  }
  void Pass(int64_t milliseconds) {
    now_ns_ += std::clamp<int64_t>(milliseconds, 0, 10'000) * 1'000'000;
    reader_.Advance(now_ns_);
    writer_.Advance(now_ns_);
    Drain();
  }
  void TakeRecords() {
    while (const std::optional<Record> record = reader_.Take()) {
      const RecordHeader& header = record->header;
      const bool follows = last_ && last_->epoch == header.epoch && last_->writer == header.writer &&
                           !last_->in_snapshot && !record->in_snapshot();
      Require(!follows || header.seq > last_->seq, "records of a term come in order and once");
      last_ = Last{header.epoch, header.writer, header.seq, record->in_snapshot()};
      reader_.Accept(record->version());
    }
    Drain();
  }
  void Drain() {
    for (StateMachine* machine :
         {static_cast<StateMachine*>(&reader_), static_cast<StateMachine*>(&writer_)}) {
      Require(machine->TakeOutgoing().size() < 1000, "few messages answer one");
    }
    // Twice, for the stream and its snapshot; the next record in order finds room in any case.
    Require(reader_.statistics().kept_bytes <= 2 * ((1U << 16) + (1U << 14)),
            "the reader keeps within its bound");
    Require(writer_.statistics().kept_bytes <= (1U << 16) + 4096, "the writer keeps within its bound");
  }

  struct Last {
    int64_t epoch, writer, seq;
    bool in_snapshot;
  };
  int64_t now_ns_ = 1;
  StreamReader reader_{ReaderOptions()};
  StreamWriter writer_{WriterOptions(), Term{5, 1}, Version{}};
  std::optional<Last> last_;
};

}  // namespace
}  // namespace dmslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  dmslam::fuzz::Script script(data, std::min<size_t>(size, 1U << 14));
  dmslam::fuzz::Ends ends;
  while (!script.empty()) ends.Step(script);
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  std::vector<std::vector<uint8_t>> seeds;
  for (uint8_t salt = 0; salt < 8; ++salt) {
    std::vector<uint8_t> seed;
    for (uint8_t step = 0; step < 60; ++step) {
      // Session and stream are right, flags zero, epoch 1, writer 1, seq and the rest small and growing.
      const auto number = static_cast<uint8_t>(step / 4);
      const std::vector<uint8_t> head = {0, 0, 0, 0, 0, 0, number, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0};
      const std::vector<uint8_t> record = {1, 0, 0, 0, 0, 0, number, 0, 0, 20};
      const std::vector<uint8_t> part = {2, 0, 0, number, 100, static_cast<uint8_t>(step % 3), 60};
      const std::vector<uint8_t> ack = {3, 0, 0,      0, 4, 0,      number, 0, 0, step,
                                        0, 0, number, 0, 1, number, number, 0, 0, 0};
      const std::vector<std::vector<uint8_t>> steps = {head, record, part, ack, {5, 30}, {6, 31}, {7}};
      const std::vector<uint8_t>& next = steps[(step * (salt + 1U) + salt) % steps.size()];
      seed.insert(seed.end(), next.begin(), next.end());
    }
    seeds.push_back(std::move(seed));
  }
  return seeds;
}

}  // namespace dmslam::fuzz
