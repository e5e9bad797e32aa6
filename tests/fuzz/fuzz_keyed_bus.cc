// What arrives on a bus with a key: messages with sound tags of several senders, each of any content, counter
// and order, and damaged ones. Nothing may crash; nothing is heard twice, nothing of who has not answered
// this process's challenge.
#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/keyed_bus.h"
#include "fuzz_target.h"

namespace dmslam::fuzz {
namespace {

constexpr char kChannel[] = "DMSLAM_X";

/// Keeps the challenge of the last question, and hands in what it is told.
class Wire : public Bus {
 public:
  void Subscribe(const std::string&) override {}
  void SetHandler(Handler handler) override { handler_ = std::move(handler); }
  void Publish(const Outgoing& message) override {
    Require(HasTag(*message.bytes), "everything that is sent has a tag");
    ++sent_;
    if (message.channel != kProofChannel) return;
    proof_t proof{};
    const auto body = WithoutTag(*message.bytes);
    if (proof.decode(body.data(), 0, static_cast<int>(body.size())) > 0 && proof.kind == proof_t::KIND_ASKS)
      asked_ = proof;
  }
  void HandIn(const std::string& channel, const Bytes& bytes) { handler_(channel, bytes); }
  proof_t asked() const { return asked_; }
  int sent() const { return sent_; }

 private:
  Handler handler_;
  proof_t asked_{};
  int sent_ = 0;
};

class Attack {
 public:
  Attack()
      : key_(Bytes(32, 1)),
        bus_(&wire_, key_, {5, [this] { return now_ns_; }, [] { return int64_t{1}; }, {}}) {
    bus_.SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) {
      Require(channel == kChannel && bytes.size() == 9, "what is heard is what was sent");
      const auto counter = GetInt<uint64_t>(bytes, 0);
      Require(heard_.insert({bytes[8], counter}).second, "each message is heard once");
      Require(answered_.contains(bytes[8]), "none is heard that has not shown that it is there");
    });
  }

  /// Four bytes of the input are one message.
  void Step(uint8_t what, uint8_t who, uint8_t count, uint8_t detail) {
    who %= 64;
    now_ns_ += detail * 1'000'000;
    const int before = wire_.sent();
    const uint64_t counter = count < 250 ? count : (uint64_t{1} << (count - 200)) + detail;
    const Tag tag{what & 0x80 ? 6u : 5u, counter, uint64_t{who} + 1};
    Bytes body(9);
    PutInt(counter, 0, body);
    body[8] = who;
    if (what % 8 == 0) {
      Bytes damaged = key_.WithTag(kChannel, body, tag);
      damaged[detail % damaged.size()] ^= static_cast<uint8_t>(1 + who % 255);
      wire_.HandIn(kChannel, damaged);
    } else if (what % 8 < 4) {
      wire_.HandIn(kChannel, key_.WithTag(kChannel, body, tag));
    } else {
      HandInProof(what, who, detail, tag);
    }
    Require(wire_.sent() - before <= 2, "few messages answer one");
  }

 private:
  void HandInProof(uint8_t what, uint8_t who, uint8_t detail, const Tag& tag) {
    proof_t proof = wire_.asked();
    if (what % 8 == 4) {
      proof.kind = proof_t::KIND_ASKS;
    } else {
      proof.kind = what % 8 == 5 ? static_cast<int32_t>(detail) : static_cast<int32_t>(proof_t::KIND_ANSWERS);
    }
    if (what % 8 == 7) proof.challenge[detail % 2] ^= 1;
    if (proof.kind == proof_t::KIND_ANSWERS && what % 8 != 7 && tag.session == 5) answered_.insert(who);
    Bytes body = Encode(proof);
    if (detail == 255) body.pop_back();
    wire_.HandIn(kProofChannel, key_.WithTag(kProofChannel, body, tag));
  }

  int64_t now_ns_ = 0;
  BusKey key_;
  Wire wire_;
  std::set<std::pair<uint8_t, uint64_t>> heard_;
  std::set<uint8_t> answered_;
  KeyedBus bus_;
};

}  // namespace
}  // namespace dmslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  size = std::min<size_t>(size, 1U << 13);
  dmslam::fuzz::Attack attack;
  for (size_t i = 0; i + 4 <= size; i += 4) attack.Step(data[i], data[i + 1], data[i + 2], data[i + 3]);
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  std::vector<std::vector<uint8_t>> seeds;
  for (uint8_t salt = 0; salt < 8; ++salt) {
    std::vector<uint8_t> seed;
    for (uint8_t step = 0; step < 60; ++step) {
      seed.insert(seed.end(),
                  {static_cast<uint8_t>(step % 5 == 0 ? 6 : 1), static_cast<uint8_t>(step % (salt + 2)),
                   static_cast<uint8_t>(step + 1), static_cast<uint8_t>(salt * step)});
    }
    seeds.push_back(std::move(seed));
  }
  return seeds;
}

}  // namespace dmslam::fuzz
