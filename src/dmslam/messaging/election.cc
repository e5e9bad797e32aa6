#include "dmslam/messaging/election.h"

#include <algorithm>
#include <utility>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/util/check.h"

namespace dmslam {

WriterElection::WriterElection(Options options, int64_t now_ns)
    : options_(std::move(options)), listen_until_ns_(now_ns + options_.listen_ns) {
  DMSLAM_CHECK(options_.writer > 0, "a writer needs a positive id");
}

void WriterElection::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  if (channel != HeadChannel(options_.owner) || FingerprintOf(bytes) != head_t::getHash()) return;
  const std::optional<head_t> head = DecodeHead(channel, bytes);
  if (!head || head->header.session != options_.session ||
      head->header.stream != static_cast<int32_t>(options_.stream)) {
    return;
  }
  const Term term{head->header.epoch, head->header.writer};
  if (term.writer == options_.writer) return;  // our own echo
  if (term < highest_ || (term == highest_ && head->utime <= highest_utime_)) return;
  const bool heard_before = term == highest_;  // one beacon alone may be a late echo of a writer that is gone
  highest_ = term;
  highest_utime_ = head->utime;
  highest_closed_ = head->state == head_t::STATE_CLOSED;
  last_heard_ns_ = now_ns;
  predecessor_ = Version{term.epoch, head->header.seq};
  const bool decides = state_ == State::kListening || (state_ == State::kWon && !options_.take_over);
  if (!decides || highest_closed_ || !heard_before) return;
  if (head->protocol_version != kProtocolVersion || head->schema_hash != options_.schema_hash) {
    state_ = State::kRefused;
    refusal_ = head->name + " writes this stream with protocol " + std::to_string(head->protocol_version) +
               " (" + NameOfProtocol(head->protocol_version) +
               ") or other message types: stop it, and run the same build everywhere";
  } else if (!options_.take_over) {
    state_ = State::kRefused;
    refusal_ = head->name + " writes this stream already: stop it, or start with --take-over";
  } else {
    state_ = State::kAsking;
    asking_since_ns_ = next_ask_ns_ = now_ns;
  }
}

void WriterElection::Advance(int64_t now_ns) {
  if (state_ == State::kListening && now_ns >= listen_until_ns_) state_ = State::kWon;
  if (state_ != State::kAsking) return;
  if (highest_closed_ || now_ns - last_heard_ns_ >= options_.silence_ns ||
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
  request.header.epoch = highest_.epoch;
  request.header.writer = highest_.writer;
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

Term WriterElection::Win(int64_t wall_us) const {
  DMSLAM_CHECK(state_ == State::kWon, "only who won an election may write");
  return {std::max(wall_us, highest_.epoch + 1), options_.writer};
}

}  // namespace dmslam
