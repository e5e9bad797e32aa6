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

constexpr uint32_t kFramesBetween = 6;  // from one death to the next: everything is there again

bool MakesTheMap(const std::string& role) {
  return role == "mapper" || role == "frontend" || role == "loopcloser";
}

template <typename T>
const T& AnyOf(const std::vector<T>& items, Random* random) {
  return items[random->Below(static_cast<uint32_t>(items.size()))];
}

int AnyHost(const Schedule& schedule, Random* random) {
  return static_cast<int>(random->Below(static_cast<uint32_t>(schedule.num_hosts)));
}

/// What leaves the same bytes, but for deaths and moves.
Fault DrawDisturbance(const Schedule& schedule, Random* random) {
  using Kind = Fault::Kind;
  std::vector<Kind> kinds = {Kind::kPause,   Kind::kPause, Kind::kClockStep, Kind::kForgery,
                             Kind::kForgery, Kind::kEcho,  Kind::kFullDisk};
  if (schedule.num_hosts > 1) kinds.push_back(Kind::kPartition);
  Fault fault;
  fault.kind = AnyOf(kinds, random);
  fault.process = fault.kind == Kind::kFullDisk ? "collector" : AnyOf(Roles(), random);
  fault.lasts_ns = Between(kMs, random->Below(3) ? 2 * kSecond : 15 * kSecond, random);
  fault.host = AnyHost(schedule, random);
  fault.step_us = Between(-7'200'000'000, 7'200'000'000, random);
  return fault;
}

Fault DrawDeath(const Schedule& schedule, const std::vector<std::string>& roles, Random* random) {
  Fault fault;
  fault.kind = random->Below(3) ? Fault::Kind::kKill : Fault::Kind::kMove;
  fault.process = AnyOf(roles, random);
  fault.lasts_ns = Between(0, random->Below(3) ? kSecond / 2 : 4 * kSecond, random);
  fault.host = AnyHost(schedule, random);
  return fault;
}

void Place(Fault* fault, uint32_t frame, uint32_t num_frames, Random* random) {
  fault->at_frame = frame;
  fault->after_ns = Between(0, frame == num_frames ? 3 * kSecond : 30 * kMs, random);
}

void DrawDeaths(uint32_t num_frames, Schedule* schedule, Random* random) {
  schedule->meets_writers = random->Below(2) == 0;
  std::vector<std::string> roles;
  for (const std::string& role : Roles()) {
    if (schedule->meets_writers || !MakesTheMap(role)) roles.push_back(role);
  }
  uint32_t frame = random->Below(num_frames);
  for (uint32_t i = random->Below(3) + schedule->meets_writers; i > 0 && frame <= num_frames; --i) {
    Fault fault = DrawDeath(*schedule, roles, random);
    Place(&fault, frame, num_frames, random);
    schedule->faults.push_back(fault);
    frame += kFramesBetween + random->Below(num_frames / 2);
  }
}

/// Forged messages: in one of three schedules also those that may cost what they stand for.
void DrawForgedContents(uint32_t num_frames, Schedule* schedule, Random* random) {
  const bool may_cost = random->Below(3) == 0;
  for (uint32_t i = 1 + random->Below(3); i > 0; --i) {
    Fault fault;
    fault.kind = Fault::Kind::kContent;
    do {
      fault.content = static_cast<Content>(random->Below(kNumContents));
    } while (MayCost(fault.content) && !may_cost);
    Place(&fault, random->Below(num_frames + 1), num_frames, random);
    schedule->faults.push_back(fault);
  }
}

/// In the moment in which one process dies others do so too, or all.
void DrawCompanions(Schedule* schedule, Random* random) {
  schedule->at_once = true;
  std::vector<size_t> deaths;
  for (size_t i = 0; i < schedule->faults.size(); ++i) {
    if (schedule->faults[i].kind == Fault::Kind::kKill) deaths.push_back(i);
  }
  if (deaths.empty()) return;
  const size_t leader = AnyOf(deaths, random);
  std::vector<Fault> companions;
  const uint32_t percent = random->Below(3) == 0 ? 100 : 40;
  for (const std::string& role : Roles()) {
    if (role == schedule->faults[leader].process || random->Below(100) >= percent) continue;
    Fault fault = DrawDeath(*schedule, {role}, random);
    fault.kind = Fault::Kind::kKill;
    fault.at_frame = schedule->faults[leader].at_frame;
    companions.push_back(fault);
  }
  schedule->faults.insert(schedule->faults.begin() + static_cast<std::ptrdiff_t>(leader) + 1,
                          companions.begin(), companions.end());
}

/// All die, once or twice, and somebody resumes the run.
void DrawResumes(uint32_t num_frames, Schedule* schedule, Random* random) {
  if (random->Below(2) == 0) schedule->checkpoint_s = random->Uniform(0.3, 2);
  for (uint32_t i = 1 + (random->Below(4) == 0); i > 0; --i) {
    Fault fault;
    fault.kind = random->Below(2) == 0 ? Fault::Kind::kKillAll : Fault::Kind::kPowerCut;
    fault.lasts_ns = Between(kSecond / 2, random->Below(2) ? 5 * kSecond : 60 * kSecond, random);
    Place(&fault, random->Below(num_frames + 1), num_frames, random);
    schedule->faults.push_back(fault);
  }
}

}  // namespace

std::string ToText(const Fault& fault) {
  const std::string lasts = Number(static_cast<double>(fault.lasts_ns) * 1e-9) + " s";
  const std::string host = "host " + std::to_string(fault.host);
  std::string text;
  switch (fault.kind) {
    case Fault::Kind::kPause:
      text = fault.process + " stands still for " + lasts;
      break;
    case Fault::Kind::kKill:
      text = fault.process + " dies, and begins again on " + host + " after " + lasts;
      break;
    case Fault::Kind::kMove:
      text = fault.process + " moves to " + host;
      break;
    case Fault::Kind::kPartition:
      text = host + " is cut off for " + lasts;
      break;
    case Fault::Kind::kClockStep:
      text =
          "the clock of " + host + " is set by " + Number(static_cast<double>(fault.step_us) * 1e-6) + " s";
      break;
    case Fault::Kind::kForgery:
      text = "a forged message";
      break;
    case Fault::Kind::kEcho:
      text = "an echo";
      break;
    case Fault::Kind::kFullDisk:
      text = "the disk is full for " + lasts;
      break;
    case Fault::Kind::kKillAll:
      text = "all are killed, and the run is resumed after " + lasts;
      break;
    case Fault::Kind::kPowerCut:
      text = "the power is cut, and the run is resumed after " + lasts;
      break;
    case Fault::Kind::kContent:
      text = "a forged " + ToText(fault.content);
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

bool Schedule::MeetsDeaths() const {
  return std::ranges::any_of(faults, [](const Fault& fault) {
    return fault.kind == Fault::Kind::kKill || fault.kind == Fault::Kind::kMove;
  });
}

bool Schedule::IsResumed() const {
  return std::ranges::any_of(faults, [](const Fault& fault) {
    return fault.kind == Fault::Kind::kKillAll || fault.kind == Fault::Kind::kPowerCut;
  });
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
  for (uint32_t i = random.Below(5); i > 0; --i) {
    Fault fault = DrawDisturbance(schedule, &random);
    Place(&fault, random.Below(num_frames + 1), num_frames, &random);
    schedule.faults.push_back(fault);
  }
  DrawDeaths(num_frames, &schedule, &random);
  Random more(DeriveSeed(seed, 0, "more of the schedule"));  // the draws above stay what they were
  if (more.Below(2) == 0) DrawForgedContents(num_frames, &schedule, &more);
  if (more.Below(2) == 0 && schedule.meets_writers) DrawCompanions(&schedule, &more);
  if (more.Below(4) == 0) DrawResumes(num_frames, &schedule, &more);
  std::ranges::stable_sort(schedule.faults, {}, &Fault::at_frame);
  return schedule;
}

}  // namespace dmslam::simulation
