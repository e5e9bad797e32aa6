#include "dmslam/motion_segmentation/neighbor_vote.h"

#include <algorithm>
#include <utility>

namespace dmslam {
namespace {

/// Matches sorted into square buckets; outermost buckets take what lies beyond.
class Buckets {
 public:
  Buckets(std::span<const Match> matches, double side_px) : side_px_(side_px) {
    for (const Match& match : matches) {
      columns_ = std::max(columns_, Column(match.uv0_px.x()) + 1);
      rows_ = std::max(rows_, Column(match.uv0_px.y()) + 1);
    }
    items_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_));
    for (size_t i = 0; i < matches.size(); ++i) {
      const size_t item = Index(Column(matches[i].uv0_px.x()), Column(matches[i].uv0_px.y()));
      items_[item].push_back(static_cast<uint32_t>(i));
    }
  }
  template <typename Visit>
  void Around(const Eigen::Vector2d& uv, Visit visit) const {
    const int column = Column(uv.x()), row = Column(uv.y());
    for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(columns_ - 1, column + 1); ++c) {
        for (const uint32_t i : items_[Index(c, r)]) visit(i);
      }
    }
  }

 private:
  int Column(double px) const { return std::clamp(static_cast<int>(px / side_px_), 0, 1023); }
  size_t Index(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
  }

  double side_px_;
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<uint32_t>> items_;
};

}  // namespace

std::vector<float> NeighborShares(std::span<const Match> matches, std::span<const uint8_t> flags,
                                  int neighbors, double reach_px) {
  const Buckets buckets(matches, reach_px);
  std::vector<float> shares(matches.size(), 1.0F);
  std::vector<std::pair<double, uint32_t>> near;
  for (size_t i = 0; i < matches.size(); ++i) {
    near.clear();
    buckets.Around(matches[i].uv0_px, [&](uint32_t k) {
      if (k != i) near.emplace_back((matches[k].uv0_px - matches[i].uv0_px).squaredNorm(), k);
    });
    if (near.empty()) continue;
    const size_t count = std::min(near.size(), static_cast<size_t>(neighbors));
    std::nth_element(near.begin(), near.begin() + static_cast<ptrdiff_t>(count - 1), near.end());
    int set = 0;
    for (size_t k = 0; k < count; ++k) set += flags[near[k].second] ? 1 : 0;
    shares[i] = static_cast<float>(set) / static_cast<float>(count);
  }
  return shares;
}

}  // namespace dmslam
