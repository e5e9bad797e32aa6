#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/election.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/messaging/stream_writer.h"
#include "dmslam/messaging/succession.h"

namespace dmslam {

/// Connects the state machines of one process to its bus: subscribes to their channels, gives each message to
/// those that want its channel, and sends what they have to say. They stay their owner's, and must be removed
/// before they die.
class Endpoint {
 public:
  using Clock = std::function<int64_t()>;

  /// `clock`: monotonic nanoseconds (EventLoop::now_ns), or virtual time in one process.
  Endpoint(Bus* bus, Clock clock);

  /// `record_channels`: all channels on which the stream's records travel.
  void AddReader(StreamReader* reader, const std::string& owner,
                 const std::vector<std::string>& record_channels);
  /// `readers`: who may acknowledge, by the upper-case names of their processes ("FRONTEND").
  void AddWriter(StreamWriter* writer, const std::string& owner, const std::vector<std::string>& readers);
  /// An election hears the beacons of its owner, and what `readers` acknowledge; a fetch the holders' answers
  /// and records; a server the owner's questions and acknowledgements.
  void AddElection(WriterElection* election, const std::string& owner,
                   const std::vector<std::string>& readers = {});
  void AddFetch(ReplicaFetch* fetch, const std::vector<std::string>& record_channels);
  void AddServer(ReplicaServer* server, const std::string& owner);
  void Remove(const StateMachine* machine);

  /// Messages that belong to no stream, by their channels.
  void SetOtherHandler(const std::vector<std::string>& channels, Bus::Handler handler);

  /// Advances all of them and sends what they have. Call it after every delivery, publication and deadline.
  void Advance();
  int64_t deadline_ns() const;
  Bus& bus() { return *bus_; }

 private:
  struct Added {
    StateMachine* machine;
    std::vector<std::string> channels;
  };
  void Add(StateMachine* machine, std::vector<std::string> channels);
  void Receive(const std::string& channel, std::span<const uint8_t> bytes);
  void Subscribe(const std::string& channel);

  Bus* bus_;
  Clock clock_;
  std::vector<Added> machines_;
  std::vector<std::string> subscribed_;
  std::vector<std::string> other_channels_;
  Bus::Handler other_;
};

}  // namespace dmslam
