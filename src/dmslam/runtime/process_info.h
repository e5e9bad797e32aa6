#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/wire/status.h"

namespace dmslam {

/// Process id, host, resident memory and processor share of this process, as the system tells them; `pid`:
/// under which it goes instead, where several are simulated in one.
ProcessHealth MeasureProcess(std::optional<int32_t> pid = std::nullopt);

/// "mapper on host (pid 17)".
std::string ProcessName(const std::string& role);

/// Gives free memory inside the heap back to the system: in a process that runs for hours what lives long and
/// what lives short come to lie side by side, and the heap would grow for ever more slowly. Takes
/// milliseconds.
void ReturnFreeMemory();

}  // namespace dmslam
