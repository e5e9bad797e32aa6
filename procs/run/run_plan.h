#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "run/child.h"
#include "run/resume.h"
#include "run/run_options.h"

namespace dmslam {

/// Who is started for a run, and how.
struct RunPlan {
  std::vector<ChildSpec> pipeline;      ///< mapper, loop closer, frontend, collector, player: in this order
  std::vector<ChildSpec> companions;    ///< logger, viewer: nobody waits for their end
  std::optional<ChildSpec> replay_end;  ///< of a replay: plays the end of the sequence again
  std::string table;                    ///< file with what the collector printed
};

/// Where a run writes, and where its programs are.
struct RunPlace {
  std::string programs;  ///< folder of the programs
  std::string out;
  int port = 0;
  bool terminal = false;              ///< standard error is one: the collector shows its progress there
  uint32_t session = 0;               ///< 0: one is chosen
  std::optional<ResumePoint> resume;  ///< the run goes on from there
  std::string LogOf(const std::string& name) const { return out + "/log/" + name + ".log"; }
};

/// Throws InputError where a program of somebody else's that the run needs is not there.
void CheckTools(const RunArguments& arguments);

/// Reads what it must: the map's session, the log that is replayed. Throws InputError.
RunPlan MakeRunPlan(const RunArguments& arguments, const RunPlace& place);

/// Ids of a run come after those of the map that it begins in. Throws InputError.
uint32_t ChooseSession(const RunArguments::MapFiles& map);

/// The LCM URL of all processes of a run.
std::string BusUrl(const RunArguments::Bus& bus, int port);

/// A port between 20000 and 49999 that nobody on this host is bound to.
int FreePort();

/// What a process said before it failed, from its log: its last error, or what its command line lacked.
std::string LastWords(const std::string& name, const std::string& log);

}  // namespace dmslam
