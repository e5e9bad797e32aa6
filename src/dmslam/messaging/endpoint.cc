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
  bus_->SetHandler(
      [this](const std::string& channel, std::span<const uint8_t> bytes) { Receive(channel, bytes); });
}

void Endpoint::Subscribe(const std::string& channel) {
  if (Contains(subscribed_, channel)) return;
  subscribed_.push_back(channel);
  bus_->Subscribe(channel);
}

void Endpoint::Add(StateMachine* machine, std::vector<std::string> channels) {
  for (const std::string& channel : channels) Subscribe(channel);
  machines_.push_back({machine, std::move(channels)});
}

void Endpoint::AddReader(StreamReader* reader, const std::string& owner,
                         const std::vector<std::string>& record_channels) {
  std::vector<std::string> channels = record_channels;
  channels.insert(channels.end(), {PartChannel(owner), HeadChannel(owner)});
  Add(reader, std::move(channels));
}

void Endpoint::AddWriter(StreamWriter* writer, const std::string& owner,
                         const std::vector<std::string>& readers) {
  std::vector<std::string> channels = {HeadChannel(owner),
                                       TakeOverChannel(owner)};  // HEAD: of a second writer
  for (const std::string& reader : readers) channels.push_back(AckChannel(reader));
  Add(writer, std::move(channels));
}

void Endpoint::AddElection(WriterElection* election, const std::string& owner,
                           const std::vector<std::string>& readers) {
  std::vector<std::string> channels = {HeadChannel(owner)};
  for (const std::string& reader : readers) channels.push_back(AckChannel(reader));
  Add(election, std::move(channels));
}

void Endpoint::AddFetch(ReplicaFetch* fetch, const std::vector<std::string>& record_channels) {
  std::vector<std::string> channels = record_channels;
  for (const ReplicaFetch::Holder& holder : fetch->holders()) {
    channels.insert(channels.end(), {ReplicaChannel(holder.channel), HeadChannel(holder.channel),
                                     PartChannel(holder.channel)});
  }
  Add(fetch, std::move(channels));
}

void Endpoint::AddServer(ReplicaServer* server, const std::string& owner) {
  Add(server, {HandOverChannel(owner), AckChannel(owner)});
}

void Endpoint::Remove(const StateMachine* machine) {
  std::erase_if(machines_, [machine](const Added& added) { return added.machine == machine; });
}

void Endpoint::SetOtherHandler(const std::vector<std::string>& channels, Bus::Handler handler) {
  other_ = std::move(handler);
  other_channels_ = channels;
  for (const std::string& channel : channels) Subscribe(channel);
}

void Endpoint::Receive(const std::string& channel, std::span<const uint8_t> bytes) {
  const int64_t now = clock_();
  for (const Added& added : machines_) {
    if (Contains(added.channels, channel)) added.machine->Receive(channel, bytes, now);
  }
  if (other_ && Contains(other_channels_, channel)) other_(channel, bytes);
}

void Endpoint::Advance() {
  const int64_t now = clock_();
  for (const Added& added : machines_) {
    added.machine->Advance(now);
    for (const Outgoing& message : added.machine->TakeOutgoing()) bus_->Publish(message);
  }
}

int64_t Endpoint::deadline_ns() const {
  int64_t deadline = INT64_MAX;
  for (const Added& added : machines_) deadline = std::min(deadline, added.machine->deadline_ns());
  return deadline;
}

}  // namespace dmslam
