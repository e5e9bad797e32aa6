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

/// What may be lost.
struct Allowance {
  double most_apart = 0;          ///< how far poses may be from those of the undisturbed run
  int64_t frames_lost = 0;        ///< so many frames may not have been tracked
  int64_t records_lost = 0;       ///< so many records, with who wrote them
  int64_t keyframes_missing = 0;  ///< so many keyframes, without a word of why
  int64_t resumed = 0;            ///< so often it may have begun again from a checkpoint
};
/// Whether the results name anything that was lost: records, keyframes, or a map from which it went on.
bool NamesLosses(const Outcome& outcome);
/// What is missing in a run although nothing of it is named; empty: nothing.
std::string Unnamed(const Outcome& outcome, const std::string& folder);

/// What a run has lost that was on the disk when all processes died, or does not count; empty: nothing.
std::string LossByResuming(const Outcome& outcome, const std::string& folder);

/// What a run has lost beyond that; empty: nothing.
std::string Loss(const Outcome& outcome, const Outcome& undisturbed, const Allowance& allowed,
                 const std::string& folder);

}  // namespace dmslam::simulation
