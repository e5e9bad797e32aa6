#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "run/run_options.h"
#include "run/run_plan.h"

namespace dmslam {

/// Who writes this session already on the port and under the prefix of a run that is to begin, as its beacon
/// says; none: nobody does. The processes of a run begin without listening, so on a port that others share
/// this is asked first. Listens for half a second.
std::optional<std::string> WhoWritesSession(const RunArguments::Bus& bus, int port, uint32_t session);

}  // namespace dmslam
