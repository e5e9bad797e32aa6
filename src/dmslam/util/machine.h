#pragma once

#include <string>

namespace dmslam {

/// A computer, as far as it matters to how long something takes on it.
struct Machine {
  std::string processor;  // its model, as /proc/cpuinfo names it
  int cores = 0;          // that this process may use, as `nproc` counts them

  bool operator==(const Machine&) const = default;
};

Machine ThisMachine();

}  // namespace dmslam
