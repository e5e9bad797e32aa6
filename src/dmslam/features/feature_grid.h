#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "dmslam/features/types.h"

namespace dmslam {

/// Finds the features near an undistorted pixel. A bucket index: the features are sorted by square cells of
/// the image; those outside the image (undistortion may push them there) are kept in the nearest cell and
/// found all the same.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  /// The same with its lists in other memory, which must outlive it.
  FeatureGrid(std::pmr::memory_resource* memory, const FeatureGrid& other)
      : columns_(other.columns_),
        rows_(other.rows_),
        starts_(other.starts_, memory),
        entries_(other.entries_, memory) {}

  /// Indexes features at `uv_px` (undistorted pixels, finite) with the octaves of `keypoints`, same order and
  /// length. Throws InvariantError when the lengths differ or the image has no pixels. Reuses its memory.
  void Build(std::span<const Eigen::Vector2d> uv_px, std::span<const Keypoint> keypoints, int width_px,
             int height_px);

  /// Calls visit(uint32_t feature) for each feature within `radius_px` (Euclidean, inclusive) of `center_px`
  /// whose octave is in [min_octave, max_octave]. Order: by cell (rows of cells from the top), then by
  /// feature index; it depends on nothing else.
  template <typename Visit>
  void ForEachInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave, int max_octave,
                       Visit&& visit) const {
    const CellRange range = CellsOf(center_px, radius_px);
    const double radius_squared = radius_px * radius_px;
    for (int row = range.row_begin; row < range.row_end; ++row) {
      const uint32_t begin = starts_[CellIndex(range.column_begin, row)];
      const uint32_t end = starts_[CellIndex(range.column_end - 1, row) + 1];
      for (uint32_t i = begin; i < end; ++i) {
        const Entry& entry = entries_[i];
        if (entry.octave < min_octave || entry.octave > max_octave) continue;
        const double dx = entry.x_px - center_px.x();
        const double dy = entry.y_px - center_px.y();
        if (dx * dx + dy * dy <= radius_squared) visit(entry.feature);
      }
    }
  }

  /// The same into `features`, which is cleared first.
  void FindInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave, int max_octave,
                    std::vector<uint32_t>* features) const;

  /// The same into `features`, which has room for size() of them; returns how many there are. Faster where
  /// most features of the cells are wanted or refused without pattern, as it takes no branches.
  size_t CollectInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave, int max_octave,
                         uint32_t* features) const;

  size_t size() const { return entries_.size(); }
  /// What its lists take in memory, with what their beginnings must be aligned to.
  size_t Bytes() const {
    return starts_.size() * sizeof(uint32_t) + entries_.size() * sizeof(Entry) + alignof(uint32_t) +
           alignof(Entry);
  }

 private:
  struct Entry {
    double x_px;
    double y_px;
    uint32_t feature;
    int octave;
  };
  /// Half-open; empty when the circle is (not a number, or a negative radius).
  struct CellRange {
    int column_begin = 0, column_end = 1;
    int row_begin = 0, row_end = 0;
  };

  static constexpr double kCellSizePx = 20.0;

  CellRange CellsOf(const Eigen::Vector2d& center_px, double radius_px) const;
  size_t CellIndex(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
  }
  size_t CellOf(const Eigen::Vector2d& uv_px) const;

  int columns_ = 0;
  int rows_ = 0;
  std::pmr::vector<uint32_t> starts_;  ///< first entry of each cell, and the end of the last
  std::pmr::vector<Entry> entries_;    ///< sorted by cell, then by feature
};

}  // namespace dmslam
