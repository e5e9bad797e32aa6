#include "dmslam/dynamics/rival_motion.h"

namespace dmslam {

void SupportWidth::Add(const Eigen::Vector2d& uv_px, size_t cell) {
  cells_.set(cell);
  ++count_;
  sum_ += uv_px;
  squared_sum_ += uv_px.squaredNorm();
}

double SupportWidth::Score() const {
  return count_ == 0 ? 0.0 : squared_sum_ - sum_.squaredNorm() / static_cast<double>(count_);
}

double SupportWidth::CellScore() const {
  return count_ == 0 ? 0.0 : static_cast<double>(cells_.count()) * Score() / static_cast<double>(count_);
}

bool RivalMotions::RivalWins(const SupportWidth& first, const SupportWidth& rival, int contradicting) const {
  if (rival.count() < kMinSupport || rival.count() < kMinShare * contradicting) return false;
  const bool holds_more_cells =
      rival.CellScore() > kMinAdvantage * first.CellScore() && rival.Score() > first.Score();
  return holds_more_cells || rival.Score() > kMinAdvantage * first.Score();
}

}  // namespace dmslam
