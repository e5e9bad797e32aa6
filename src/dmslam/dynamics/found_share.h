#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "dmslam/camera/camera.h"

namespace dmslam {

/// How much of what the map expects is found, place by place in the image: small where somebody hides the
/// map. The image is divided into 20 x 15 cells; a place is a cell with its neighbours.
class FoundShare {
 public:
  explicit FoundShare(const Camera& camera)
      : cell_width_px_(static_cast<double>(camera.width_px) / kColumns),
        cell_height_px_(static_cast<double>(camera.height_px) / kRows) {}

  /// A landmark is expected at this pixel, and was found or not.
  void Add(const Eigen::Vector2d& uv_px, bool found) {
    Cell& cell = cells_[Index(Column(uv_px), Row(uv_px))];
    ++cell.expected;
    if (found) ++cell.found;
  }

  /// Share found around the pixel of a landmark that was found; a landmark that stands alone says little for
  /// itself: 0.5.
  double Around(const Eigen::Vector2d& uv_px) const {
    const int column = Column(uv_px), row = Row(uv_px);
    int expected = 0, found = 0;
    for (int r = std::max(0, row - 1); r <= std::min(kRows - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(kColumns - 1, column + 1); ++c) {
        expected += cells_[Index(c, r)].expected;
        found += cells_[Index(c, r)].found;
      }
    }
    return found / (expected + 1.0);
  }

 private:
  static constexpr int kColumns = 20, kRows = 15;
  struct Cell {
    int expected = 0, found = 0;
  };
  int Column(const Eigen::Vector2d& uv_px) const {
    return std::clamp(static_cast<int>(uv_px.x() / cell_width_px_), 0, kColumns - 1);
  }
  int Row(const Eigen::Vector2d& uv_px) const {
    return std::clamp(static_cast<int>(uv_px.y() / cell_height_px_), 0, kRows - 1);
  }
  static size_t Index(int column, int row) {
    return static_cast<size_t>(row) * kColumns + static_cast<size_t>(column);
  }

  double cell_width_px_, cell_height_px_;
  std::array<Cell, kColumns * kRows> cells_{};
};

}  // namespace dmslam
