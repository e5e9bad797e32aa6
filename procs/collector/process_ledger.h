#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <istream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "collector/run_record.h"
#include "dmslam/runtime/instance_watch.h"

namespace dmslam {

/// What each process of a run has counted, and how often one was started again. Counters begin at zero in a
/// process that was started again: those of the ones before it are added. What a collector after this one
/// must know of it goes into the journal as notes.
class ProcessLedger {
 public:
  using Note = std::function<void(const std::string&)>;
  /// Keeps `run`'s health, memory, restarts and the frontends' statuses.
  explicit ProcessLedger(RunRecord* run) : run_(run) {}

  /// A status of this session. `keyframes`: that the map has. False: it does not count, for it is of one that
  /// writes nothing while another one of its name, which does, goes on: a rival that will be refused.
  bool Hear(const std::string& process, const ProcessHealth& health, size_t keyframes, int64_t now_ns);
  /// The same of a camera's frontend, with what it says of itself.
  void HearFrontend(const std::string& process, FrontendStatus status, size_t keyframes, int64_t now_ns);

  /// There is a journal, and what a collector before this one has noted is read. `own`: of this process.
  void Begin(Note note, const ProcessHealth& own, int64_t now_ns);
  /// A note of this ledger's kinds, "process", "heard" or "counters"; `text` stands behind the kind. Others
  /// are not read.
  void ReadNote(const std::string& kind, std::istream& text, int64_t now_ns);
  /// What each process has counted so far: where all die at once, nobody else knows it.
  void NoteCounters();

 private:
  /// Processes of one name that followed one another.
  struct Followed {
    InstanceWatch instances;
    int64_t count = 0;                     ///< of them all
    int64_t noted_epoch = 0;               ///< of the present one, as writer
    std::optional<ProcessHealth> present;  ///< as it was heard last ...
    int64_t present_ns = 0;                ///< ... and when
    std::vector<ProcessHealth> newcomers;  ///< heard since: they follow it, if it is heard no more
    ProcessHealth former;                  ///< counters of those before the present one, together
    FrontendStatus former_frontend;
  };
  bool OnProcess(const std::string& process, const ProcessHealth& heard, int64_t now_ns);
  void Count(const std::string& process, const ProcessHealth& heard, int64_t now_ns);
  static bool IsHeldBack(const ProcessHealth& heard, int64_t now_ns, Followed* known);
  void NoteProcess(const std::string& process, const ProcessHealth& heard);
  void NoteHeard(const std::string& process, const ProcessHealth& heard);
  void ReadProcess(const std::string& process, int32_t pid, std::istream& text, int64_t now_ns);
  void ReadCounters(const std::string& process, int32_t pid, std::istream& text);
  std::string CountersOf(const std::string& process) const;
  FrontendStatus* FrontendOf(const std::string& process) const;

  RunRecord* run_;
  Note note_;                                                             ///< empty before there is a journal
  std::map<std::string, Followed> processes_;                             ///< by name
  std::map<std::pair<std::string, int32_t>, ProcessHealth> heard_early_;  ///< before there was a journal
};

}  // namespace dmslam
