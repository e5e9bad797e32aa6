#include "schedule.h"

#include <algorithm>
#include <cstdio>

namespace dmslam::simulation {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSecond = 1000 * kMs;

int64_t Between(int64_t low, int64_t high, Random* random) {
  return low + static_cast<int64_t>(random->Uniform() * static_cast<double>(high - low));
}

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", value);
  return text;
}

NetworkConditions DrawNetwork(Link link, Random* random) {
  NetworkConditions network;
  // A frame is a message of ten datagrams on a LAN, and dies with any of them.
  if (random->Below(4) > 0) network.loss = random->Uniform(0, link == Link::kLan ? 0.06 : 0.3);
  if (random->Below(2) > 0) network.duplication = random->Uniform(0, 0.3);
  network.max_delay_ns =
      network.min_delay_ns + Between(kMs / 10, random->Below(2) ? 4 * kMs : 60 * kMs, random);
  if (link == Link::kLan) network.datagram_bytes = 1472;
  return network;
}

Fault DrawPause(uint32_t num_frames, Random* random) {
  Fault fault;
  fault.kind = Fault::Kind::kPause;
  fault.process = Roles()[random->Below(static_cast<uint32_t>(Roles().size()))];
  fault.at_frame = random->Below(num_frames + 1);
  fault.after_ns = Between(0, fault.at_frame == num_frames ? 4 * kSecond : kSecond / 2, random);
  fault.lasts_ns = Between(kMs, random->Below(3) ? 2 * kSecond : 20 * kSecond, random);
  return fault;
}

}  // namespace

std::string ToText(const Fault& fault) {
  std::string text;
  switch (fault.kind) {
    case Fault::Kind::kPause:
      text = fault.process + " stands still for " + Number(static_cast<double>(fault.lasts_ns) * 1e-9) + " s";
      break;
  }
  return "frame " + std::to_string(fault.at_frame) + " + " +
         Number(static_cast<double>(fault.after_ns) * 1e-9) + " s: " + text;
}

std::string Schedule::ToText() const {
  std::string text = std::string(link == Link::kHost ? "host" : "lan") + ", loss " + Number(network.loss) +
                     ", repeated " + Number(network.duplication) + ", delay up to " +
                     Number(static_cast<double>(network.max_delay_ns) * 1e-6) + " ms, " +
                     std::to_string(num_hosts) + " hosts";
  for (const Fault& fault : faults) text += "; " + simulation::ToText(fault);
  return text;
}

const std::vector<std::string>& Roles() {
  static const std::vector<std::string> roles = {"collector", "loopcloser", "mapper", "frontend", "player"};
  return roles;
}

Schedule CalmSchedule() {
  Schedule schedule;
  for (const std::string& role : Roles()) schedule.host_of[role] = 0;
  return schedule;
}

Schedule DrawSchedule(uint64_t seed, uint32_t num_frames) {
  Random random(DeriveSeed(seed, 0, "schedule"));
  Schedule schedule;
  schedule.seed = seed;
  schedule.link = random.Below(2) == 0 ? Link::kHost : Link::kLan;
  schedule.network = DrawNetwork(schedule.link, &random);
  schedule.num_hosts = schedule.link == Link::kHost ? 1 : 1 + static_cast<int>(random.Below(3));
  for (const std::string& role : Roles())
    schedule.host_of[role] = static_cast<int>(random.Below(static_cast<uint32_t>(schedule.num_hosts)));
  schedule.slowest_turn_ns = random.Below(2) ? 0 : Between(0, 5 * kMs, &random);
  schedule.latest_start_ns = Between(0, 2 * kSecond, &random);
  schedule.fresh_system = random.Below(2) == 0;
  for (uint32_t i = random.Below(4); i > 0; --i) schedule.faults.push_back(DrawPause(num_frames, &random));
  std::ranges::stable_sort(schedule.faults, {}, &Fault::at_frame);
  return schedule;
}

}  // namespace dmslam::simulation
