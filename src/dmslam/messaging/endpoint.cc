#include "dmslam/messaging/endpoint.h"

#include <algorithm>
#include <utility>

namespace dmslam {
namespace {

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

Endpoint::Endpoint(Bus* bus, Clock clock) : bus_(bus), clock_(std::move(clock)) {
  bus_->SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) { Receive(channel, bytes); });
}

void Endpoint::Subscribe(const std::string& channel) {
  if (Contains(subscribed_, channel)) return;
  subscribed_.push_back(channel);
  bus_->Subscribe(channel);
}

void Endpoint::AddReader(StreamReader* reader, const std::string& owner,
                         const std::vector<std::string>& record_channels) {
  machines_.push_back(reader);
  for (const std::string& channel : record_channels) Subscribe(channel);
  Subscribe(PartChannel(owner));
  Subscribe(HeadChannel(owner));
}

void Endpoint::AddWriter(StreamWriter* writer, const std::string& owner, const std::vector<std::string>& readers) {
  machines_.push_back(writer);
  for (const std::string& reader : readers) Subscribe(AckChannel(reader));
  Subscribe(HeadChannel(owner));  // of a second writer
  Subscribe(TakeOverChannel(owner));
}

void Endpoint::AddElection(WriterElection* election, const std::string& owner) {
  machines_.push_back(election);
  Subscribe(HeadChannel(owner));
}

void Endpoint::AddFetch(ReplicaFetch* fetch, const std::vector<std::string>& record_channels) {
  machines_.push_back(fetch);
  for (const std::string& channel : record_channels) Subscribe(channel);
  for (const ReplicaFetch::Holder& holder : fetch->holders()) {
    Subscribe(ReplicaChannel(holder.channel));
    Subscribe(HeadChannel(holder.channel));
    Subscribe(PartChannel(holder.channel));
  }
}

void Endpoint::AddServer(ReplicaServer* server, const std::string& owner) {
  machines_.push_back(server);
  Subscribe(HandOverChannel(owner));
  Subscribe(AckChannel(owner));
}

void Endpoint::Remove(const StateMachine* machine) { std::erase(machines_, machine); }

void Endpoint::SetOtherHandler(const std::vector<std::string>& channels, Bus::Handler handler) {
  other_ = std::move(handler);
  other_channels_ = channels;
  for (const std::string& channel : channels) Subscribe(channel);
}

void Endpoint::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  const int64_t now = clock_();
  for (StateMachine* machine : machines_) machine->Receive(channel, bytes, now);
  if (other_ && Contains(other_channels_, channel)) other_(channel, bytes);
}

void Endpoint::Advance() {
  const int64_t now = clock_();
  for (StateMachine* machine : machines_) {
    machine->Advance(now);
    for (const Outgoing& message : machine->TakeOutgoing()) bus_->Publish(message);
  }
}

int64_t Endpoint::deadline_ns() const {
  int64_t deadline = INT64_MAX;
  for (const StateMachine* machine : machines_) deadline = std::min(deadline, machine->deadline_ns());
  return deadline;
}

}  // namespace dmslam
