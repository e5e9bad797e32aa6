#include "simulated_network.h"

#include <algorithm>
#include <utility>

namespace dmslam::simulation {

SimulatedNetwork::Port* SimulatedNetwork::AddPort(int host) {
  ports_.push_back(std::unique_ptr<Port>(new Port(this, host)));
  return ports_.back().get();
}

void SimulatedNetwork::Close(Port* port) {
  port->closed_ = true;
  port->handler_ = nullptr;
  port->buffered_.clear();
}

void SimulatedNetwork::Resume(Port* port) {
  port->paused_ = false;
  for (const Outgoing& message : port->buffered_) flying_.push({now_ns_, order_++, port, message});
  port->buffered_.clear();
  port->buffered_bytes_ = 0;
}

bool SimulatedNetwork::IsLost(const Outgoing& message) {
  const size_t datagrams = 1 + message.bytes->size() / conditions_.datagram_bytes;
  bool lost = false;
  for (size_t i = 0; i < datagrams; ++i) lost |= random_->Uniform() < conditions_.loss;
  return lost;
}

void SimulatedNetwork::Fly(Port* to, const Outgoing& message) {
  const double spread = static_cast<double>(conditions_.max_delay_ns - conditions_.min_delay_ns);
  const int64_t delay = conditions_.min_delay_ns + static_cast<int64_t>(random_->Uniform() * spread);
  flying_.push({now_ns_ + delay, order_++, to, message});
}

void SimulatedNetwork::Send(const Port& from, const Outgoing& message) {
  if (from.closed_ || message.local) return;  // a tap for tools; its parts arrive as well
  ++statistics_.sent;
  Overhear(message);
  for (const auto& to : ports_) {
    if (to.get() == &from || to->closed_ || !to->channels_.contains(message.channel)) continue;
    if (cut_off_.contains(from.host_) != cut_off_.contains(to->host_)) continue;
    const int copies = random_->Uniform() < conditions_.duplication ? 2 : 1;
    statistics_.repeated += copies - 1;
    for (int copy = 0; copy < copies; ++copy) {
      if (IsLost(message)) {
        ++statistics_.lost;
      } else {
        Fly(to.get(), message);
      }
    }
  }
}

std::set<const SimulatedNetwork::Port*> SimulatedNetwork::Deliver(int64_t now_ns) {
  std::set<const Port*> heard;
  while (!flying_.empty() && flying_.top().at_ns <= now_ns) {
    const Flying flying = flying_.top();
    flying_.pop();
    Port* to = flying.to;
    if (to->closed_ || !to->handler_) continue;
    const Outgoing& message = flying.message;
    if (to->paused_) {
      const bool has_room = to->buffered_bytes_ + message.bytes->size() <= kReceiveBufferBytes;
      statistics_.overflown += !has_room;
      if (!has_room) continue;
      to->buffered_bytes_ += message.bytes->size();
      to->buffered_.push_back(message);
      continue;
    }
    ++statistics_.delivered;
    to->handler_(message.channel, *message.bytes);
    heard.insert(to);
  }
  return heard;
}

void SimulatedNetwork::Forge(const Outgoing& message, int64_t now_ns) {
  for (const auto& to : ports_) {
    if (!to->closed_ && to->channels_.contains(message.channel))
      flying_.push({now_ns, order_++, to.get(), message});
  }
}

void SimulatedNetwork::Overhear(const Outgoing& message) {
  const auto known = std::ranges::find(overheard_, message.channel, &Outgoing::channel);
  if (known == overheard_.end()) {
    overheard_.push_back(message);
  } else {
    *known = message;
  }
}

void SimulatedNetwork::Heal() {
  conditions_.loss = conditions_.duplication = 0;
  conditions_.max_delay_ns = conditions_.min_delay_ns + 1000;
  cut_off_.clear();
}

}  // namespace dmslam::simulation
