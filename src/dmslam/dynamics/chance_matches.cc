#include "dmslam/dynamics/chance_matches.h"

#include <algorithm>
#include <cmath>

namespace dmslam {

bool ChanceMatches::Suspects(double found_share, double mean_chi2) const {
  return usual_ && found_share < options_.max_found_share &&
         mean_chi2 > options_.max_error_ratio * usual_->chi2;
}

bool ChanceMatches::Clears(double found_share, double mean_chi2) const {
  return !usual_ || found_share >= options_.max_found_share || mean_chi2 <= usual_->chi2;
}

void ChanceMatches::OnTracked(double found_share, double mean_chi2, int64_t stamp_ns) {
  if (found_share < options_.usual_share) return;
  if (!usual_) usual_ = Usual{mean_chi2, stamp_ns};
  const double since_s = std::max(0.0, static_cast<double>(stamp_ns - usual_->stamp_ns) * 1e-9);
  const double newness = 1.0 - std::exp(-since_s / options_.usual_s);
  usual_->chi2 += newness * (mean_chi2 - usual_->chi2);
  usual_->stamp_ns = std::max(usual_->stamp_ns, stamp_ns);
}

}  // namespace dmslam
