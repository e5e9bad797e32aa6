#include "dmslam/messaging/bus.h"

#include <utility>

namespace dmslam {

void MemoryBus::Port::Publish(const Outgoing& message) { bus_->queue_.push_back({this, message}); }

MemoryBus::Port& MemoryBus::AddPort() {
  ports_.push_back(std::unique_ptr<Port>(new Port(this)));
  return *ports_.back();
}

bool MemoryBus::DeliverOne() {
  if (queue_.empty()) return false;
  const Sent sent = std::move(queue_.front());
  queue_.pop_front();
  if (sent.message.local) return true;  // a tap for tools; its parts arrive as well
  for (const auto& port : ports_) {
    if (port.get() == sent.sender || !port->handler_ || !port->Hears(sent.message.channel)) continue;
    port->handler_(sent.message.channel, *sent.message.bytes);
  }
  return true;
}

}  // namespace dmslam
