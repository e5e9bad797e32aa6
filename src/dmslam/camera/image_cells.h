#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>

#include "dmslam/camera/camera.h"

namespace dmslam {

/// The image in cells: in how many of them something is tells how widely it is spread.
inline constexpr int kCellColumns = 8, kCellRows = 6;
inline constexpr size_t kNumCells = size_t{kCellColumns} * kCellRows;
/// Half of them: what is in so many fills the image, as somebody in it does not.
inline constexpr int kFillingCells = kCellColumns * kCellRows / 2;

/// Less than kNumCells; what lies outside the image counts for the nearest cell.
inline size_t CellOf(const Camera& camera, const Eigen::Vector2d& uv_px) {
  const int column =
      std::clamp(static_cast<int>(uv_px.x() * kCellColumns / camera.width_px), 0, kCellColumns - 1);
  const int row = std::clamp(static_cast<int>(uv_px.y() * kCellRows / camera.height_px), 0, kCellRows - 1);
  return static_cast<size_t>(row) * kCellColumns + static_cast<size_t>(column);
}

}  // namespace dmslam
