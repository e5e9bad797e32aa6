#include "dmslam/runtime/process_info.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

namespace dmslam {
namespace {

std::string HostName() {
  char buffer[256] = {};
  if (gethostname(buffer, sizeof(buffer) - 1) != 0) return "unknown";
  return buffer;
}

double ResidentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  long total = 0, resident = 0;
  if (!(statm >> total >> resident)) return 0;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

}  // namespace

ProcessHealth MeasureProcess(std::optional<int32_t> pid) {
  ProcessHealth health;
  health.pid = pid.value_or(getpid());
  health.host = HostName();
  health.rss_mb = ResidentMegabytes();
  return health;
}

std::string ProcessName(const std::string& role) {
  return role + " on " + HostName() + " (pid " + std::to_string(getpid()) + ")";
}

void ReturnFreeMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace dmslam
