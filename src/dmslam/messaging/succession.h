#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/hand_over.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/messaging/state_machine.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/messaging/stream_writer.h"

namespace dmslam {

/// How an owner that starts gets the newest state of its stream from those that hold replicas: search, choice
/// and transfer in one. To be begun after the election is won, since a writer that is being taken over still
/// publishes.
class ReplicaFetch : public StateMachine {
 public:
  struct Holder {
    std::string role;     ///< "frontend"
    std::string channel;  ///< upper-case name of the process: "FRONTEND"
  };
  struct Options {
    int64_t session = 1;
    StreamId stream = StreamId::kMap;
    std::string owner = owners::kMapper;  ///< upper-case name of this process
    std::string name;                     ///< for messages to people
    int64_t id = 0;                       ///< random, not zero
    int64_t schema_hash = 0;
    std::vector<Holder> holders;  ///< who is waited for; none: nothing to fetch
    ReceiveWindow::Limits limits;
    int64_t stalled_ns = 6'000'000'000;  ///< a transfer that does not advance for so long is begun again
  };
  enum class State {
    kSearching,
    kReceiving,
    kDone,  ///< all of it was taken: the owner continues version()
    kNone,  ///< nobody holds one: the owner begins from nothing
  };

  ReplicaFetch(Options options, int64_t now_ns);

  void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) override;
  void Advance(int64_t now_ns) override;
  std::vector<Outgoing> TakeOutgoing() override;
  int64_t deadline_ns() const override;

  /// The replica's next record; when `begins_anew()`, what came before is void.
  std::optional<Record> Take();

  State state() const { return state_; }
  /// What was fetched: the parent of the term to come; empty when nothing was.
  const Version& version() const { return version_; }
  const std::vector<Holder>& holders() const { return options_.holders; }
  /// Who hands it over; empty: nobody was found yet.
  std::string giver() const { return search_.replica().role; }
  /// Who has not said yet whether it has one; with commas.
  std::string Unanswered() const { return search_.Unanswered(); }
  /// What is handed over grows again and again, so that it never comes to its end: somebody writes the stream
  /// whom the holder hears, and this process does not.
  bool KeepsGrowing(int64_t now_ns) const {
    return state_ == State::kReceiving && begun_ > kMostBegun && now_ns - first_begun_ns_ > kMostGrowingNs;
  }

 private:
  static constexpr int kMostBegun = 20;
  static constexpr int64_t kMostGrowingNs = 10'000'000'000;
  void OpenReader(int64_t now_ns);
  void CountBegun(int64_t now_ns);

  Options options_;
  State state_ = State::kSearching;
  ReplicaSearch search_;
  std::unique_ptr<StreamReader> reader_;
  Version version_;
  int64_t advanced_ns_ = 0;  // when the transfer last advanced
  int64_t taken_ = 0, taken_before_ = 0;
  Term handed_over_in_;  // the present transfer
  int begun_ = 0;        // of the chosen holder's
  int64_t first_begun_ns_ = 0;
  std::vector<Outgoing> outgoing_;
};

/// The other side: answers searches, and hands the replica over to the asker that chose it.
class ReplicaServer : public StateMachine {
 public:
  struct Options {
    ReplicaHolder::Options holder;
    std::string name;  ///< for messages to people
    int64_t schema_hash = 0;
    Link link = Link::kHost;
  };

  /// `held`: the version of the replica now, empty while it is not whole. `snapshots`: cuts it in pieces.
  ReplicaServer(Options options, std::function<Version()> held, SnapshotSource* snapshots);

  void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) override;
  void Advance(int64_t now_ns) override;
  std::vector<Outgoing> TakeOutgoing() override;
  int64_t deadline_ns() const override;

  /// Handing over at the moment.
  bool serving() const { return writer_ != nullptr; }

 private:
  void Open(int64_t now_ns);

  Options options_;
  std::function<Version()> held_;
  SnapshotSource* source_;
  ReplicaHolder holder_;
  std::optional<int64_t> served_;
  Version offered_;
  int64_t epoch_ = 0;
  int64_t idle_since_ns_ = 0;
  std::unique_ptr<StreamWriter> writer_;
  std::vector<Outgoing> outgoing_;
};

}  // namespace dmslam
