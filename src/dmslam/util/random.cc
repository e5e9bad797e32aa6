#include "dmslam/util/random.h"

#include <cmath>
#include <numbers>

namespace dmslam {

double Random::Gaussian() {
  const double u = 1.0 - Uniform();
  const double v = Uniform();
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

}  // namespace dmslam
