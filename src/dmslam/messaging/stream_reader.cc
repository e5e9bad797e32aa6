#include "dmslam/messaging/stream_reader.h"

#include <algorithm>
#include <utility>

#include "dmslam/ack_t.hpp"
#include "dmslam/messaging/believed_terms.h"
#include "dmslam/messaging/claims.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/part_t.hpp"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kMaxTimed = 1000;              // records whose recovery is timed
constexpr int64_t kMaxBurst = 4096;             // records behind the last beacon that can be
constexpr int64_t kMinNsPerRecord = 50'000;     // no writer is faster for long
constexpr int kBelieved = 2;                    // beacons
constexpr int64_t kRefusedAckNs = 100'000'000;  // who holds more than the writer knows says so soon
constexpr int64_t kOnlyOneNs = 5'000'000'000;   // a writer that is there says so more often than that
constexpr size_t kMaxRangesNamed = 32;  // ranges named in one acknowledgement: it must fit one datagram

Version ParentOf(const head_t& head) { return {head.header.parent_epoch, head.header.parent_seq}; }

std::string ToText(const Version& version) {
  return std::to_string(version.epoch) + ":" + std::to_string(version.seq);
}

}  // namespace

StreamReader::StreamReader(Options options)
    : options_(std::move(options)),
      versions_(options_.start.value_or(Version())),
      window_(options_.limits),
      first_epoch_(held().epoch) {
  DMSLAM_CHECK(options_.id != 0, "a reader needs an id");
}

// ---- what comes in

void StreamReader::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  const std::optional<int64_t> type = FingerprintOf(bytes);
  if (type == head_t::getHash()) {
    if (channel == HeadChannel(options_.owner)) ReceiveHead(channel, bytes, now_ns);
  } else if (type == part_t::getHash()) {
    if (channel == PartChannel(options_.owner)) ReceivePart(bytes, now_ns);
  } else if (type != ack_t::getHash()) {
    ReceiveRecord(channel, bytes, now_ns);
  }
}

void StreamReader::ReceiveHead(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  const std::optional<head_t> head = DecodeHead(channel, bytes);
  if (!head) {
    ++statistics_.dropped_bad;
    return;
  }
  if (head->header.stream != static_cast<int32_t>(options_.stream)) return;
  if (head->header.session != options_.session) {
    ++statistics_.dropped_foreign;
    return;
  }
  if (!IsWanted(*head, now_ns)) return;
  const Term term{head->header.epoch, head->header.writer};
  if (term == term_ && !IsPlausible(*head, now_ns)) return;
  if (!SpeaksOurLanguage(*head)) return;
  beacons_.last_utime = head->utime;
  beacons_.last_ns = now_ns;
  if (term == term_ && state_ == State::kRefusedVersion) term_ = {};
  if (term > term_) BeginTerm(*head);
  beacons_.last_seq = head->header.seq;
  NoteEnd(*head);
  Follow(*head);
}

/// Of the term that is followed, or of one that is to be followed from now on.
bool StreamReader::IsWanted(const head_t& head, int64_t now_ns) {
  const Term term{head.header.epoch, head.header.writer};
  const bool of_ours = options_.only_writer == 0 || term.writer == options_.only_writer;
  const bool is_over = term.epoch < held().epoch && term != term_ && !IsOnlyOneLeft(term, now_ns);
  if (!of_ours || !term.valid() || is_over || term < term_) return false;
  if (term != term_ && LeapsTooFar(term, now_ns)) {
    ++statistics_.dropped_doubtful;
    return false;
  }
  if (term == term_ || options_.only_writer != 0) return true;
  if (terms_.SaidAgain(term, head.utime)) return true;
  statistics_.dropped_doubtful += term_.valid() ? 1 : 0;
  return false;
}

bool StreamReader::LeapsTooFar(const Term& term, int64_t now_ns) const {
  const int64_t newest = std::max(term_.epoch, held().epoch);
  return term.epoch > LatestBelievedEpoch(options_.clock_offset_us + now_ns / 1000, first_epoch_, newest);
}

/// Since this reader began nobody has been heard for a while but a writer of an earlier term than it held
/// then: all died, and began again on a clock that is behind.
bool StreamReader::IsOnlyOneLeft(const Term& term, int64_t now_ns) {
  if (term_.valid()) return false;
  if (!(only_one_ == term)) only_one_ = term, only_one_since_ns_ = now_ns;
  return now_ns - only_one_since_ns_ > kOnlyOneNs;
}

/// A beacon's time and number follow from those of the one before; where they have leapt in earnest, the next
/// beacon says so too.
bool StreamReader::IsPlausible(const head_t& head, int64_t now_ns) {
  const int64_t elapsed_ns = now_ns - beacons_.last_ns;
  const bool in_time = head.utime <= beacons_.last_utime + elapsed_ns / 1000 + kTimeToleranceUs &&
                       head.utime >= beacons_.last_utime - kTimeToleranceUs;
  const bool in_number = head.header.seq <= beacons_.last_seq + kMaxBurst + elapsed_ns / kMinNsPerRecord;
  const bool same_language = state_ == State::kRefusedVersion || (head.protocol_version == kProtocolVersion &&
                                                                  head.schema_hash == options_.schema_hash);
  if (in_time && in_number && same_language) {
    if (head.utime < beacons_.last_utime) return false;  // late
    leaps_.Clear();
    return true;
  }
  ++statistics_.dropped_doubtful;
  return same_language && leaps_.SaidAgain(term_, head.utime);
}

/// A stream that is handed over goes on in the next term.
void StreamReader::NoteEnd(const head_t& head) {
  const bool hands_over = (head.offers & head_t::OFFERS_SUCCESSOR) != 0;
  const bool ends = head.state == head_t::STATE_CLOSED && !hands_over;
  beacons_.closed = ends ? beacons_.closed + 1 : 0;
  beacons_.complete = head.state != head_t::STATE_LIVE && !hands_over ? beacons_.complete + 1 : 0;
  writer_closed_ = beacons_.closed >= kBelieved;
}

/// The writer knows best how far it is: what is behind that, beacon after beacon, was never written.
void StreamReader::RetractWhatIsNot() {
  const int64_t newest = std::max(window_.newest(), window_.next() - 1);
  if (newest <= beacons_.last_seq || newest != beacons_.below_of) beacons_.below = 0;
  beacons_.below_of = newest;
  if (newest <= beacons_.last_seq || ++beacons_.below < kBelieved + 1) return;
  ++statistics_.dropped_doubtful;
  beacons_.below = 0;
  window_.Retract(beacons_.last_seq);
  const bool holds_of_it = versions_.taken().epoch == term_.epoch;
  const int64_t next = holds_of_it ? versions_.taken().seq + 1 : 1;
  if (state_ == State::kFollowing && window_.next() > beacons_.last_seq + 1 && next <= beacons_.last_seq + 1)
    window_.Reset(next);
}

bool StreamReader::SpeaksOurLanguage(const head_t& head) {
  if (head.protocol_version == kProtocolVersion && head.schema_hash == options_.schema_hash) return true;
  if (state_ != State::kRefusedVersion) acknowledged_.due = true;
  state_ = State::kRefusedVersion;
  term_ = {head.header.epoch, head.header.writer};
  problem_ =
      "writer " + head.name + " speaks protocol " + std::to_string(head.protocol_version) +
      (head.protocol_version == kProtocolVersion ? " with other message types"
                                                 : " (" + NameOfProtocol(head.protocol_version) + ")") +
      ", this reader protocol " + std::to_string(kProtocolVersion) + " (" + NameOfProtocol(kProtocolVersion) +
      "): run the same build everywhere";
  return false;
}

// ---- terms

void StreamReader::BeginTerm(const head_t& head) {
  const bool fresh = (head.header.flags & RecordHeader::FLAG_FRESH) != 0;
  const bool same_epoch =
      held().epoch == head.header.epoch && term_.epoch < head.header.epoch;  // as we start
  const Version parent = ParentOf(head);
  const Version end = same_epoch ? held() : DrainFormerTerm(parent, fresh);
  const bool nobody_has_it = fresh && (head.offers & head_t::OFFERS_SNAPSHOT) == 0;
  if (nobody_has_it && !same_epoch) DrainBeyondGaps();
  term_ = {head.header.epoch, head.header.writer};
  if (first_epoch_ == 0) first_epoch_ = term_.epoch;
  if (nobody_has_it) CountLostOfFormerTerms();
  parent_ = parent;
  window_.Reset(same_epoch ? held().seq + 1 : 1);
  terms_.Clear();
  leaps_.Clear();
  beacons_.gap_seen = false;
  beacons_.closed = beacons_.complete = 0;
  snapshot_.reset();
  recovery_.missing_since_ns.clear();
  problem_.clear();
  acknowledged_.due = true;
  state_ = State::kFollowing;
  if (same_epoch || fresh || parent == end) return;
  if (end > parent) {
    state_ = State::kRefusedBehind;
    problem_ = "writer " + head.name + " continues version " + ToText(parent) + ", but this reader holds " +
               ToText(end) + " already: let it take over the newest replica, or restart this process";
  } else if ((head.offers & head_t::OFFERS_SNAPSHOT) != 0) {
    NeedSnapshot();
  } else if (!end.empty()) {  // the former writer's last ones: nobody keeps them
    statistics_.lost += end.epoch == parent.epoch ? parent.seq - end.seq : 1;
  }
}

// What arrived of the former term in order and is part of what the new one continues is still handed out.
Version StreamReader::DrainFormerTerm(const Version& parent, bool fresh) {
  if (state_ == State::kFollowing) {
    while (window_.CanTake()) former_.push_back(*window_.Take());
  }
  if (!fresh) {
    while (!former_.empty() && former_.back().version() > parent) former_.pop_back();
  }
  return former_.empty() ? held() : former_.back().version();
}

/// A fresh term that offers no snapshot continues nothing: what of the former one is here is still handed
/// out, gaps or not, since nobody repairs it any more; what is missing is lost.
void StreamReader::DrainBeyondGaps() {
  const Version end = former_.empty() ? held() : former_.back().version();
  if (state_ == State::kFollowing) {
    const int64_t newest = std::max(beacons_.last_seq, window_.newest());
    const int64_t lost = GiveUpAll(newest);
    statistics_.lost += lost;
    statistics_.lost_with_writer += lost;
    while (window_.CanTake()) former_.push_back(*window_.Take());
    Settle({term_.epoch, newest});
  }
  if (!end.empty()) Settle(end);
}

/// How many records of the former term up to `newest` are missing here, and come no more.
int64_t StreamReader::GiveUpAll(int64_t newest) {
  if (!options_.start && held().empty()) window_.GiveUpBefore(window_.oldest().value_or(newest + 1));
  return window_.GiveUpBefore(newest + 1);
}

/// Records up to this one are accounted for.
void StreamReader::Settle(const Version& version) {
  int64_t& settled = written_[version.epoch].settled;
  settled = std::max(settled, version.seq);
}

/// What others have told of terms that are over, and is not here.
void StreamReader::CountLostOfFormerTerms() {
  for (auto& [epoch, written] : written_) {
    if (epoch >= term_.epoch) break;
    const int64_t lost = std::max<int64_t>(0, written.known - written.settled);
    statistics_.lost += lost;
    statistics_.lost_with_writer += lost;
    written.settled += lost;
  }
}

void StreamReader::NoteWritten(const Version& version) {
  const bool before_it_came = first_epoch_ == 0 || version.epoch < first_epoch_;
  if (version.empty() || (before_it_came && !options_.wants_all)) return;
  int64_t& known = written_[version.epoch].known;
  known = std::max(known, version.seq);
  CountLostOfFormerTerms();
}

void StreamReader::NeedSnapshot() {
  state_ = State::kSnapshot;
  snapshot_.emplace(Snapshot{0, 0, 0, ReceiveWindow(options_.limits)});
  acknowledged_.due = true;
}

void StreamReader::Forget() {
  versions_.Forget();
  former_.clear();
  if (!term_.valid() || state_ == State::kRefusedVersion) return;
  problem_.clear();
  NeedSnapshot();
}

void StreamReader::Follow(const head_t& head) {
  if (state_ == State::kSnapshot) {
    FollowSnapshot(head);
    if (snapshot_->number == 0) return;
  } else if (state_ != State::kFollowing) {
    return;
  }
  RetractWhatIsNot();
  window_.Expose(head.header.seq);
  const bool gap = head.first_seq > window_.received() + 1;
  if (gap && !std::exchange(beacons_.gap_seen, true)) return;
  const bool joins = !std::exchange(joined_, true) && held().empty();
  const bool may_hold_it = !options_.start && held().empty();  // nothing has come, and it may need none of it
  const bool is_anothers = (joins || may_hold_it) && !options_.wants_all;  // what was before it came
  beacons_.gap_seen = false;
  if (!gap) return;
  if ((head.offers & head_t::OFFERS_SNAPSHOT) != 0) {
    NeedSnapshot();
    FollowSnapshot(head);
  } else {
    const int64_t given_up = window_.GiveUpBefore(head.first_seq);
    if (!is_anothers) statistics_.lost += given_up;
  }
}

void StreamReader::FollowSnapshot(const head_t& head) {
  if (snapshot_->complete()) return;
  const bool joined = snapshot_->number != 0 && snapshot_->number == head.snapshots;
  if (joined && head.snapshot_first > 0 && head.snapshot_first <= snapshot_->window.received() + 1) {
    snapshot_->window.Expose(head.snapshot_last);
    return;
  }
  snapshot_->number = 0;
  if (joined || head.snapshot_first != 1) return;
  snapshot_->number = head.snapshots;
  snapshot_->cut = head.snapshot_cut;
  snapshot_->last = 0;
  snapshot_->window.Reset(1);
  snapshot_->window.Expose(head.snapshot_last);
  window_.Reset(snapshot_->cut + 1);
  acknowledged_.due = true;
}

// ---- records

int32_t StreamReader::KeyOf(int64_t snapshot) const {
  return StreamKey(options_.session, options_.stream, term_, snapshot);
}

void StreamReader::ReceivePart(std::span<const uint8_t> bytes, int64_t now_ns) {
  const std::optional<part_t> part = DecodePart(bytes);
  if (!part) {
    ++statistics_.dropped_bad;
    return;
  }
  ++statistics_.parts;
  ReceiveWindow* window = nullptr;
  const bool in_snapshot = snapshot_ && snapshot_->number != 0;
  if (in_snapshot && part->stream_key == KeyOf(snapshot_->number)) window = &snapshot_->window;
  if ((state_ == State::kFollowing || in_snapshot) && part->stream_key == KeyOf(0)) window = &window_;
  if (window == nullptr) return;
  if (LeapsAhead(*window, part->seq)) return;
  ReceiveWindow::PartResult result = window->AddPart(*part);
  if (result.result == ReceiveWindow::Result::kDuplicate) ++statistics_.duplicates;
  if (result.result == ReceiveWindow::Result::kNoRoom) ++statistics_.dropped_no_room;
  if (!result.whole) return;
  auto& [channel, message] = *result.whole;
  const std::optional<RecordHeader> header = ParseHeader(message);
  if (!header || header->seq != part->seq || WindowOf(*header) != window || !IsIntact(channel, message)) {
    ++statistics_.dropped_bad;
    return;
  }
  Add(window, channel, std::move(message), *header, now_ns);
}

void StreamReader::ReceiveRecord(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  const std::optional<RecordHeader> header = ParseHeader(bytes);
  if (!header || !IsIntact(channel, bytes)) {
    ++statistics_.dropped_bad;
    return;
  }
  if (header->stream != static_cast<int32_t>(options_.stream)) return;
  if (header->session != options_.session) {
    ++statistics_.dropped_foreign;
    return;
  }
  ReceiveWindow* window = WindowOf(*header);
  if (window == nullptr) return;
  Add(window, channel, Bytes(bytes.begin(), bytes.end()), *header, now_ns);
}

// Where a record belongs: the stream's window or the snapshot's, if it is of the term that is followed.
ReceiveWindow* StreamReader::WindowOf(const RecordHeader& header) {
  if (Term{header.epoch, header.writer} != term_ || header.session != options_.session) return nullptr;
  if (header.seq < 1 || header.seq >= kMaxSeq) return nullptr;
  const bool in_snapshot = snapshot_ && snapshot_->number != 0;
  if ((header.flags & RecordHeader::FLAG_SNAPSHOT) != 0) {
    return in_snapshot && header.parent_epoch == snapshot_->number ? &snapshot_->window : nullptr;
  }
  return state_ == State::kFollowing || in_snapshot ? &window_ : nullptr;
}

/// Further than a writer can be beyond its last beacon.
bool StreamReader::LeapsAhead(const ReceiveWindow& window, int64_t seq) {
  const int64_t known =
      &window == &window_ ? std::max(window.received(), beacons_.last_seq) : window.received();
  if (seq <= known + kMaxBurst) return false;
  ++statistics_.dropped_doubtful;
  return true;
}

void StreamReader::Add(ReceiveWindow* window, const std::string& channel, Bytes bytes,
                       const RecordHeader& header, int64_t now_ns) {
  if (LeapsAhead(*window, header.seq)) return;
  Record record{channel, std::make_shared<const Bytes>(std::move(bytes)), header};
  const ReceiveWindow::Result result = window->Add(record);
  if (result == ReceiveWindow::Result::kDuplicate) ++statistics_.duplicates;
  if (result == ReceiveWindow::Result::kNoRoom) ++statistics_.dropped_no_room;
  if (result != ReceiveWindow::Result::kNew) return;
  if (record.in_snapshot()) {
    acknowledged_.due = true;
    if (record.ends_snapshot()) snapshot_->last = header.seq;
    return;
  }
  NoteArrival(header.seq, now_ns);
}

void StreamReader::NoteMissing(const std::vector<MissingRange>& missing, int64_t now_ns) {
  for (const MissingRange& range : missing) {
    for (int64_t seq = range.first_seq;
         seq <= range.last_seq && recovery_.missing_since_ns.size() < kMaxTimed; ++seq) {
      recovery_.missing_since_ns.emplace(seq, now_ns);
    }
  }
}

void StreamReader::NoteArrival(int64_t seq, int64_t now_ns) {
  const auto missing = recovery_.missing_since_ns.find(seq);
  if (missing == recovery_.missing_since_ns.end()) return;
  ++statistics_.repaired;
  recovery_.took_ms.push_back(static_cast<double>(now_ns - missing->second) * 1e-6);
  if (recovery_.took_ms.size() > kMaxTimed) recovery_.took_ms.pop_front();
  recovery_.missing_since_ns.erase(missing);
}

// ---- what the owner does

std::optional<Record> StreamReader::Take() {
  std::optional<Record> record;
  if (!former_.empty()) {
    record = std::move(former_.front());
    former_.pop_front();
  } else if (state_ == State::kSnapshot) {
    record = TakeFromSnapshot();
  } else if (state_ == State::kFollowing) {
    record = window_.Take();
  }
  if (!record) return std::nullopt;
  versions_.Take(*record);
  ++statistics_.records;
  statistics_.payload_bytes += static_cast<int64_t>(record->bytes->size());
  return record;
}

bool StreamReader::Doubt(const Record& record, int64_t now_ns) {
  const bool is_last_taken = window_.next() == record.header.seq + 1 && record.term() == term_;
  if (state_ != State::kFollowing || record.in_snapshot() || !is_last_taken) return false;
  const bool said_before = doubt_.record && *doubt_.record == *record.bytes;
  if (said_before && now_ns - doubt_.since_ns >= kNoCopyNs) return false;
  if (!said_before) doubt_ = {record.bytes, now_ns};
  ++statistics_.dropped_doubtful;
  window_.PutBack();
  versions_.PutBack();
  acknowledged_.due = true;
  return true;
}

std::optional<Record> StreamReader::TakeFromSnapshot() {
  std::optional<Record> record = snapshot_->window.Take();
  if (!record) return std::nullopt;
  versions_.Unaccept();
  if (record->ends_snapshot()) {
    ++statistics_.snapshots;
    snapshot_.reset();
    state_ = State::kFollowing;
    acknowledged_.due = true;
  }
  return record;
}

void StreamReader::Accept(const Version& version) { versions_.Accept(version, term_.epoch); }

bool StreamReader::AtEnd() const {
  return writer_closed_ && state_ == State::kFollowing && former_.empty() &&
         window_.next() > window_.newest();
}

bool StreamReader::AllTaken() const {
  return beacons_.complete >= kBelieved && state_ == State::kFollowing && former_.empty() &&
         window_.next() > std::max(window_.newest(), beacons_.last_seq);
}

// ---- acknowledgements

bool StreamReader::AckIsUrgent() const {
  if (!term_.valid()) return false;
  const int64_t accepted = versions_.AcceptedOf(term_.epoch);
  if (acknowledged_.due || accepted != acknowledged_.accepted || window_.received() != acknowledged_.received)
    return true;
  const bool writer_silent = acknowledged_.last_ns - beacons_.last_ns > options_.writer_timeout_ns;
  if (writer_silent) return false;
  return (state_ == State::kFollowing && window_.AnyMissing()) ||
         (snapshot_ && (snapshot_->number == 0 || snapshot_->window.AnyMissing()));
}

int64_t StreamReader::deadline_ns() const {
  if (!term_.valid()) return INT64_MAX;
  if (AckIsUrgent()) return acknowledged_.last_ns + options_.ack_ns;
  return acknowledged_.last_ns + (state_ == State::kRefusedBehind ? kRefusedAckNs : options_.idle_ack_ns);
}

void StreamReader::Advance(int64_t now_ns) {
  if (now_ns < deadline_ns()) return;
  if (snapshot_ && snapshot_->number != 0) SendAck(true, now_ns);
  SendAck(false, now_ns);
  acknowledged_.last_ns = now_ns;
  acknowledged_.due = false;
}

void StreamReader::SendAck(bool of_snapshot, int64_t now_ns) {
  const ReceiveWindow& window = of_snapshot ? snapshot_->window : window_;
  ack_t ack{};
  ack.utime = now_ns / 1000;
  ack.header.session = options_.session;
  ack.header.stream = static_cast<int32_t>(options_.stream);
  if (state_ != State::kRefusedVersion && state_ != State::kRefusedBehind) {  // who refuses follows nobody
    ack.header.epoch = term_.epoch;
    ack.header.writer = term_.writer;
  }
  ack.received = window.received();
  if (of_snapshot) {
    ack.header.flags = RecordHeader::FLAG_SNAPSHOT;
    ack.header.seq = window.received();
    ack.header.parent_epoch = snapshot_->number;
    ack.header.parent_seq = snapshot_->cut;
  } else {
    ack.header.seq = versions_.AcceptedOf(term_.epoch);
    ack.header.parent_epoch = held().epoch;
    ack.header.parent_seq = held().seq;
    acknowledged_.accepted = ack.header.seq;
    acknowledged_.received = ack.received;
  }
  ack.protocol_version = kProtocolVersion;
  ack.schema_hash = options_.schema_hash;
  ack.reader = options_.id;
  ack.wants = snapshot_ && !snapshot_->complete() ? ack_t::WANTS_SNAPSHOT : 0;
  std::vector<MissingRange> missing;
  if (of_snapshot || state_ == State::kFollowing || (snapshot_ && snapshot_->number != 0)) {
    missing = window.Missing(kMaxRangesNamed);
  }
  ack.num_missing = static_cast<int32_t>(missing.size());
  statistics_.requested += ack.num_missing;
  for (const MissingRange& range : missing) {
    ack.missing_first_seq.push_back(range.first_seq);
    ack.missing_last_seq.push_back(range.last_seq);
    ack.missing_first_byte.push_back(range.first_byte);
    ack.missing_end_byte.push_back(range.end_byte);
  }
  if (!of_snapshot) NoteMissing(missing, now_ns);
  ack.role = options_.role;
  ack.name = options_.name;
  outgoing_.push_back(SealedMessage(AckChannel(options_.reader), ack));
}

std::vector<Outgoing> StreamReader::TakeOutgoing() { return std::exchange(outgoing_, {}); }

int64_t StreamReader::backlog() const {
  return window_.newest() - window_.next() + 1 + static_cast<int64_t>(former_.size());
}

ReaderStatistics StreamReader::statistics() const {
  ReaderStatistics result = statistics_;
  if (!recovery_.took_ms.empty()) {
    std::vector<double> sorted(recovery_.took_ms.begin(), recovery_.took_ms.end());
    std::sort(sorted.begin(), sorted.end());
    result.recovery_p50_ms = sorted[sorted.size() / 2];
    result.recovery_p99_ms = sorted[sorted.size() * 99 / 100];
  }
  result.backlog = backlog();
  result.kept_bytes = window_.bytes() + (snapshot_ ? snapshot_->window.bytes() : 0);
  return result;
}

}  // namespace dmslam
