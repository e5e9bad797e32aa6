#pragma once

#include <cstdint>
#include <string>

#include "simulated_system.h"

namespace dmslam::simulation {

/// How far two runs are apart.
struct Distance {
  double rmse = 1e9;    ///< between their final positions, laid onto each other [units of `other`'s map]
  int64_t tracked = 0;  ///< frames with a pose while it went on
  int64_t placed = 0;   ///< frames with a pose in the end
  int64_t other_keyframes = 0;  ///< that only one of them has
};
/// `folder`: for what is written on the way.
Distance Measure(const Outcome& outcome, const Outcome& other, const std::string& folder);

/// Of the summary; -1 where it has none.
double Number(const Outcome& outcome, const std::string& key);

/// What of the collector's files differs; empty: nothing.
std::string Difference(const Outcome& outcome, const Outcome& undisturbed);

/// What a run has lost in which processes that make the map died or moved; empty: nothing. `most_apart`: how
/// far poses may be from those of the undisturbed run. `frames_lost`: how many frames may not have been
/// tracked. `records_lost`: how many records may have been lost with who wrote them.
std::string Loss(const Outcome& outcome, const Outcome& undisturbed, double most_apart, int64_t frames_lost,
                 int64_t records_lost, const std::string& folder);

}  // namespace dmslam::simulation
