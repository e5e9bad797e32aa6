#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "dmslam/runtime/instance_watch.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// One line about what happened.
struct BoardEvent {
  enum class Level : uint8_t { kInfo = 0, kGood = 1, kBad = 2 };
  int64_t number = 0;  ///< counts events from 1
  int64_t wall_us = 0;
  Level level = Level::kInfo;
  std::string text;
};

/// Who of the system is there: heard within a moment, silent, back after silence or as another process, or
/// gone at the end as it should. Time comes from outside.
class ProcessBoard {
 public:
  enum class Life : uint8_t { kAwaited, kUp, kDown, kBack, kEnded };
  struct Process {
    std::string name;
    Life life = Life::kAwaited;
    int64_t heard_ns = 0;  ///< last word, of whatever kind
    int64_t since_ns = 0;  ///< when `life` began
    int restarts = 0;      ///< processes heard under this name after the first one
    int64_t restart_ns = 0;
    std::string state;  ///< what it does, in a word
    std::string reason;
    bool tells = false;  ///< how it fares: it has said a status
    ProcessHealth health;
    InstanceWatch instances;
    std::set<int64_t> ids;  ///< of those who were heard by them alone
    bool needed = false;    ///< a run without it is not well
  };

  /// `names`: in the order in which they are shown.
  explicit ProcessBoard(const std::vector<std::string>& names);

  /// A status. `done`: it says that it is about to end.
  void OnStatus(const std::string& name, const StatusHead& head, const std::string& state, int64_t now_ns,
                int64_t wall_us);
  /// A word of a process that says no status; `id`: random, drawn at its start.
  void OnWord(const std::string& name, int64_t id, int64_t now_ns, int64_t wall_us);
  /// A sign of life without a status (a beacon).
  void OnSign(const std::string& name, int64_t now_ns);
  /// What one that was heard does, in a word, by what others say.
  void Does(const std::string& name, const std::string& state);
  /// A run without this one is not well.
  void Need(const std::string& name);
  /// The sequence is over for these: their silence is no failure.
  void Expect(const std::string& name) { ending_[name] = true; }
  /// Finds who has fallen silent.
  void Advance(int64_t now_ns, int64_t wall_us);
  void Note(BoardEvent::Level level, std::string text, int64_t wall_us);

  const std::vector<Process>& processes() const { return processes_; }
  const std::deque<BoardEvent>& events() const { return events_; }

  static const char* Word(Life life);

 private:
  Process* Find(const std::string& name);
  /// What it says about being there. `as`: how the event names the process, and the one that has come back.
  void Hear(Process* process, bool restarted, const std::string& as, const std::string& as_restarted,
            int64_t now_ns, int64_t wall_us);
  void SetLife(Process* process, Life life, int64_t now_ns);

  std::vector<Process> processes_;
  std::map<std::string, bool> ending_;
  std::deque<BoardEvent> events_;
  int64_t events_noted_ = 0;
};

}  // namespace dmslam
