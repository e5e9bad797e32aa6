#include "viewer/process_board.h"

#include <algorithm>

namespace dmslam {
namespace {

constexpr int64_t kSilentNs = 2'500'000'000;  // statuses come once a second
constexpr int64_t kBackShownNs = 15'000'000'000;
constexpr size_t kMostEvents = 200;
constexpr size_t kMostIds = 64;

}  // namespace

ProcessBoard::ProcessBoard(const std::vector<std::string>& names) {
  for (const std::string& name : names)
    processes_.push_back({.name = name, .state = {}, .reason = {}, .health = {}, .instances = {}, .ids = {}});
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
  const bool restarted = process->instances.IsNew(head.health, now_ns) && process->life != Life::kAwaited;
  const std::string pid = std::to_string(head.health.pid);
  Hear(process, restarted, ": process " + pid, " (" + std::to_string(process->health.pid) + " → " + pid + ")",
       now_ns, wall_us);
  process->state = state;
  process->reason = head.reason;
  process->tells = true;
  process->health = head.health;
}

void ProcessBoard::OnWord(const std::string& name, int64_t id, int64_t now_ns, int64_t wall_us) {
  Process* process = Find(name);
  if (process == nullptr) return;
  if (process->ids.size() >= kMostIds) process->ids.clear();
  const bool restarted = process->ids.insert(id).second && process->life != Life::kAwaited;
  Hear(process, restarted, " is there", "", now_ns, wall_us);
}

void ProcessBoard::Hear(Process* process, bool restarted, const std::string& as,
                        const std::string& as_restarted, int64_t now_ns, int64_t wall_us) {
  const bool first = process->life == Life::kAwaited;
  const bool silent = process->life == Life::kDown;
  process->heard_ns = now_ns;
  if (restarted) {
    Note(BoardEvent::Level::kGood, process->name + " is back, restarted" + as_restarted, wall_us);
    ++process->restarts;
    process->restart_ns = now_ns;
  } else if (silent) {
    Note(BoardEvent::Level::kGood, process->name + " is back", wall_us);
  } else if (first) {
    Note(BoardEvent::Level::kInfo, process->name + as, wall_us);
  }
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

void ProcessBoard::Does(const std::string& name, const std::string& state) {
  Process* process = Find(name);
  if (process != nullptr && process->tells) process->state = state;
}

void ProcessBoard::Need(const std::string& name) {
  if (Process* process = Find(name)) process->needed = true;
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
      const std::string which = process.tells ? " (process " + std::to_string(process.health.pid) + ")" : "";
      Note(BoardEvent::Level::kBad, process.name + " is silent" + which, wall_us);
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
