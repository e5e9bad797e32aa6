#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/types.h"

namespace dmslam {

/// Where messages go and come from: all that a process knows of the world. Names of channels carry no prefix
/// here.
class Bus {
 public:
  using Handler = std::function<void(const std::string& channel, std::span<const uint8_t> bytes)>;
  virtual ~Bus() = default;

  /// Wants the messages of one channel, by its exact name.
  virtual void Subscribe(const std::string& channel) = 0;
  /// Who gets them. Called from within the bus's delivery; may publish.
  virtual void SetHandler(Handler handler) = 0;
  virtual void Publish(const Outgoing& message) = 0;
  /// What the bus adds to each message: parts that shall fit a datagram leave room for it.
  virtual size_t overhead_bytes() const { return 0; }
};

/// A bus within one process: lossless, first in first out, delivered when asked to. Each process has a port
/// of its own and does not hear itself.
class MemoryBus {
 public:
  class Port : public Bus {
   public:
    void Subscribe(const std::string& channel) override { channels_.insert(channel); }
    /// Wants all that others say, on whatever channel.
    void SubscribeToAll() { hears_all_ = true; }
    void SetHandler(Handler handler) override { handler_ = std::move(handler); }
    void Publish(const Outgoing& message) override;

   private:
    friend class MemoryBus;
    explicit Port(MemoryBus* bus) : bus_(bus) {}
    bool Hears(const std::string& channel) const { return hears_all_ || channels_.contains(channel); }
    MemoryBus* bus_;
    bool hears_all_ = false;
    std::set<std::string> channels_;
    Handler handler_;
  };

  /// A new port; it lives as long as the bus. Ports hear a message in the order they were made.
  Port& AddPort();
  /// Delivers the oldest message; false if there is none.
  bool DeliverOne();
  bool idle() const { return queue_.empty(); }

 private:
  struct Sent {
    const Port* sender;
    Outgoing message;
  };
  std::vector<std::unique_ptr<Port>> ports_;
  std::deque<Sent> queue_;
};

}  // namespace dmslam
