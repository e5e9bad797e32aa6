#pragma once

#include <string>

#include "dmslam/util/random.h"

namespace dmslam::simulation {

/// A power cut: of what was written into a file since it was synced last, any part may be gone. Syncs of this
/// program are noted as it makes them.
void LoseUnsynced(const std::string& path, Random* random);

}  // namespace dmslam::simulation
