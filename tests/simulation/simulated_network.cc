#include "simulated_network.h"

#include <iterator>
#include <optional>
#include <utility>

namespace dmslam::simulation {

namespace {

/// What is said again and again, of which nothing is lost with one who dies.
bool IsRecord(const std::string& channel) {
  return !channel.ends_with("_HEAD") && !channel.ends_with("_ACK") && !channel.ends_with("_STATUS");
}

}  // namespace

void SimulatedNetwork::Port::Publish(const Outgoing& message) {
  if (has_died()) return;
  network_->Send(*this, message);
  if (records_left_ && IsRecord(message.channel)) --*records_left_;
}

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
  if (from.closed_) return;
  content_forger_.Hear(message);
  if (message.local) return;  // a tap for tools; its parts arrive as well
  ++statistics_.sent;
  forger_.Hear(message);
  newest_[message.channel] = message;
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

void SimulatedNetwork::FlyToAll(const Outgoing& message) {
  for (const auto& to : ports_) {
    if (!to->closed_ && to->channels_.contains(message.channel)) Fly(to.get(), message);
  }
}

void SimulatedNetwork::Forge() {
  if (const std::optional<Outgoing> forged = forger_.Make(random_)) FlyToAll(*forged);
}

bool SimulatedNetwork::Forge(Content content) {
  const std::optional<Outgoing> forged = content_forger_.Make(content, random_);
  if (forged) FlyToAll(*forged);
  return forged.has_value();
}

void SimulatedNetwork::Echo() {
  if (newest_.empty()) return;
  FlyToAll(std::next(newest_.begin(), random_->Below(static_cast<uint32_t>(newest_.size())))->second);
}

}  // namespace dmslam::simulation
