#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/roles.h"
#include "dmslam/messaging/state_machine.h"
#include "dmslam/messaging/types.h"

namespace dmslam {

/// An owner that starts looks for the newest replica of its stream: it asks all holders, waits until each
/// configured role has answered or is known to be absent, and chooses the newest. The chosen holder then
/// opens a stream (StreamId::kHandOver) with nothing but a snapshot: its writer id is asker(), its parent the
/// version it hands over. A StreamReader of the asker with `only_writer = asker()` takes it; its parent() is
/// the version that was taken.
class ReplicaSearch : public StateMachine {
 public:
  struct Options {
    int64_t session = 1;
    StreamId stream = StreamId::kMap;
    std::string owner = owners::kMapper;  ///< of the stream: names the questions' channel
    int64_t asker = 0;                    ///< random id, not zero; the next few are used as well
    std::vector<std::string> roles;       ///< who may hold a replica
    int64_t absent_ns = 5'000'000'000;    ///< a role that does not answer for so long is absent
    int64_t ask_ns = 100'000'000;         ///< between questions
  };
  struct Replica {
    std::string role;
    int64_t holder = 0;
    Version version;
  };
  enum class State { kAsking, kFound, kNone };

  ReplicaSearch(Options options, int64_t now_ns);

  void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) override;
  void Advance(int64_t now_ns) override;
  std::vector<Outgoing> TakeOutgoing() override;
  int64_t deadline_ns() const override;

  State state() const { return state_; }
  /// The chosen one, once found.
  const Replica& replica() const { return replica_; }
  int64_t asker() const { return options_.asker; }
  /// Roles that have not answered, and are waited for; with commas.
  std::string Unanswered() const;
  /// Gives up the chosen one (it fell silent in the middle) and asks all again, under another id.
  void TryAgain(int64_t now_ns);
  /// The replica has arrived: no more questions.
  void Finish() { finished_ = true; }

 private:
  void Ask(int64_t chosen, int64_t now_ns);
  void Choose();

  Options options_;
  State state_ = State::kAsking;
  std::map<int64_t, Replica> answers_;  // by holder
  Replica replica_;
  int64_t give_up_ns_;
  int64_t next_ask_ns_;
  int32_t round_ = 0;
  bool finished_ = false;
  std::vector<Outgoing> outgoing_;
};

/// The other side: a holder says what it has, and learns that it was chosen.
class ReplicaHolder : public StateMachine {
 public:
  struct Options {
    int64_t session = 1;
    StreamId stream = StreamId::kMap;
    std::string owner = owners::kMapper;  ///< of the stream
    std::string holder;                   ///< this process: names the answers' channel, "FRONTEND"
    std::string role;
    int64_t id = 0;  ///< random, not zero: the one its reader of the stream uses
  };

  /// `held`: the version of the replica now; empty while it is not whole.
  ReplicaHolder(Options options, std::function<Version()> held);

  void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) override;
  void Advance(int64_t) override {}
  std::vector<Outgoing> TakeOutgoing() override;
  int64_t deadline_ns() const override { return has_outgoing() ? INT64_MIN : INT64_MAX; }

  /// Id of the asker that chose this replica: open the hand-over stream for it, once per asker, with this id
  /// as its writer's and the version held as its parent.
  const std::optional<int64_t>& chosen_by() const { return chosen_by_; }
  bool has_outgoing() const { return !outgoing_.empty(); }

 private:
  Options options_;
  std::function<Version()> held_;
  std::optional<int64_t> chosen_by_;
  std::vector<Outgoing> outgoing_;
};

}  // namespace dmslam
