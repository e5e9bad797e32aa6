#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "content_forger.h"
#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/forger.h"
#include "dmslam/util/random.h"

namespace dmslam::simulation {

/// How the network treats messages.
struct NetworkConditions {
  double loss = 0;                ///< of a datagram; a message of several dies with any of them
  double duplication = 0;         ///< of a message
  int64_t min_delay_ns = 50'000;  ///< each copy takes from this ...
  int64_t max_delay_ns = 60'000;  ///< ... to this: where they differ much, later ones overtake
  size_t datagram_bytes = 65'000;
};

/// The bus of simulated processes on simulated hosts, in virtual time: loses, delays, repeats and reorders,
/// all drawn from one generator.
class SimulatedNetwork {
 public:
  /// What one process has of the network. It hears all but itself.
  class Port : public Bus {
   public:
    void Subscribe(const std::string& channel) override { channels_.insert(channel); }
    void SetHandler(Handler handler) override { handler_ = std::move(handler); }
    void Publish(const Outgoing& message) override;
    /// Its process dies when it has sent so many more records: what it says after them nobody hears.
    void DieAfter(int records) { records_left_ = records; }
    bool has_died() const { return records_left_ == 0; }

   private:
    friend class SimulatedNetwork;
    Port(SimulatedNetwork* network, int host) : network_(network), host_(host) {}
    SimulatedNetwork* network_;
    int host_;
    bool closed_ = false;
    std::optional<int> records_left_;
    bool paused_ = false;
    std::set<std::string> channels_;
    Handler handler_;
    std::deque<Outgoing> buffered_;  ///< while its process stands still
    size_t buffered_bytes_ = 0;
  };

  SimulatedNetwork(const NetworkConditions& conditions, Random* random)
      : conditions_(conditions), random_(random) {}

  /// It lives as long as the network.
  Port* AddPort(int host);
  /// Its process is gone: it hears and says nothing any more.
  void Close(Port* port);
  /// Its process stands still: what comes waits in its receive buffer, and what has no room there is lost.
  void Pause(Port* port) { port->paused_ = true; }
  void Resume(Port* port);

  /// When the next message arrives; INT64_MAX: none is on its way.
  int64_t next_ns() const { return flying_.empty() ? INT64_MAX : flying_.top().at_ns; }
  /// Hands over what has arrived; the ports that heard something.
  std::set<const Port*> Deliver(int64_t now_ns);

  /// A beacon or an acknowledgement that somebody has changed, heard by all who want its channel.
  void Forge();
  /// A message of that content that somebody has made of what was said; false: not enough was said yet.
  bool Forge(Content content);
  /// The newest message of some channel, once more.
  void Echo();

  /// The newest message of a channel; null: there was none.
  const Outgoing* Newest(const std::string& channel) const {
    const auto newest = newest_.find(channel);
    return newest == newest_.end() ? nullptr : &newest->second;
  }

  void set_now(int64_t now_ns) { now_ns_ = now_ns; }
  /// Hosts of this set and the others do not hear each other.
  void Cut(std::set<int> hosts) { cut_off_ = std::move(hosts); }

  struct Statistics {
    int64_t sent = 0, lost = 0, repeated = 0, overflown = 0, delivered = 0;
  };
  const Statistics& statistics() const { return statistics_; }

 private:
  static constexpr size_t kReceiveBufferBytes = 2'000'000;
  struct Flying {
    int64_t at_ns = 0;
    int64_t order = 0;
    Port* to = nullptr;
    Outgoing message;
    bool operator<(const Flying& other) const {
      return std::tie(at_ns, order) > std::tie(other.at_ns, other.order);
    }
  };

  void Send(const Port& from, const Outgoing& message);
  bool IsLost(const Outgoing& message);
  void Fly(Port* to, const Outgoing& message);
  void FlyToAll(const Outgoing& message);

  NetworkConditions conditions_;
  Random* random_;
  int64_t now_ns_ = 0;
  int64_t order_ = 0;
  std::vector<std::unique_ptr<Port>> ports_;
  std::priority_queue<Flying> flying_;
  std::set<int> cut_off_;
  std::map<std::string, Outgoing> newest_;  ///< of each channel
  Forger forger_;
  ContentForger content_forger_;
  Statistics statistics_;
};

}  // namespace dmslam::simulation
