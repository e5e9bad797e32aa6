#include "dmslam/util/machine.h"

#include <sys/utsname.h>

#include <fstream>
#include <thread>

namespace dmslam {
namespace {

std::string Architecture() {
  utsname names = {};
  return uname(&names) == 0 ? names.machine : "unknown processor";
}

}  // namespace

std::string ProcessorName(std::istream& cpuinfo, const std::string& architecture) {
  std::string implementer, part;
  for (std::string line; std::getline(cpuinfo, line);) {
    const size_t colon = line.find(": ");
    if (colon == std::string::npos) continue;
    const std::string value = line.substr(colon + 2);
    if (line.starts_with("model name")) return value;
    if (line.starts_with("CPU implementer") && implementer.empty()) implementer = ", implementer " + value;
    if (line.starts_with("CPU part") && part.empty()) part = ", part " + value;
  }
  return architecture + implementer + part;
}

Machine ThisMachine() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  return {ProcessorName(cpuinfo, Architecture()), static_cast<int>(std::thread::hardware_concurrency())};
}

}  // namespace dmslam
