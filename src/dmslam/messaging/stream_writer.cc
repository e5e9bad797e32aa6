#include "dmslam/messaging/stream_writer.h"

#include <algorithm>
#include <utility>

#include "dmslam/head_t.hpp"
#include "dmslam/messaging/believed_terms.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/take_over_t.hpp"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kMaxReaders = 64;  // more ids than this are noise
constexpr int kFarewells = 6;

SendWindow::Options WindowOptions(const StreamWriter::Options& options) {
  return {options.link, PartChannel(options.owner), options.part_bytes, options.pack,
          options.resend_after_ns};
}

}  // namespace

StreamWriter::StreamWriter(Options options, Term term, Version parent, SnapshotSource* snapshots)
    : options_(std::move(options)),
      term_(term),
      parent_(parent),
      source_(snapshots),
      window_(WindowOptions(options_), StreamKey(options_.session, options_.stream, term, 0)) {
  DMSLAM_CHECK(term.valid(), "a writer needs a term of office");
  DMSLAM_CHECK(options_.part_bytes >= 64 && options_.part_bytes <= 1400, "a part must fit one datagram");
  for (const Role& role : options_.roles) {
    if (role.required) role_floor_[role.name] = 0;
  }
}

// ---- what the owner does

int64_t StreamWriter::Publish(const std::string& channel, Bytes message, int64_t now_ns) {
  DMSLAM_CHECK(state_ == State::kLive, "a stream that closes takes no more records");
  const int64_t seq = window_.last() + 1;
  Seal(HeaderOf(seq), channel, message);
  ++statistics_.records;
  statistics_.payload_bytes += static_cast<int64_t>(message.size());
  window_.Append(channel, std::make_shared<const Bytes>(std::move(message)));
  ForgetAccepted();
  if (!IsSilent()) SendPaced(now_ns);
  return seq;
}

void StreamWriter::Advance(int64_t now_ns) {
  ExcuseSilence(now_ns);
  ForgetSilentReaders(now_ns);
  ForgetAccepted();
  if (IsSilent()) return;
  AdvanceClosing(now_ns);
  AdvanceSnapshot(now_ns);
  SendPaced(now_ns);
  if (beacons_.due || now_ns >= beacons_.next_ns) Beacon(now_ns);
}

int64_t StreamWriter::deadline_ns() const {
  if (IsSilent()) return INT64_MAX;
  int64_t deadline = beacons_.due ? INT64_MIN : beacons_.next_ns;
  if (!window_.idle()) deadline = std::min(deadline, burst_.left > 0 ? INT64_MIN : burst_.next_ns);
  if (snapshot_ && !snapshot_->window.idle()) {
    const bool now = burst_.left > 0 && burst_.for_snapshot > 0;
    deadline = std::min(deadline, now ? INT64_MIN : burst_.next_ns);
  }
  if (state_ == State::kClosing) deadline = std::min(deadline, close_deadline_ns_);
  return deadline;
}

std::vector<Outgoing> StreamWriter::TakeOutgoing() { return std::exchange(outgoing_, {}); }

void StreamWriter::Close(int64_t now_ns) {
  if (state_ == State::kLive) {
    state_ = State::kClosing;
    hands_over_ = close_requested_by_.has_value();
  }
  lingers_ = false;
  close_deadline_ns_ = std::min(close_deadline_ns_, now_ns + options_.close_timeout_ns);
  beacons_.due = !closed();
}

void StreamWriter::Complete(int64_t) {
  if (state_ != State::kLive) return;
  state_ = State::kClosing;
  lingers_ = true;
  beacons_.due = true;
}

void StreamWriter::AdvanceClosing(int64_t now_ns) {
  if (state_ != State::kClosing || (!AllAccepted() && now_ns < close_deadline_ns_)) return;
  state_ = State::kClosed;
  beacons_.due = true;
}

// ---- what comes in

void StreamWriter::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  const std::optional<int64_t> type = FingerprintOf(bytes);
  if (type == ack_t::getHash()) {
    ReceiveAck(channel, bytes, now_ns);
  } else if (type == head_t::getHash() && channel == HeadChannel(options_.owner)) {
    ReceiveHead(channel, bytes, now_ns);
  } else if (type == take_over_t::getHash()) {
    ReceiveTakeOver(channel, bytes, now_ns);
  } else {
    ++statistics_.dropped_bad;
  }
}

void StreamWriter::ReceiveHead(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
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
  const Term other{head->header.epoch, head->header.writer};
  if (other > term_ && IsBelieved(other, head->utime, now_ns)) superseded_by_ = head->name;
}

/// One message alone may be forged, and a term that lies too far ahead is.
bool StreamWriter::IsBelieved(const Term& term, int64_t utime, int64_t now_ns) {
  const int64_t latest =
      LatestBelievedEpoch(options_.clock_offset_us + now_ns / 1000, term_.epoch, term_.epoch);
  const bool believed = term.epoch <= latest && terms_.SaidAgain(term, utime);
  statistics_.dropped_doubtful += believed ? 0 : 1;
  return believed;
}

void StreamWriter::ReceiveTakeOver(const std::string& channel, std::span<const uint8_t> bytes,
                                   int64_t now_ns) {
  const std::optional<take_over_t> request = DecodeTakeOver(channel, bytes);
  if (!request) {
    ++statistics_.dropped_bad;
    return;
  }
  if (request->header.stream != static_cast<int32_t>(options_.stream)) return;
  if (request->header.session != options_.session) {
    ++statistics_.dropped_foreign;
    return;
  }
  const bool is_ours = Term{request->header.epoch, request->header.writer} == term_;
  if (is_ours && successors_.Asks(request->successor, request->utime, now_ns)) {
    close_requested_by_ = request->name;
  }
}

void StreamWriter::ReceiveAck(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  const std::optional<ack_t> ack = DecodeAck(channel, bytes);
  if (!ack) {
    ++statistics_.dropped_bad;
    return;
  }
  if (ack->header.stream != static_cast<int32_t>(options_.stream)) return;
  if (ack->header.session != options_.session) {
    ++statistics_.dropped_foreign;
    return;
  }
  if (ack->protocol_version != kProtocolVersion || ack->schema_hash != options_.schema_hash) {
    ++statistics_.refused;
    refusal_ =
        "reader " + ack->name + " speaks protocol " + std::to_string(ack->protocol_version) +
        (ack->protocol_version == kProtocolVersion ? " with other message types"
                                                   : " (" + NameOfProtocol(ack->protocol_version) + ")") +
        ", this writer protocol " + std::to_string(kProtocolVersion) + " (" +
        NameOfProtocol(kProtocolVersion) + "): run the same build everywhere";
    return;
  }
  if ((ack->header.flags & RecordHeader::FLAG_SNAPSHOT) != 0) return ReceiveSnapshotAck(*ack, now_ns);

  Reader* reader = Meet(*ack, now_ns);
  if (reader == nullptr) return;
  const Term followed{ack->header.epoch, ack->header.writer};
  if (followed == term_ && ack->header.seq > window_.last()) {  // what was never written cannot be accepted
    ++statistics_.dropped_doubtful;
    return;
  }
  if (followed > term_ && IsBelieved(followed, ack->utime, now_ns))
    superseded_by_ = "the writer that " + ack->name + " follows";
  reader->following = followed == term_;
  reader->wants_snapshot = ack->wants == ack_t::WANTS_SNAPSHOT && reader->following;
  if (!reader->following) return;
  reader->accepted = std::clamp<int64_t>(ack->header.seq, 0, window_.last());
  reader->floor = std::max(reader->floor, reader->accepted);
  if (snapshot_ && !reader->wants_snapshot) snapshot_->takers.erase(ack->reader);
  window_.Repair(*ack, now_ns);
}

StreamWriter::Reader* StreamWriter::Meet(const ack_t& ack, int64_t now_ns) {
  if (!readers_.contains(ack.reader) && readers_.size() >= kMaxReaders) return nullptr;
  Reader& reader = readers_[ack.reader];
  const bool in_time = IsInTime(ack, now_ns, &reader);
  reader.last_heard_ns = now_ns;
  if (!in_time) return nullptr;
  reader.last_utime = ack.utime;
  reader.role = ack.role;
  reader.lossless = std::any_of(options_.roles.begin(), options_.roles.end(),
                                [&](const Role& role) { return role.name == ack.role; });
  const Version held{ack.header.parent_epoch, ack.header.parent_seq};
  const bool newer = held.epoch < term_.epoch && held > parent_ && !held.empty() && !parent_.empty();
  if (newer && newer_.SaidAgain(held, ack.utime)) newer_replica_ = held;
  return &reader;
}

/// Neither late, nor from a future that would make all of its next words late. Where a reader's clock has
/// leapt in earnest, its next word says so too.
bool StreamWriter::IsInTime(const ack_t& ack, int64_t now_ns, Reader* reader) {
  if (!reader->last_utime) return true;
  const int64_t last = *reader->last_utime;
  const int64_t expected = last + (now_ns - reader->last_heard_ns) / 1000;
  const bool leaps = ack.utime > expected + kTimeToleranceUs || ack.utime < last - kTimeToleranceUs;
  if (!leaps) return ack.utime >= last;
  const std::optional<int64_t> before = std::exchange(reader->doubtful_utime, ack.utime);
  ++statistics_.dropped_doubtful;
  return before && ack.utime > *before && ack.utime - *before < kTimeToleranceUs;
}

// ---- snapshots

void StreamWriter::ReceiveSnapshotAck(const ack_t& ack, int64_t now_ns) {
  const auto reader = readers_.find(ack.reader);
  if (reader != readers_.end()) reader->second.last_heard_ns = now_ns;
  if (!snapshot_ || Term{ack.header.epoch, ack.header.writer} != term_ ||
      ack.header.parent_epoch != snapshot_->number)
    return;
  const auto taker = snapshot_->takers.find(ack.reader);
  if (taker == snapshot_->takers.end()) return;
  int64_t& received = taker->second.received;
  received = std::clamp(ack.header.seq, received, snapshot_->window.last());
  taker->second.last_heard_ns = now_ns;
  if (received == snapshot_->total && reader != readers_.end()) reader->second.wants_snapshot = false;
  snapshot_->window.Repair(ack, now_ns);
}

void StreamWriter::AdvanceSnapshot(int64_t now_ns) {
  if (source_ == nullptr) return;
  const bool wanted = std::any_of(readers_.begin(), readers_.end(),
                                  [](const auto& entry) { return entry.second.wants_snapshot; });
  if (!snapshot_ && wanted && source_->Ready()) BeginSnapshot(now_ns);
  if (!snapshot_) return;
  for (auto& [id, reader] : readers_) {  // who comes before the first piece is forgotten may join
    if (!reader.wants_snapshot || snapshot_->window.first() != 1) continue;
    snapshot_->takers.emplace(id, Snapshot::Taker{0, now_ns});
    reader.floor = std::max(reader.floor, snapshot_->cut);
  }
  MakePieces();
  std::erase_if(snapshot_->takers, [&](const auto& entry) {
    return (snapshot_->total > 0 && entry.second.received == snapshot_->total) ||
           now_ns - entry.second.last_heard_ns > options_.taker_timeout_ns;
  });
  int64_t received = snapshot_->window.last();
  for (const auto& [id, taker] : snapshot_->takers) received = std::min(received, taker.received);
  if (snapshot_->takers.empty()) {
    EndSnapshot();
    return;
  }
  snapshot_->window.DiscardThrough(received);
  MakePieces();
}

/// Of a large map a snapshot is cut for seconds, in which nobody is heard: their silence is none.
void StreamWriter::ExcuseSilence(int64_t now_ns) {
  if (!snapshot_ || !snapshot_->cutting_since_ns) return;
  const int64_t deaf_ns = now_ns - *std::exchange(snapshot_->cutting_since_ns, std::nullopt);
  const auto excuse = [&](auto& entry) {
    int64_t& last_heard_ns = entry.second.last_heard_ns;
    last_heard_ns = std::max(last_heard_ns, std::min(now_ns, last_heard_ns + deaf_ns));
  };
  std::ranges::for_each(readers_, excuse);
  std::ranges::for_each(snapshot_->takers, excuse);
}

void StreamWriter::BeginSnapshot(int64_t now_ns) {
  const int64_t number = ++snapshots_begun_;
  const int32_t key = StreamKey(options_.session, options_.stream, term_, number);
  snapshot_.emplace(
      Snapshot{number, window_.last(), 0, SendWindow(WindowOptions(options_), key), {}, now_ns});
  source_->BeginSnapshot(snapshot_->cut);
  ++statistics_.snapshots;
  beacons_.due = true;
}

void StreamWriter::EndSnapshot() {
  for (auto& [id, reader] : readers_) reader.wants_snapshot = false;  // who still lacks one says so again
  statistics_.parts += snapshot_->window.parts_sent;
  statistics_.parts_repaired += snapshot_->window.parts_repaired;
  statistics_.repaired_bytes += snapshot_->window.bytes_repaired;
  statistics_.sent_bytes += snapshot_->window.bytes_sent;
  snapshot_.reset();
  beacons_.due = true;
}

void StreamWriter::MakePieces() {
  SendWindow& window = snapshot_->window;
  while (snapshot_->total == 0 && window.kept() < static_cast<size_t>(options_.snapshot_ahead)) {
    SnapshotSource::Piece piece = source_->NextPiece();
    RecordHeader header = HeaderOf(window.last() + 1);
    header.flags = RecordHeader::FLAG_SNAPSHOT | (piece.last ? RecordHeader::FLAG_SNAPSHOT_LAST : 0);
    header.parent_epoch = snapshot_->number;
    header.parent_seq = snapshot_->cut;
    Seal(header, piece.channel, piece.message);
    window.Append(std::move(piece.channel), std::make_shared<const Bytes>(std::move(piece.message)));
    if (piece.last) {
      snapshot_->total = window.last();
      beacons_.due = true;
    }
  }
}

// ---- what goes out

void StreamWriter::SendPaced(int64_t now_ns) {
  if (now_ns >= burst_.next_ns) {
    const int64_t bursts = 1 + std::min<int64_t>(99, (now_ns - burst_.next_ns) / options_.burst_ns);
    burst_.for_snapshot =
        std::min(options_.snapshot_per_burst,
                 burst_.for_snapshot + static_cast<int>(bursts) * options_.snapshot_per_burst);
    burst_.left = options_.parts_per_burst;
    burst_.next_ns = now_ns + options_.burst_ns;
  }
  burst_.left = std::max(0, window_.Send(burst_.left, now_ns, &outgoing_));
  if (!snapshot_) return;
  const int share = std::min(burst_.left, burst_.for_snapshot);
  if (share <= 0) return;
  const int sent = share - snapshot_->window.Send(share, now_ns, &outgoing_);
  burst_.left = std::max(0, burst_.left - sent);
  burst_.for_snapshot -= sent;  // what a piece takes beyond its share is missing in the next bursts
}

void StreamWriter::Beacon(int64_t now_ns) {
  head_t head{};
  head.utime = now_ns / 1000;
  head.header = HeaderOf(window_.sent());
  head.protocol_version = kProtocolVersion;
  head.state = head_t::STATE_LIVE;
  if (state_ == State::kClosing) head.state = head_t::STATE_CLOSING;
  if (state_ == State::kClosed) head.state = head_t::STATE_CLOSED;
  head.schema_hash = options_.schema_hash;
  head.first_seq = window_.first();
  head.snapshots = snapshots_begun_;
  if (snapshot_) {
    head.snapshot_total = static_cast<int32_t>(snapshot_->total);
    head.snapshot_cut = snapshot_->cut;
    head.snapshot_first = snapshot_->window.first();
    head.snapshot_last = snapshot_->window.sent();
  }
  head.offers = source_ != nullptr ? head_t::OFFERS_SNAPSHOT : 0;
  if (hands_over_) head.offers |= head_t::OFFERS_SUCCESSOR;
  head.name = options_.name;
  outgoing_.push_back(SealedMessage(HeadChannel(options_.owner), head));
  statistics_.sent_bytes += static_cast<int64_t>(outgoing_.back().bytes->size());
  beacons_.due = false;
  const bool early = beacons_.early > 0 && beacons_.early-- > 0;
  beacons_.next_ns = now_ns + (early ? options_.beacon_ns / 10 : options_.beacon_ns);
  if (state_ == State::kClosed && !lingers_) {
    --beacons_.farewells;
    beacons_.next_ns = now_ns + options_.beacon_ns / kFarewells;
  }
}

RecordHeader StreamWriter::HeaderOf(int64_t seq) const {
  RecordHeader header{};
  header.session = options_.session;
  header.stream = static_cast<int32_t>(options_.stream);
  header.flags = parent_.empty() ? RecordHeader::FLAG_FRESH : 0;
  header.epoch = term_.epoch;
  header.writer = term_.writer;
  header.seq = seq;
  header.parent_epoch = parent_.epoch;
  header.parent_seq = parent_.seq;
  return header;
}

// ---- what is kept, and for whom

void StreamWriter::ForgetSilentReaders(int64_t now_ns) {
  std::erase_if(readers_, [&](const auto& entry) {
    return now_ns - entry.second.last_heard_ns > options_.reader_timeout_ns;
  });
}

int64_t StreamWriter::Floor(bool followers_only) const {
  std::map<std::string, int64_t> floors = role_floor_;
  std::map<std::string, bool> known;
  for (const auto& [id, reader] : readers_) {
    if (!reader.lossless || reader.wants_snapshot || (followers_only && !reader.following)) continue;
    const auto [it, first] = known.emplace(reader.role, true);
    int64_t& floor = floors[reader.role];
    floor = first ? reader.floor : std::min(floor, reader.floor);
  }
  if (floors.empty()) return followers_only ? window_.last() : 0;
  return std::min_element(floors.begin(), floors.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->second;
}

void StreamWriter::ForgetAccepted() {
  for (auto& [role, floor] : role_floor_) floor = std::max(floor, AcknowledgedBy(role).value_or(0));
  const int64_t floor = Floor(false);
  while (window_.first() <= floor &&
         (window_.kept() > options_.spare_records || window_.bytes() > options_.spare_bytes)) {
    window_.DiscardThrough(window_.first());
  }
  while (window_.kept() > 1 &&
         (window_.kept() > options_.max_records || window_.bytes() > options_.max_bytes)) {
    if (window_.first() > Floor(true)) ++statistics_.overrun;
    window_.DiscardThrough(window_.first());
  }
}

bool StreamWriter::Full() const {
  const bool at_bound = window_.kept() >= options_.max_records || window_.bytes() >= options_.max_bytes;
  return at_bound && window_.first() > Floor(true);
}

bool StreamWriter::AllAccepted() const {
  for (const auto& [id, reader] : readers_) {
    if (reader.lossless && reader.following && reader.accepted < window_.last()) return false;
  }
  return std::all_of(role_floor_.begin(), role_floor_.end(),
                     [&](const auto& entry) { return entry.second >= window_.last(); });
}

bool StreamWriter::AcknowledgedByAny(int64_t seq) const {
  return std::any_of(readers_.begin(), readers_.end(), [&](const auto& entry) {
    return entry.second.lossless && entry.second.following && entry.second.accepted >= seq;
  });
}

std::optional<int64_t> StreamWriter::AcknowledgedBy(const std::string& role) const {
  std::optional<int64_t> accepted;
  for (const auto& [id, reader] : readers_) {
    if (reader.role != role || !reader.following) continue;
    accepted = std::min(accepted.value_or(INT64_MAX), reader.accepted);
  }
  return accepted;
}

int64_t StreamWriter::Backlog(const std::string& role) const {
  return window_.last() - AcknowledgedBy(role).value_or(0);
}

WriterStatistics StreamWriter::statistics() const {
  WriterStatistics result = statistics_;
  result.parts += window_.parts_sent + (snapshot_ ? snapshot_->window.parts_sent : 0);
  result.parts_repaired += window_.parts_repaired + (snapshot_ ? snapshot_->window.parts_repaired : 0);
  result.repaired_bytes += window_.bytes_repaired + (snapshot_ ? snapshot_->window.bytes_repaired : 0);
  result.sent_bytes += window_.bytes_sent + (snapshot_ ? snapshot_->window.bytes_sent : 0);
  result.kept_records = window_.kept();
  result.kept_bytes = window_.bytes();
  return result;
}

}  // namespace dmslam
