#pragma once

#include <cstdint>
#include <string>

#include "simulated_system.h"

namespace dmslam::simulation {

/// A rendered room with one person: sixty frames of 320x240 at 15 Hz, which the system tracks in half a
/// second of processor time. Reads the vocabulary of the project in DMSLAM_SOURCE_DIR, or in the working
/// folder. `folder`: for the images while they are made.
Workload MakeSmallWorkload(const std::string& folder);

/// The settings it is run with.
Settings SmallSettings(uint64_t seed, int features = 500);

/// All nodes on a bus that loses nothing, in lock-step; `folder` is the collector's. `start`: the first
/// frame.
Outcome RunUndisturbed(const Workload& workload, const Settings& settings, const std::string& folder,
                       size_t start = 0);

}  // namespace dmslam::simulation
