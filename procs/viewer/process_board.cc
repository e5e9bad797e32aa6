#include "viewer/process_board.h"

#include <algorithm>

namespace dmslam {
namespace {

constexpr int64_t kSilentNs = 2'500'000'000;  // statuses come once a second
constexpr int64_t kBackShownNs = 15'000'000'000;
constexpr size_t kMostEvents = 200;

}  // namespace

ProcessBoard::ProcessBoard(const std::vector<std::string>& names) {
  for (const std::string& name : names)
    processes_.push_back({.name = name, .state = {}, .reason = {}, .health = {}, .instances = {}});
}

ProcessBoard::Process* ProcessBoard::Find(const std::string& name) {
  const auto it = std::find_if(processes_.begin(), processes_.end(),
                               [&](const Process& process) { return process.name == name; });
  return it == processes_.end() ? nullptr : &*it;
}

void ProcessBoard::SetLife(Process* process, Life life, int64_t now_ns) {
  process->life = life;
  process->since_ns = now_ns;
}

void ProcessBoard::OnStatus(const std::string& name, const StatusHead& head, const std::string& state,
                            int64_t now_ns, int64_t wall_us) {
  Process* process = Find(name);
  if (process == nullptr) return;
  const bool first = process->life == Life::kAwaited;
  const bool restarted = process->instances.IsNew(head.health, now_ns) && !first;
  const bool silent = process->life == Life::kDown;
  process->heard_ns = now_ns;
  if (restarted) {
    Note(BoardEvent::Level::kGood,
         name + " is back, restarted (" + std::to_string(process->health.pid) + " → " +
             std::to_string(head.health.pid) + ")",
         wall_us);
    ++process->restarts;
    process->restart_ns = now_ns;
  } else if (silent) {
    Note(BoardEvent::Level::kGood, name + " is back", wall_us);
  } else if (first) {
    Note(BoardEvent::Level::kInfo, name + ": process " + std::to_string(head.health.pid), wall_us);
  }
  process->state = state;
  process->reason = head.reason;
  process->health = head.health;
  if (restarted || silent) {
    SetLife(process, Life::kBack, now_ns);
  } else if (process->life != Life::kBack && process->life != Life::kUp) {
    SetLife(process, Life::kUp, now_ns);
  }
}

void ProcessBoard::OnSign(const std::string& name, int64_t now_ns) {
  Process* process = Find(name);
  if (process != nullptr && process->life != Life::kAwaited && process->life != Life::kDown)
    process->heard_ns = now_ns;
}

void ProcessBoard::Advance(int64_t now_ns, int64_t wall_us) {
  for (Process& process : processes_) {
    if (process.life == Life::kBack && now_ns - process.since_ns > kBackShownNs)
      SetLife(&process, Life::kUp, now_ns);
    if (process.life != Life::kUp && process.life != Life::kBack) continue;
    if (now_ns - process.heard_ns <= kSilentNs) continue;
    const bool ended = ending_.contains(process.name);
    SetLife(&process, ended ? Life::kEnded : Life::kDown, now_ns);
    if (ended) {
      Note(BoardEvent::Level::kInfo, process.name + " has ended", wall_us);
    } else {
      Note(BoardEvent::Level::kBad,
           process.name + " is silent (process " + std::to_string(process.health.pid) + ")", wall_us);
    }
  }
}

void ProcessBoard::Note(BoardEvent::Level level, std::string text, int64_t wall_us) {
  events_.push_back({++events_noted_, wall_us, level, std::move(text)});
  if (events_.size() > kMostEvents) events_.pop_front();
}

const char* ProcessBoard::Word(Life life) {
  switch (life) {
    case Life::kAwaited:
      return "awaited";
    case Life::kUp:
      return "up";
    case Life::kDown:
      return "down";
    case Life::kBack:
      return "back";
    case Life::kEnded:
      return "ended";
  }
  return "";
}

}  // namespace dmslam
