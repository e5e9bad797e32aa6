#include "dmslam/messaging/election.h"

#include <algorithm>
#include <utility>

#include "dmslam/messaging/believed_terms.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kMaxHeard = 64;  // more writers than this are noise

}  // namespace

WriterElection::WriterElection(Options options, int64_t now_ns)
    : options_(std::move(options)), listen_until_ns_(now_ns + options_.listen_ns) {
  DMSLAM_CHECK(options_.writer > 0, "a writer needs a positive id");
}

void WriterElection::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  const std::optional<int64_t> type = FingerprintOf(bytes);
  const auto is_ours = [&](const RecordHeader& header) {
    return header.session == options_.session && header.stream == static_cast<int32_t>(options_.stream);
  };
  if (type == ack_t::getHash()) {
    if (const auto ack = DecodeAck(channel, bytes); ack && is_ours(ack->header)) ReceiveAck(*ack);
  } else if (type == head_t::getHash() && channel == HeadChannel(options_.owner)) {
    if (const auto head = DecodeHead(channel, bytes); head && is_ours(head->header))
      ReceiveHead(*head, now_ns);
  }
}

/// What a reader follows and holds was written by somebody: the next term lies beyond it.
void WriterElection::ReceiveAck(const ack_t& ack) {
  if (ack.header.epoch > 0) epochs_.SaidAgain(ack.header.epoch, ack.utime);
  const bool of_snapshot = (ack.header.flags & RecordHeader::FLAG_SNAPSHOT) != 0;  // names no version held
  if (!of_snapshot && ack.header.parent_epoch > 0) epochs_.SaidAgain(ack.header.parent_epoch, ack.utime);
}

void WriterElection::ReceiveHead(const head_t& head, int64_t now_ns) {
  const Term term{head.header.epoch, head.header.writer};
  if (term.writer == options_.writer || !term.valid()) return;  // our own echo
  if (term.epoch > LatestBelievedEpoch(options_.clock_offset_us + now_ns / 1000, 0, 0)) return;
  epochs_.SaidAgain(term.epoch, head.utime);
  if (heard_.size() >= kMaxHeard && !heard_.contains(term)) return;
  Heard& heard = heard_[term];
  if (heard.utime && head.utime <= *heard.utime) {
    // Late, or the one before was from the future and counts no longer.
    if (*heard.utime - head.utime > kTimeToleranceUs) heard.utime = head.utime;
    return;
  }
  heard.utime = head.utime;
  heard.seq = head.header.seq;
  heard.last_ns = now_ns;
  ++heard.beacons;
  heard.closed = head.state == head_t::STATE_CLOSED ? heard.closed + 1 : 0;
  const auto* highest = Highest();
  if (highest == nullptr) return;
  predecessor_ = Version{highest->first.epoch, highest->second.seq};
  if (highest->first == term) Decide(head, now_ns);
}

/// Of those that are believed.
const std::pair<const Term, WriterElection::Heard>* WriterElection::Highest() const {
  const auto highest =
      std::find_if(heard_.rbegin(), heard_.rend(), [](const auto& entry) { return entry.second.believed(); });
  return highest == heard_.rend() ? nullptr : &*highest;
}

/// The highest one is heard.
void WriterElection::Decide(const head_t& head, int64_t now_ns) {
  const bool decides = state_ == State::kListening || (state_ == State::kWon && !options_.take_over);
  if (!decides || head.state == head_t::STATE_CLOSED) return;
  if (head.protocol_version != kProtocolVersion || head.schema_hash != options_.schema_hash) {
    state_ = State::kRefused;
    refusal_ = head.name + " writes this stream with protocol " + std::to_string(head.protocol_version) +
               " (" + NameOfProtocol(head.protocol_version) +
               ") or other message types: stop it, and run the same build everywhere";
  } else if (!options_.take_over) {
    state_ = State::kRefused;
    refusal_ = head.name + " writes this stream already: stop it, or start with --take-over";
  } else {
    state_ = State::kAsking;
    asking_since_ns_ = next_ask_ns_ = now_ns;
  }
}

void WriterElection::Advance(int64_t now_ns) {
  if (state_ == State::kListening && now_ns >= listen_until_ns_) state_ = State::kWon;
  if (state_ != State::kAsking) return;
  const Heard& asked = Highest()->second;
  if (asked.gone() || now_ns - asked.last_ns >= options_.silence_ns ||
      now_ns - asking_since_ns_ >= options_.take_over_timeout_ns) {
    state_ = State::kWon;
  } else if (now_ns >= next_ask_ns_) {
    Ask(now_ns);
  }
}

void WriterElection::Ask(int64_t now_ns) {
  take_over_t request{};
  request.utime = now_ns / 1000;
  request.header.session = options_.session;
  request.header.stream = static_cast<int32_t>(options_.stream);
  request.header.epoch = Highest()->first.epoch;
  request.header.writer = Highest()->first.writer;
  request.successor = options_.writer;
  request.name = options_.name;
  outgoing_.push_back(SealedMessage(TakeOverChannel(options_.owner), request));
  next_ask_ns_ = now_ns + options_.ask_ns;
}

std::vector<Outgoing> WriterElection::TakeOutgoing() { return std::exchange(outgoing_, {}); }

int64_t WriterElection::deadline_ns() const {
  if (state_ == State::kListening) return listen_until_ns_;
  return state_ == State::kAsking ? next_ask_ns_ : INT64_MAX;
}

Term WriterElection::Win(int64_t wall_us, int64_t named_epoch) const {
  DMSLAM_CHECK(state_ == State::kWon, "only who won an election may write");
  const int64_t latest = LatestBelievedEpoch(wall_us, named_epoch, named_epoch);
  int64_t named = named_epoch;
  epochs_.ForEach([&](int64_t epoch, bool again) {
    if (epoch <= (again ? latest : wall_us + kBelievedLeadUs)) named = std::max(named, epoch);
  });
  return {std::min(std::max(wall_us, named + 1), kMaxEpoch - 1), options_.writer};
}

}  // namespace dmslam
