#pragma once

#include <string>

#include "dmslam/wire/status.h"

namespace dmslam {

/// Process id, host, resident memory and processor share of this process, as the system tells them.
ProcessHealth MeasureProcess();

/// "mapper on host (pid 17)".
std::string ProcessName(const std::string& role);

}  // namespace dmslam
