#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/bus_key.h"
#include "dmslam/proof_t.hpp"

namespace dmslam {

/// Where processes that share a key show one another that they are there (lcmtypes/dmslam_proof_t.lcm).
inline constexpr char kProofChannel[] = "DMSLAM_PROOF";

/// Which counters of a sender were seen: each is taken once, and none that is older than the window is long.
class CounterWindow {
 public:
  static constexpr uint64_t kLength = 4096;
  /// Takes counters above `floor` only.
  explicit CounterWindow(uint64_t floor) : floor_(floor), newest_(floor) {}
  bool Take(uint64_t counter);

 private:
  uint64_t floor_, newest_;
  std::bitset<kLength> seen_;
};

/// A bus on which only those are heard who have the key, who are there now, and each of their messages once.
/// What is published carries a tag (BusKey). What arrives without one that fits is refused and counted.
///
/// A recorded message has a tag that fits. So a sender is heard only once it has repeated a challenge that
/// this process drew at its start, which none but the living can, and only what it sent after that; of this,
/// each message once (its counter). Until then, a matter of milliseconds at the start of either, its messages
/// are left out, as if the network had lost them.
class KeyedBus : public Bus {
 public:
  struct Options {
    uint32_t session = 0;             ///< messages of others are refused; 0: this process learns it later
    std::function<int64_t()> now_ns;  ///< monotonic
    std::function<int64_t()> wall_us;
    std::function<void(const std::string&)> warn;  ///< told once of each way to be refused; may be empty
  };
  struct Statistics {
    int64_t unverified = 0;          ///< no tag, another key, changed, or of another channel
    int64_t foreign = 0;             ///< of another session
    int64_t repeated = 0;            ///< seen before, or older than what is remembered
    int64_t echoes = 0;              ///< of senders that do not show that they are there
    int64_t early = 0;               ///< left out until their sender had shown it; not among the refused
    int64_t made = 0, verified = 0;  ///< tags
    int64_t bytes = 0;               ///< of what was published, without tags
    int64_t tags_ns = 0;             ///< what making and verifying tags took
    int64_t refused() const { return unverified + foreign + repeated + echoes; }
  };

  /// Asks everybody at once to show that they are there. `bus` must outlive this one.
  KeyedBus(Bus* bus, BusKey key, Options options);

  void Subscribe(const std::string& channel) override { bus_->Subscribe(channel); }
  void SetHandler(Handler handler) override { handler_ = std::move(handler); }
  void Publish(const Outgoing& message) override;
  size_t overhead_bytes() const override { return kTagBytes; }

  const Statistics& statistics() const { return statistics_; }

 private:
  using Challenge = std::array<int64_t, 2>;
  struct Proven {
    CounterWindow window;
    int64_t heard_ns;
  };
  struct Unproven {
    int64_t since_ns, heard_ns;
    int64_t ask_ns;     ///< not before
    int64_t answer_ns;  ///< not before
    int64_t pause_ns;
  };

  void Receive(const std::string& channel, std::span<const uint8_t> bytes);
  std::optional<Tag> Verify(const std::string& channel, std::span<const uint8_t> bytes);
  void ReceiveUnproven(const Tag& tag, const std::string& channel, std::span<const uint8_t> bytes);
  void ReceiveProof(const Tag& tag, std::span<const uint8_t> bytes);
  void Answer(const Tag& tag, const Challenge& challenge);
  void Admit(const Tag& tag);
  Unproven& Remember(uint64_t sender);
  void AskAgain(uint64_t sender);
  void SendProof(int32_t kind, uint64_t to, const Challenge& challenge);
  void Refuse(int64_t Statistics::*counter, const std::string& channel, const char* why);
  void DrawChallenge();

  Bus* bus_;
  BusKey key_;
  Options options_;
  Handler handler_;
  uint64_t sender_ = 0, counter_ = 0;
  Challenge challenge_{};
  std::map<uint64_t, Proven> proven_;      ///< by sender; this process is one of them
  std::map<uint64_t, Unproven> unproven_;  ///< by sender
  Statistics statistics_;
};

}  // namespace dmslam
