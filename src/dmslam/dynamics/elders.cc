#include "dmslam/dynamics/elders.h"

#include <algorithm>
#include <functional>

namespace dmslam {

std::optional<double> Elders::FromAge(std::span<const double> ages_s) {
  if (!options_.elders) return std::nullopt;
  const size_t wanted = std::max(static_cast<size_t>(options_.min_elders),
                                 static_cast<size_t>(options_.share * static_cast<double>(ages_s.size())));
  if (ages_s.size() <= wanted) return std::nullopt;
  std::vector<double>& sorted = sorted_ages_s_;
  sorted.assign(ages_s.begin(), ages_s.end());
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<ptrdiff_t>(wanted), sorted.end(),
                   std::greater<>());
  return std::min(sorted[wanted], trusted_age_s_);
}

double Elders::YoungFactor(int agreeing, int young) const {
  return std::min(1.0, options_.young_weight * agreeing / std::max(1, young));
}

}  // namespace dmslam
