#include "dmslam/util/machine.h"

#include <fstream>
#include <thread>

namespace dmslam {
namespace {

std::string ProcessorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

}  // namespace

Machine ThisMachine() { return {ProcessorName(), static_cast<int>(std::thread::hardware_concurrency())}; }

}  // namespace dmslam
