#include "dmslam/messaging/keyed_bus.h"

#include <sodium.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "dmslam/messaging/codec.h"

namespace dmslam {
namespace {

constexpr size_t kMaxProven = 256, kMaxUnproven = 64;
constexpr int64_t kFirstPauseNs = 20'000'000, kLongestPauseNs = 500'000'000;  // from one question to the next
constexpr int64_t kAnswerPauseNs = 1'000'000;   // one who does not show itself is not answered more often
constexpr int64_t kPatienceNs = 2'000'000'000;  // who lives has answered by then
constexpr int64_t kProofBytes = 8 + 4 + 8 + 2 * 8;

uint64_t RandomNumber() {
  uint64_t number = 0;
  while (number == 0) randombytes_buf(&number, sizeof(number));
  return number;
}

std::optional<proof_t> DecodeProof(std::span<const uint8_t> bytes) {
  if (!LayoutWalker(bytes).Skip(kProofBytes).complete()) return std::nullopt;
  return DecodeWalked<proof_t>(bytes);
}

template <typename Map>
auto LongestSilent(Map& senders, uint64_t except) {
  auto silent = senders.end();
  for (auto it = senders.begin(); it != senders.end(); ++it) {
    if (it->first != except && (silent == senders.end() || it->second.heard_ns < silent->second.heard_ns))
      silent = it;
  }
  return silent;
}

}  // namespace

bool CounterWindow::Take(uint64_t counter) {
  if (counter <= floor_ || newest_ - std::min(counter, newest_) >= kLength) return false;
  if (counter > newest_) {
    if (counter - newest_ >= kLength) {
      seen_.reset();
    } else {
      for (uint64_t skipped = newest_ + 1; skipped <= counter; ++skipped) seen_.reset(skipped % kLength);
    }
    newest_ = counter;
  }
  if (seen_.test(counter % kLength)) return false;
  seen_.set(counter % kLength);
  return true;
}

KeyedBus::KeyedBus(Bus* bus, BusKey key, Options options)
    : bus_(bus), key_(std::move(key)), options_(std::move(options)), sender_(RandomNumber()) {
  proven_.emplace(sender_, Proven{CounterWindow(0), options_.now_ns()});
  DrawChallenge();
  bus_->SetHandler(
      [this](const std::string& channel, std::span<const uint8_t> bytes) { Receive(channel, bytes); });
  bus_->Subscribe(kProofChannel);
  SendProof(proof_t::KIND_ASKS, 0, challenge_);
}

void KeyedBus::DrawChallenge() { randombytes_buf(challenge_.data(), sizeof(challenge_)); }

void KeyedBus::Publish(const Outgoing& message) {
  const Tag tag{options_.session, ++counter_, sender_};
  const int64_t began_ns = options_.now_ns();
  auto tagged = std::make_shared<const Bytes>(key_.WithTag(message.channel, *message.bytes, tag));
  statistics_.tags_ns += options_.now_ns() - began_ns;
  ++statistics_.made;
  statistics_.bytes += static_cast<int64_t>(message.bytes->size());
  bus_->Publish({message.channel, std::move(tagged), message.local});
}

void KeyedBus::SendProof(int32_t kind, uint64_t to, const Challenge& challenge) {
  proof_t proof{};
  proof.utime = options_.wall_us();
  proof.kind = kind;
  proof.to = static_cast<int64_t>(to);
  std::copy(challenge.begin(), challenge.end(), proof.challenge);
  Publish({kProofChannel, std::make_shared<const Bytes>(Encode(proof)), false});
}

void KeyedBus::Refuse(int64_t Statistics::*counter, const std::string& channel, const char* why) {
  if ((statistics_.*counter)++ == 0 && options_.warn)
    options_.warn("refused a message on " + channel + ": " + why + " (further ones are only counted)");
}

std::optional<Tag> KeyedBus::Verify(const std::string& channel, std::span<const uint8_t> bytes) {
  const int64_t began_ns = options_.now_ns();
  std::optional<Tag> tag = key_.Verify(channel, bytes);
  statistics_.tags_ns += options_.now_ns() - began_ns;
  ++statistics_.verified;
  return tag;
}

void KeyedBus::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  const std::optional<Tag> tag = Verify(channel, bytes);
  if (!tag) {
    return Refuse(&Statistics::unverified, channel,
                  HasTag(bytes) ? "its sender has another key, or it was changed on its way"
                                : "its sender has no key; give the same --key to every process");
  }
  if (tag->session != options_.session && tag->session != 0 && options_.session != 0)
    return Refuse(&Statistics::foreign, channel, "it is of another session");
  const auto body = bytes.first(bytes.size() - kTagBytes);
  const auto sender = proven_.find(tag->sender);
  if (sender == proven_.end()) return ReceiveUnproven(*tag, channel, body);
  sender->second.heard_ns = options_.now_ns();
  if (!sender->second.window.Take(tag->counter))
    return Refuse(&Statistics::repeated, channel, "it was sent before, and is repeated");
  if (channel == kProofChannel) return ReceiveProof(*tag, body);
  if (handler_) handler_(channel, body);
}

void KeyedBus::ReceiveUnproven(const Tag& tag, const std::string& channel, std::span<const uint8_t> bytes) {
  const int64_t since_ns = Remember(tag.sender).since_ns;
  if (channel == kProofChannel) ReceiveProof(tag, bytes);
  if (proven_.contains(tag.sender)) return;
  AskAgain(tag.sender);
  if (options_.now_ns() - since_ns >= kPatienceNs) {
    Refuse(&Statistics::echoes, channel,
           "its sender does not show that it is there; an echo of what was said before");
  } else if (channel != kProofChannel) {
    ++statistics_.early;
  }
}

void KeyedBus::ReceiveProof(const Tag& tag, std::span<const uint8_t> bytes) {
  const std::optional<proof_t> proof = DecodeProof(bytes);
  if (!proof || tag.sender == sender_) return;
  const auto to = static_cast<uint64_t>(proof->to);
  const Challenge challenge = {proof->challenge[0], proof->challenge[1]};
  if (proof->kind == proof_t::KIND_ASKS && (to == 0 || to == sender_)) return Answer(tag, challenge);
  if (proof->kind == proof_t::KIND_ANSWERS && challenge == challenge_) Admit(tag);
}

void KeyedBus::Answer(const Tag& tag, const Challenge& challenge) {
  if (const auto asker = unproven_.find(tag.sender); asker != unproven_.end()) {
    if (options_.now_ns() < asker->second.answer_ns) return;
    asker->second.answer_ns = options_.now_ns() + kAnswerPauseNs;
  }
  SendProof(proof_t::KIND_ANSWERS, tag.sender, challenge);
}

/// From this message on; what came before it may be an echo.
void KeyedBus::Admit(const Tag& tag) {
  if (proven_.contains(tag.sender)) return;
  unproven_.erase(tag.sender);
  if (proven_.size() >= kMaxProven) {
    proven_.erase(LongestSilent(proven_, sender_));
    DrawChallenge();  // an echo of its answer would let the forgotten one in again
  }
  proven_.emplace(tag.sender, Proven{CounterWindow(tag.counter), options_.now_ns()});
}

/// Who was silent for long, as one that loads a file before it listens, is new again.
KeyedBus::Unproven& KeyedBus::Remember(uint64_t sender) {
  const int64_t now = options_.now_ns();
  auto known = unproven_.find(sender);
  if (known == unproven_.end() && unproven_.size() >= kMaxUnproven)
    unproven_.erase(LongestSilent(unproven_, 0));
  if (known == unproven_.end() || now - known->second.heard_ns >= kPatienceNs)
    known = unproven_.insert_or_assign(sender, Unproven{now, now, now, now, kFirstPauseNs}).first;
  known->second.heard_ns = now;
  return known->second;
}

/// Questions and answers may be lost: asked again when it is heard again, ever more seldom.
void KeyedBus::AskAgain(uint64_t sender) {
  Unproven& unproven = unproven_.at(sender);
  if (options_.now_ns() < unproven.ask_ns) return;
  unproven.ask_ns = options_.now_ns() + unproven.pause_ns;
  unproven.pause_ns = std::min(2 * unproven.pause_ns, kLongestPauseNs);
  SendProof(proof_t::KIND_ASKS, sender, challenge_);
}

}  // namespace dmslam
