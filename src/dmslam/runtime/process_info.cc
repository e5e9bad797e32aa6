#include "dmslam/runtime/process_info.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "dmslam/messaging/event_loop.h"

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

int64_t UsedNs() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto nanoseconds = [](const timeval& time) {
    return int64_t{time.tv_sec} * 1'000'000'000 + int64_t{time.tv_usec} * 1000;
  };
  return nanoseconds(usage.ru_utime) + nanoseconds(usage.ru_stime);
}

}  // namespace

double ProcessorShare::Percent(int64_t used_ns, int64_t now_ns) {
  constexpr int64_t kAtLeastNs = 500'000'000;
  if (asked_ns_ && now_ns - *asked_ns_ < kAtLeastNs) return percent_;
  if (asked_ns_)
    percent_ = 100.0 * static_cast<double>(used_ns - used_ns_) / static_cast<double>(now_ns - *asked_ns_);
  asked_ns_ = now_ns;
  used_ns_ = used_ns;
  return percent_;
}

ProcessHealth MeasureProcess(std::optional<int32_t> pid) {
  static thread_local ProcessorShare share;  // each thread that asks has its own
  ProcessHealth health;
  health.pid = pid.value_or(getpid());
  health.host = HostName();
  health.rss_mb = ResidentMegabytes();
  health.cpu_percent = share.Percent(UsedNs(), EventLoop::now_ns());
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
