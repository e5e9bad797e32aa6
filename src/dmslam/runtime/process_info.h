#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/wire/status.h"

namespace dmslam {

/// The processor time of a process, as a share of one core since it was last asked. Asked again within half a
/// second it says the same again: several nodes in one process ask at once.
class ProcessorShare {
 public:
  /// In percent; 0 the first time. `used_ns`: processor time since the start of the process; both monotonic.
  double Percent(int64_t used_ns, int64_t now_ns);

 private:
  std::optional<int64_t> asked_ns_;
  int64_t used_ns_ = 0;
  double percent_ = 0;
};

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
