#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "content_forger.h"
#include "dmslam/messaging/types.h"
#include "simulated_network.h"

namespace dmslam::simulation {

/// Something that goes wrong, once.
struct Fault {
  enum class Kind : uint8_t {
    kPause,      ///< a process stands still (SIGSTOP), and goes on
    kKill,       ///< a process dies, and another one of its role begins later
    kMove,       ///< another one of its role takes over from it
    kPartition,  ///< a host is cut off from the others
    kClockStep,  ///< a host's wall clock is set
    kForgery,    ///< a message of somebody else's, with the right checksum
    kEcho,       ///< the newest message of some channel, once more
    kFullDisk,   ///< the collector's disk takes nothing
    kKillAll,    ///< all processes and who started them die; somebody resumes the run later
    kPowerCut,   ///< ... and the hosts begin again, with what was synced
    kContent,    ///< a forged message of what is played or computed
  };
  Kind kind = Kind::kPause;
  std::string process;    ///< whom it meets
  uint32_t at_frame = 0;  ///< when so many frames were played ...
  int64_t after_ns = 0;   ///< ... and so much later
  int64_t lasts_ns = 0;   ///< until it is over; of a kill: until the next one begins
  int host = 0;           ///< that is cut off or whose clock is set; where the next process begins
  int64_t step_us = 0;    ///< by which the clock is set
  Content content = Content::kSession;
  int records = 0;  ///< who is killed dies in the middle of its work, when it has sent so many more
};

std::string ToText(const Fault& fault);

/// What one simulated run meets with: all drawn from `seed`.
struct Schedule {
  uint64_t seed = 0;
  NetworkConditions network;
  Link link = Link::kHost;
  int num_hosts = 1;
  std::map<std::string, int> host_of;        ///< where each process begins
  int64_t slowest_turn_ns = 0;               ///< a process takes up to so long until it looks again
  int64_t latest_start_ns = 0;               ///< processes begin within this time
  std::map<std::string, int64_t> begins_ns;  ///< but these, which begin so much later
  bool fresh_system = true;                  ///< they are told that nobody else can be writing
  bool meets_writers = false;                ///< processes that make the map die or move
  bool at_once = false;                      ///< faults do not wait for each other: several may be away
  bool realtime = false;                     ///< frames come at their rate, and nobody waits for the mapper
  double checkpoint_s = 10;                  ///< so often the collector keeps the map
  std::vector<Fault> faults;                 ///< in the order of their frames

  std::string ToText() const;
  /// Whether a process dies or moves.
  bool MeetsDeaths() const;
  /// Whether all of them die, and the run is resumed.
  bool IsResumed() const;
};

/// The processes of a run.
const std::vector<std::string>& Roles();

/// `num_frames`: of the sequence.
Schedule DrawSchedule(uint64_t seed, uint32_t num_frames);
/// Nothing goes wrong.
Schedule CalmSchedule();

}  // namespace dmslam::simulation
