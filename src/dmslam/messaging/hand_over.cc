#include "dmslam/messaging/hand_over.h"

#include <algorithm>
#include <utility>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kMaxAnswers = 64;  // more holders than this are noise

}  // namespace

ReplicaSearch::ReplicaSearch(Options options, int64_t now_ns)
    : options_(std::move(options)), give_up_ns_(now_ns + options_.absent_ns), next_ask_ns_(now_ns) {
  DMSLAM_CHECK(options_.asker != 0, "who asks needs an id");
  if (options_.roles.empty()) state_ = State::kNone;
}

void ReplicaSearch::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t) {
  if (state_ != State::kAsking || FingerprintOf(bytes) != replica_t::getHash()) return;
  const std::optional<replica_t> answer = DecodeReplica(channel, bytes);
  if (!answer || answer->asker != options_.asker || answer->header.session != options_.session ||
      answer->header.stream != static_cast<int32_t>(options_.stream) ||
      (answers_.size() >= kMaxAnswers && !answers_.contains(answer->holder))) {
    return;
  }
  answers_[answer->holder] = {answer->role, answer->holder, {answer->header.epoch, answer->header.seq}};
}

void ReplicaSearch::Advance(int64_t now_ns) {
  if (state_ == State::kAsking) {
    const bool all_answered =
        std::all_of(options_.roles.begin(), options_.roles.end(), [&](const std::string& role) {
          return std::any_of(answers_.begin(), answers_.end(),
                             [&](const auto& entry) { return entry.second.role == role; });
        });
    if (all_answered || now_ns >= give_up_ns_) Choose();
  }
  if (now_ns < next_ask_ns_ || finished_) return;
  if (state_ == State::kAsking) Ask(0, now_ns);
  if (state_ == State::kFound) Ask(replica_.holder, now_ns);
}

std::string ReplicaSearch::Unanswered() const {
  std::string waited;
  for (const std::string& role : options_.roles) {
    const bool answered = std::any_of(answers_.begin(), answers_.end(),
                                      [&](const auto& entry) { return entry.second.role == role; });
    if (!answered && state_ == State::kAsking) waited += (waited.empty() ? "" : ", ") + role;
  }
  return waited;
}

void ReplicaSearch::Choose() {
  state_ = State::kNone;
  replica_ = {};
  for (const auto& [holder, answer] : answers_) {
    if (answer.version > replica_.version) {
      replica_ = answer;
      state_ = State::kFound;
    }
  }
  next_ask_ns_ = INT64_MIN;
}

void ReplicaSearch::TryAgain(int64_t now_ns) {
  answers_.clear();
  ++options_.asker;
  state_ = State::kAsking;
  give_up_ns_ = now_ns + options_.absent_ns;
  next_ask_ns_ = now_ns;
}

void ReplicaSearch::Ask(int64_t chosen, int64_t now_ns) {
  hand_over_t question{};
  question.utime = now_ns / 1000;
  question.header.session = options_.session;
  question.header.stream = static_cast<int32_t>(options_.stream);
  question.asker = options_.asker;
  question.chosen = chosen;
  question.round = ++round_;
  outgoing_.push_back(SealedMessage(HandOverChannel(options_.owner), question));
  next_ask_ns_ = now_ns + options_.ask_ns;
}

std::vector<Outgoing> ReplicaSearch::TakeOutgoing() { return std::exchange(outgoing_, {}); }

int64_t ReplicaSearch::deadline_ns() const {
  if (state_ == State::kNone || finished_) return INT64_MAX;
  return state_ == State::kAsking ? std::min(next_ask_ns_, give_up_ns_) : next_ask_ns_;
}

ReplicaHolder::ReplicaHolder(Options options, std::function<Version()> held)
    : options_(std::move(options)), held_(std::move(held)) {
  DMSLAM_CHECK(options_.id != 0, "a holder needs an id");
}

void ReplicaHolder::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  if (channel != HandOverChannel(options_.owner) || FingerprintOf(bytes) != hand_over_t::getHash()) return;
  const std::optional<hand_over_t> question = DecodeHandOver(channel, bytes);
  if (!question || question->header.session != options_.session ||
      question->header.stream != static_cast<int32_t>(options_.stream)) {
    return;
  }
  if (question->chosen == options_.id) chosen_by_ = question->asker;
  if (question->chosen != 0) return;
  const Version held = held_();
  replica_t answer{};
  answer.utime = now_ns / 1000;
  answer.header.session = options_.session;
  answer.header.stream = static_cast<int32_t>(options_.stream);
  answer.header.epoch = held.epoch;
  answer.header.seq = held.seq;
  answer.asker = question->asker;
  answer.holder = options_.id;
  answer.role = options_.role;
  outgoing_.push_back(SealedMessage(ReplicaChannel(options_.holder), answer));
}

std::vector<Outgoing> ReplicaHolder::TakeOutgoing() { return std::exchange(outgoing_, {}); }

}  // namespace dmslam
