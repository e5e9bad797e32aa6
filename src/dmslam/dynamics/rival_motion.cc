#include "dmslam/dynamics/rival_motion.h"

namespace dmslam {

void SupportWidth::Add(const Eigen::Vector2d& uv_px) {
  ++count_;
  sum_ += uv_px;
  squared_sum_ += uv_px.squaredNorm();
}

double SupportWidth::Score() const {
  return count_ == 0 ? 0.0 : squared_sum_ - sum_.squaredNorm() / static_cast<double>(count_);
}

bool RivalMotions::RivalWins(const SupportWidth& first, const SupportWidth& rival, int contradicting) const {
  return rival.count() >= kMinSupport && rival.count() >= kMinShare * contradicting &&
         rival.Score() > kMinAdvantage * first.Score();
}

}  // namespace dmslam
