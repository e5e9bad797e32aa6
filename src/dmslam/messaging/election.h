#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/ack_t.hpp"
#include "dmslam/head_t.hpp"
#include "dmslam/messaging/claims.h"
#include "dmslam/messaging/state_machine.h"
#include "dmslam/messaging/types.h"

namespace dmslam {

/// Decides whether a newcomer may write a stream: it listens first; a live beacon means that it refuses, or,
/// when told to take over, asks the present writer to hand over and waits until that has closed. Two
/// newcomers that both win meet through their beacons: the lower term stops (StreamWriter::superseded_by).
/// Until the stream is opened it goes on listening: a writer that is heard only then turns the victory into a
/// refusal. One beacon alone decides nothing: it may be the late echo of a writer that is gone, or forged.
class WriterElection : public StateMachine {
 public:
  struct Options {
    int64_t session = 1;
    StreamId stream = StreamId::kTest;
    std::string owner;   ///< names the beacon's channel
    std::string name;    ///< for messages to people
    int64_t writer = 0;  ///< random id, positive
    int64_t schema_hash = 0;
    int64_t clock_offset_us =
        0;                   ///< the wall clock minus that of `now_ns`: bounds the terms that are believed
    bool take_over = false;  ///< asks a live writer to close instead of refusing
    int64_t listen_ns = 2'000'000'000;              ///< 0: a private system, wins at once
    int64_t ask_ns = 200'000'000;                   ///< between requests
    int64_t silence_ns = 1'000'000'000;             ///< a writer not heard for so long while asked is gone
    int64_t take_over_timeout_ns = 10'000'000'000;  ///< then the higher term decides
  };
  enum class State { kListening, kAsking, kRefused, kWon };

  WriterElection(Options options, int64_t now_ns);

  void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) override;
  void Advance(int64_t now_ns) override;
  std::vector<Outgoing> TakeOutgoing() override;
  int64_t deadline_ns() const override;

  State state() const { return state_; }
  /// Why it was refused: names the present writer and the cure.
  const std::string& refusal() const { return refusal_; }
  /// The term won. Terms never go back, whatever the clock of this host: the epoch is the largest of the wall
  /// clock (microseconds), every epoch that a beacon or a reader's acknowledgement named + 1, and
  /// `named_epoch` + 1: of the replica that the owner continues. An epoch that lies far beyond the wall clock
  /// is not believed; of a wall clock that was never set, one that was named once only.
  Term Win(int64_t wall_us, int64_t named_epoch = 0) const;
  /// How far the highest writer heard had come; nothing when none was heard.
  const std::optional<Version>& predecessor() const { return predecessor_; }

 private:
  struct Heard {
    std::optional<int64_t> utime;  // of its newest beacon
    int64_t seq = 0;
    int64_t last_ns = 0;
    int beacons = 0;
    int closed = 0;  // of the newest ones, how many said that it is closed
    bool believed() const { return beacons > 1; }
    bool gone() const { return closed > 1; }
  };
  void ReceiveHead(const head_t& head, int64_t now_ns);
  void ReceiveAck(const ack_t& ack);
  void Decide(const head_t& head, int64_t now_ns);
  const std::pair<const Term, Heard>* Highest() const;
  void Ask(int64_t now_ns);

  Options options_;
  State state_ = State::kListening;
  int64_t listen_until_ns_;
  int64_t asking_since_ns_ = 0, next_ask_ns_ = 0;
  std::map<Term, Heard> heard_;
  Claims<int64_t> epochs_;  // that somebody named
  std::optional<Version> predecessor_;
  std::string refusal_;
  std::vector<Outgoing> outgoing_;
};

}  // namespace dmslam
