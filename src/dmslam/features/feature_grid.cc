#include "dmslam/features/feature_grid.h"

#include <algorithm>
#include <cmath>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Cell of a coordinate, the nearest one for coordinates outside the image.
int ClampedCell(double coordinate_px, double cell_size_px, int count) {
  const double cell = std::floor(coordinate_px / cell_size_px);
  return static_cast<int>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
}

}  // namespace

void FeatureGrid::Build(std::span<const Eigen::Vector2d> uv_px, std::span<const Keypoint> keypoints,
                        int width_px, int height_px) {
  DMSLAM_CHECK(uv_px.size() == keypoints.size(), "every keypoint needs its pixel");
  DMSLAM_CHECK(width_px > 0 && height_px > 0, "the image must have pixels");
  columns_ = static_cast<int>(std::ceil(width_px / kCellSizePx));
  rows_ = static_cast<int>(std::ceil(height_px / kCellSizePx));
  starts_.assign(CellIndex(0, rows_) + 1, 0);
  entries_.resize(uv_px.size());
  // Counting sort: count per cell, running sum, then place in order of features.
  for (const Eigen::Vector2d& uv : uv_px) ++starts_[CellOf(uv)];
  uint32_t end = 0;
  for (uint32_t& start : starts_) {
    end += start;
    start = end;
  }
  for (size_t i = uv_px.size(); i-- > 0;) {
    uint32_t& slot = starts_[CellOf(uv_px[i])];
    entries_[--slot] = {uv_px[i].x(), uv_px[i].y(), static_cast<uint32_t>(i), keypoints[i].octave};
  }
}

void FeatureGrid::FindInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave,
                               int max_octave, std::vector<uint32_t>* features) const {
  features->clear();
  ForEachInRadius(center_px, radius_px, min_octave, max_octave,
                  [features](uint32_t feature) { features->push_back(feature); });
}

size_t FeatureGrid::CollectInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave,
                                    int max_octave, uint32_t* features) const {
  const CellRange range = CellsOf(center_px, radius_px);
  const double radius_squared = radius_px * radius_px, center_x = center_px.x(), center_y = center_px.y();
  size_t count = 0;
  for (int row = range.row_begin; row < range.row_end; ++row) {
    const Entry* end = entries_.data() + starts_[CellIndex(range.column_end - 1, row) + 1];
    for (const Entry* entry = entries_.data() + starts_[CellIndex(range.column_begin, row)]; entry < end;
         ++entry) {
      const double dx = entry->x_px - center_x, dy = entry->y_px - center_y;
      const bool wanted = static_cast<int>(entry->octave >= min_octave) &
                          static_cast<int>(entry->octave <= max_octave) &
                          static_cast<int>(dx * dx + dy * dy <= radius_squared);
      features[count] = entry->feature;
      count += static_cast<size_t>(wanted);
    }
  }
  return count;
}

FeatureGrid::CellRange FeatureGrid::CellsOf(const Eigen::Vector2d& center_px, double radius_px) const {
  if (entries_.empty() || !(radius_px >= 0.0) || !center_px.allFinite()) return {};
  CellRange range;
  range.column_begin = ClampedCell(center_px.x() - radius_px, kCellSizePx, columns_);
  range.column_end = ClampedCell(center_px.x() + radius_px, kCellSizePx, columns_) + 1;
  range.row_begin = ClampedCell(center_px.y() - radius_px, kCellSizePx, rows_);
  range.row_end = ClampedCell(center_px.y() + radius_px, kCellSizePx, rows_) + 1;
  return range;
}

size_t FeatureGrid::CellOf(const Eigen::Vector2d& uv_px) const {
  return CellIndex(ClampedCell(uv_px.x(), kCellSizePx, columns_), ClampedCell(uv_px.y(), kCellSizePx, rows_));
}

}  // namespace dmslam
