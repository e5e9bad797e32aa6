#include "dmslam/util/check.h"

namespace dmslam {

void FailInvariant(const char* condition, const char* file, int line, const char* message) {
  throw InvariantError(std::string(file) + ":" + std::to_string(line) + ": " + message + " (" + condition +
                       ")");
}

}  // namespace dmslam
