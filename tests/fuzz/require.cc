#include <cstdio>
#include <cstdlib>

#include "fuzz_target.h"

namespace dmslam::fuzz {

void Require(bool property, const char* what) {
  if (property) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

}  // namespace dmslam::fuzz
