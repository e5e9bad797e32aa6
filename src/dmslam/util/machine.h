#pragma once

#include <istream>
#include <string>

namespace dmslam {

/// A computer, as far as it matters to how long something takes on it.
struct Machine {
  std::string processor;  // its model, as /proc/cpuinfo names it, else as ProcessorName tells
  int cores = 0;          // that this process may use, as `nproc` counts them

  bool operator==(const Machine&) const = default;
};

Machine ThisMachine();

/// The processor that a text as /proc/cpuinfo tells of: its "model name"; where there is none, as on ARM, the
/// architecture with the maker's and the model's numbers ("aarch64, implementer 0x41, part 0xd0c").
std::string ProcessorName(std::istream& cpuinfo, const std::string& architecture);

}  // namespace dmslam
