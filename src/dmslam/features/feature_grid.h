#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <utility>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/util/vector_path.h"

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
        x_px_(other.x_px_, memory),
        y_px_(other.y_px_, memory),
        octaves_(other.octaves_, memory),
        features_(other.features_, memory) {}

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
    const Circle circle(center_px, radius_px, min_octave, max_octave);
    ForEachRun(circle, [&](const Run& run) {
      for (uint32_t i = run.begin; i < run.end; ++i) {
        if (octaves_[i] < min_octave || octaves_[i] > max_octave) continue;
        if (circle.Holds(x_px_[i], y_px_[i])) visit(features_[i]);
      }
    });
  }

  /// The same in order, in batches of at most kBatch: visit(std::span<uint32_t> features), which may write
  /// there.
  static constexpr size_t kBatch = 128;
  template <typename Visit>
  void ForEachBatchInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave,
                            int max_octave, Visit&& visit) const {
    const Circle circle(center_px, radius_px, min_octave, max_octave);
    std::array<uint32_t, kBatch + kSlack> batch;
    size_t count = 0;
    ForEachRun(circle, [&](Run run) {
      while (run.begin < run.end) {
        if (count == kBatch) visit(std::span<uint32_t>(batch.data(), std::exchange(count, 0)));
        const uint32_t end = std::min<uint32_t>(run.end, run.begin + static_cast<uint32_t>(kBatch - count));
        count += CollectOf(circle, {std::exchange(run.begin, end), end}, batch.data() + count);
      }
    });
    if (count > 0) visit(std::span<uint32_t>(batch.data(), count));
  }

  /// The same into `features`, which is cleared first.
  void FindInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave, int max_octave,
                    std::vector<uint32_t>* features) const;

  /// The same into `features`, which has room for size() + kSlack of them; returns how many there are. Faster
  /// where most features of the cells are wanted or refused without pattern, as it takes no branches.
  static constexpr size_t kSlack = 8;
  size_t CollectInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave, int max_octave,
                         uint32_t* features, VectorPath path = VectorPath::kWidest) const;

  size_t size() const { return features_.empty() ? 0 : features_.size() - kSlack; }
  /// What its lists take in memory, with what their beginnings must be aligned to.
  size_t Bytes() const {
    return (starts_.size() + 4 * features_.size()) * sizeof(uint32_t) + 5 * alignof(uint32_t);
  }

 private:
  struct Circle {
    Circle(const Eigen::Vector2d& center_px, double radius, int min, int max)
        : x_px(static_cast<float>(center_px.x())),
          y_px(static_cast<float>(center_px.y())),
          radius_px(static_cast<float>(radius)),
          min_octave(min),
          max_octave(max) {}
    bool Holds(float x, float y) const {
      const float dx = x - x_px, dy = y - y_px;
      return dx * dx + dy * dy <= radius_px * radius_px;
    }
    float x_px, y_px, radius_px;
    int min_octave, max_octave;  ///< that are looked for in it
  };
  /// Half-open; empty when the circle is (not a number, or a negative radius).
  struct Rows {
    int begin = 0, end = 0;
  };
  /// Entries of a row of cells, as far as they may lie in a circle; half-open.
  struct Run {
    uint32_t begin, end;
  };

  static constexpr double kCellSizePx = 20.0;
  static constexpr double kSmallRadiusPx = 1.5 * kCellSizePx;
  static constexpr double kRoundingPx = 1e-3;  // more than what a coordinate loses as a float

  /// Calls visit(Run) for each row of cells that the circle reaches, from the top. Of a small circle, which
  /// hardly leaves out a cell, with that of the square around it.
  template <typename Visit>
  void ForEachRun(const Circle& circle, const Visit& visit) const {
    const Rows rows = RowsOf(circle);
    if (rows.begin == rows.end) return;
    const double radius = circle.radius_px;
    if (radius > kSmallRadiusPx) {
      for (int row = rows.begin; row < rows.end; ++row) visit(RunOf(circle, row));
      return;
    }
    const Run columns =
        ColumnsBetween(circle.x_px - radius - kRoundingPx, circle.x_px + radius + kRoundingPx);
    for (int row = rows.begin; row < rows.end; ++row) visit(RunOf(columns, row));
  }
  Rows RowsOf(const Circle& circle) const;
  /// The part of the row that the circle reaches; the outermost rows go on beyond the image.
  Run RunOf(const Circle& circle, int row) const;
  Run RunOf(const Run& columns, int row) const {
    const size_t first = CellIndex(0, row);
    return {starts_[first + columns.begin], starts_[first + columns.end]};
  }
  /// The columns of cells between two coordinates, half-open.
  Run ColumnsBetween(double left_px, double right_px) const;
  /// Those of the run's entries that lie in the circle, into `features`, which has room for all of them and
  /// kSlack more.
  size_t CollectOf(const Circle& circle, const Run& run, uint32_t* features,
                   VectorPath path = VectorPath::kWidest) const;
  size_t CellIndex(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
  }
  size_t CellOf(const Eigen::Vector2d& uv_px) const;

  int columns_ = 0;
  int rows_ = 0;
  std::pmr::vector<uint32_t> starts_;  ///< first entry of each cell, and the end of the last
  // The entries, sorted by cell, then by feature; kSlack more at the end, which nobody finds.
  std::pmr::vector<float> x_px_;
  std::pmr::vector<float> y_px_;
  std::pmr::vector<int32_t> octaves_;
  std::pmr::vector<uint32_t> features_;
};

}  // namespace dmslam
