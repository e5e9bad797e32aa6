#pragma once

#include <cstdint>
#include <string>

namespace dmslam {

/// What became of one simulated schedule.
struct SimulationReport {
  std::string failure;     ///< empty: every promise was kept
  std::string conditions;  ///< for messages: link, loss, faults
  int64_t published = 0;   ///< records
  int64_t delivered = 0;   ///< records applied by readers, snapshots not counted
  int64_t confirmed = 0;   ///< records of which the writer knew that another process holds them
  int64_t datagrams = 0;   ///< messages put on the wire
  int64_t parts_repaired = 0;
  int64_t snapshots = 0;
  int64_t hand_overs = 0;  ///< terms that began from a replica
  int64_t forgeries = 0;   ///< messages of somebody else, with the right checksum
  int64_t faults = 0;      ///< kills, take-overs, second writers and splits
};

/// One writer's process (restarted by a supervisor when it ends) and two to four readers on a simulated
/// network, in one thread and virtual time, all drawn from `seed`: loss up to 50 %, duplication, reordering,
/// delay, kills of either side, take-overs, accidental second writers, splits, wall clocks that are hours
/// apart, single forged messages. At the end the network heals, and then must hold:
///  - all replicas and the surviving writer have the same history: each record once and in order;
///  - exactly one writer survives;
///  - no record is missing that a writer knew to be held by another process (schedules with overlapping
///  faults, a fifth
///    of all, are exempt from this one: whoever kills all holders at once loses what they held);
///  - nobody ever kept more than the configured bounds.
/// The replicated state is the list of all records: each appends one entry and names the place where it
/// belongs.
SimulationReport SimulateSchedule(uint64_t seed);

}  // namespace dmslam
